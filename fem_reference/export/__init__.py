"""Export of a problem: a folder of open formats, and FEBio's own. Frames come back by ``solvers.recorded``."""

import logging
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

from fem_reference.export import febio, open_formats, texts
from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.problems.muscle import Problem
from fem_reference.scenes.muscle import MuscleCase

log = logging.getLogger(__name__)

Format = Literal["open", "febio"]
FORMATS: tuple[Format, ...] = get_args(Format)


def check(folder: Path) -> None:
    """InputError unless ``folder`` is free to be written: not there, or empty."""
    if folder.is_file():
        raise InputError("--to", f'"{folder}", a file', "a folder that is not there yet, or empty")
    if folder.is_dir() and any(folder.iterdir()):
        raise InputError("--to", f'"{folder}", which is not empty', "a folder that is not there yet, or empty")


def export(scene: MuscleCase, build: Callable[[], Problem], folder: Path, form: Format) -> list[str]:
    """Write the problem that ``build`` makes of a ``scene`` into ``folder``, whole or not at all; the names of its files.

    ``"febio"`` adds FEBio's own file to the open ones. InputError where the folder is not free, or FEBio has not the same.
    """
    folder = folder.resolve()
    check(folder)
    if form == "febio":
        febio.check(scene)
    problem = build()
    folder.parent.mkdir(parents=True, exist_ok=True)
    files.clear(folder)
    part = folder.with_name(f".{folder.name}-{os.getpid()}")
    part.mkdir()
    try:
        _write(scene, problem, part, form)
        written = sorted(str(path.relative_to(part)) for path in part.rglob("*") if path.is_file())
        part.replace(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    log.info("%s: %d files in %s", scene.name, len(written), folder)
    return written


def _write(scene: MuscleCase, problem: Problem, folder: Path, form: Format) -> None:
    open_formats.write(scene, problem, folder)
    files.write_text(folder / "candidate.toml", texts.candidate())
    if form == "febio":
        febio.write(problem, folder)
        files.write_text(folder / "FEBIO.md", texts.febio_readme(scene))
    files.write_text(folder / "README.md", texts.readme(scene, febio=form == "febio"))
