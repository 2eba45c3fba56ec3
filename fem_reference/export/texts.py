"""The texts beside exported data: how to read it, how to return frames. The texts are files of this folder."""

from collections.abc import Sequence
from pathlib import Path
from string import Template

from fem_reference.foundations.version import __version__
from fem_reference.scenes.muscle import MuscleCase

_FEBIO_FILES = """\
| `scene.feb` | the same for FEBio (format 4.0); `FEBIO.md` says what is the same and what is not |
| `tet10.csv` | the ten nodes of each of its elements, in the order of FEBio |
"""
_NO_STATES = """
The reference was solved without `reference.store_state = true`: the arrays that follow from its states are not here.
"""


def readme(case: MuscleCase, *, febio: bool) -> str:
    """Instructions for the files of an export; with FEBio's among them or without."""
    more = _FEBIO_FILES if febio else ""
    return _filled("README.md", title=case.title, name=case.name, version=__version__, more=more)


def febio_readme(case: MuscleCase, notes: Sequence[str]) -> str:
    """Text on similarities and differences of cases in FEBio, with the ``notes`` on this one."""
    here = (
        "".join(f"- {note}\n" for note in notes)
        or "- no springs at points of the surface, no bone that overlaps the muscle at rest\n"
    )
    return _filled("FEBIO.md", title=case.title, first=str(case.frames.first), here=here)


def paraview_readme(case: MuscleCase, unit: str, *, states: bool) -> str:
    """The content of a collection for ParaView, whose times are in ``unit``; with ``states`` of the reference or without."""
    lacking = "" if states else _NO_STATES
    return _filled("PARAVIEW.md", title=case.title, name=case.name, version=__version__, unit=unit, lacking=lacking)


def candidate() -> str:
    """An example of the file ``candidate.toml`` beside frames."""
    return _filled("candidate.toml")


def _filled(file: str, **values: str) -> str:
    return Template((Path(__file__).parent / file).read_text(encoding="utf-8")).substitute(values)
