"""The folder of an export, which is written completely or not at all, and texts from the templates next to this module."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from string import Template

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.version import __version__
from fem_reference.io import files
from fem_reference.scenes.case import Case


def check(folder: Path) -> None:
    """Raise InputError unless ``folder`` is missing or empty."""
    if folder.is_file() or (folder.is_dir() and any(folder.iterdir())):
        got = f'"{folder}", {"a file" if folder.is_file() else "which is not empty"}'
        raise InputError("--to", got, "a new or empty folder")


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A context with a temporary folder, which is renamed to ``folder`` on success and removed on failure.

    Raises InputError unless ``folder`` is missing or empty.
    """
    folder = folder.resolve()
    check(folder)
    files.clear(folder)
    part = folder.with_name(f".{folder.name}-{os.getpid()}")
    above = [parent for parent in part.parents if not parent.exists()]
    files.make_folder(part)
    try:
        yield part
        part.replace(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
        for parent in above:
            with suppress(OSError):  # the folder is not empty
                parent.rmdir()


def write_text(path: Path, case: Case, file: str | None = None, **values: str) -> None:
    """Write the template ``file``, by default the one with the name of ``path``, filled with ``values`` and facts of ``case``."""
    template = Template((Path(__file__).parent / (file or path.name)).read_text(encoding="utf-8"))
    known = {
        "title": case.title,
        "name": case.name,
        "version": __version__,
        "first": str(case.numbers[0]),
        "scene": case.key,
    }
    files.write_text(path, template.substitute(known | values))
