"""Export of a problem: open formats, and FEBio's own; of runs, for ParaView. Frames come back by ``solvers.recorded``."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

from fem_reference.export import febio, febio_contact
from fem_reference.export.folders import check, new_folder, write_text
from fem_reference.foundations.errors import InputError
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.common import open_formats

log = logging.getLogger(__name__)

Format = Literal["open", "febio"]
FORMATS: tuple[Format, ...] = get_args(Format)
_FEBIO_FILES = """\
| `scene.feb` | the same for FEBio (format 4.0); `FEBIO.md` says what is the same and what is not |
| `tet10.csv` | the ten nodes of each of its elements, in the order of FEBio |
"""
_NO_DIFFERENCE = "no springs at points of the surface, no bone that overlaps the muscle at rest"


def export(case: MuscleCase, build: Callable[[], MuscleProblem], folder: Path, form: Format) -> list[str]:
    """Write the problem that ``build`` makes of a ``case`` into ``folder``, whole or not at all; the names of its files.

    ``"febio"`` adds FEBio's own file to the open ones, and warns where FEBio's model differs. InputError where the folder is
    not free, or FEBio has not the same.
    """
    if not isinstance(form, str) or form not in FORMATS:
        raise InputError("form", repr(form), f"one of {', '.join(FORMATS)}")
    check(folder)
    if form == "febio":
        febio.check(case)
    with new_folder(folder) as part:  # whether it can be written shows before a problem is built
        _write(case, build(), part, form)
        written = sorted(str(path.relative_to(part)) for path in part.rglob("*") if path.is_file())
    log.info("%s: %d files in %s", case.name, len(written), folder)
    return written


def _write(case: MuscleCase, problem: MuscleProblem, folder: Path, form: Format) -> None:
    open_formats.write(problem, folder, {"case": case.name, "title": case.title})
    write_text(folder / "candidate.toml", case)
    write_text(folder / "README.md", case, more=_FEBIO_FILES if form == "febio" else "")
    if form == "febio":
        differences = febio_contact.notes(problem)
        for difference in differences:
            log.warning("another model in FEBio: %s", difference)
        febio.write(problem, folder)
        write_text(folder / "FEBIO.md", case, here="".join(f"- {one}\n" for one in differences or [_NO_DIFFERENCE]))
