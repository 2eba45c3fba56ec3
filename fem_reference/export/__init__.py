"""Export of problems in open formats and for FEBio, and of runs for ParaView. ``solvers.recorded`` reads results back."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

from fem_reference.export import febio, febio_contact, febio_several
from fem_reference.export.folders import check, new_folder, write_text
from fem_reference.foundations.errors import InputError
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.problems.of_case import CaseProblem
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.common import open_formats

log = logging.getLogger(__name__)

Format = Literal["open", "febio"]
FORMATS: tuple[Format, ...] = get_args(Format)
_FEBIO_FILES = """\
| `scene.feb` | the same scene for FEBio (format 4.0); `FEBIO.md` lists counterparts and differences |
| `tet10.csv` | the ten nodes of each element of `scene.feb`, in FEBio's order |
"""
_FEBIO_OF_ALL = """
`scene.feb` is one file of all muscles for FEBio (format 4.0). FEBio writes `nodes_NAME.txt` for each muscle: move it to the
folder `NAME` as `nodes.txt`, and run the script of `FEBIO.md` there.
"""
_NO_DIFFERENCE = "no springs at points of the surface, no bone that overlaps the muscle at rest"


def export(case: Case, build: Callable[[], CaseProblem], folder: Path, form: Format) -> list[str]:
    """Write the problem that ``build`` creates from a ``case`` into ``folder``, and return the names of the files.

    The form ``"febio"`` adds FEBio's input file to the open formats and logs the differences from the reference as warnings. If
    there are several muscles, each has a folder with its name, and there is one input file for all of them. Raises InputError if
    ``folder`` is a file or is not empty, or if FEBio lacks an effect of the case. After a failure no folder is left behind.
    """
    if not isinstance(form, str) or form not in FORMATS:
        raise InputError("form", repr(form), f"one of {', '.join(FORMATS)}")
    check(folder)
    for one in _parts(case) if form == "febio" else ():
        febio.check(one)
    with new_folder(folder) as part:  # created first, so that an error is raised before the problem is built
        problem = build()
        if isinstance(problem, MusclesProblem):
            _write_several(case, problem, part, form)
        else:
            _write(_parts(case)[0], _muscle(problem), part, _FEBIO_FILES if form == "febio" else "")
        if form == "febio":
            _write_febio(case, problem, part)
        written = sorted(str(path.relative_to(part)) for path in part.rglob("*") if path.is_file())
    log.info("%s: %d files in %s", case.name, len(written), folder)
    return written


def _parts(case: Case) -> tuple[MuscleCase, ...]:
    return tuple(casefile.muscle(one) for one in case.parts or (case,))


def _muscle(problem: CaseProblem) -> MuscleProblem:
    if problem.muscle is None:
        raise InputError("export", "a scalar field", "a muscle")
    return problem.muscle


def _write(case: MuscleCase, problem: MuscleProblem, folder: Path, more: str) -> None:
    open_formats.write(problem, folder, {"case": case.name, "title": case.title})
    write_text(folder / "candidate.toml", case)
    write_text(folder / "README.md", case, more=more)


def _write_several(case: Case, problem: MusclesProblem, folder: Path, form: Format) -> None:
    """Write a folder for each muscle, and a README for all of them."""
    for part, (name, one) in zip(_parts(case), problem.problems.items(), strict=True):
        (folder / name).mkdir()
        _write(part.model_copy(update={"name": case.name}), one, folder / name, "")
        if form == "febio":
            febio.write_nodes(one, folder / name)
    near = ", ".join(" and ".join(pair) for pair in problem.pairs) or "no two"
    names = "\n".join(f"- `{name}`" for name in problem.problems)
    write_text(
        folder / "README.md", case, "MUSCLES.md", here=names, near=near, more=_FEBIO_OF_ALL if form == "febio" else ""
    )


def _write_febio(case: Case, problem: CaseProblem, folder: Path) -> None:
    """Write FEBio's input file, and a text about the differences between FEBio's model and the reference."""
    if isinstance(problem, MusclesProblem):
        differences = febio_several.notes(problem)
        febio.write_model(febio_several.model(problem), folder)
    else:
        differences = febio_contact.notes(_muscle(problem))
        febio.write(_muscle(problem), folder)
    for difference in differences:
        log.warning("FEBio's model differs: %s", difference)
    write_text(folder / "FEBIO.md", case, here="".join(f"- {one}\n" for one in differences or [_NO_DIFFERENCE]))
