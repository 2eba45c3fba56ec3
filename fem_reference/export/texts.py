"""The texts beside exported data: how to read it, how to return frames. The texts are files of this folder."""

from pathlib import Path
from string import Template

from fem_reference.foundations.version import __version__
from fem_reference.io import files
from fem_reference.scenes.muscle import MuscleCase


def write(path: Path, case: MuscleCase, file: str | None = None, **values: str) -> None:
    """Write the text of a ``file`` of this folder, by default that of the same name, with facts of the ``case`` and ``values``."""
    template = Template((Path(__file__).parent / (file or path.name)).read_text(encoding="utf-8"))
    known = {"title": case.title, "name": case.name, "version": __version__, "first": str(case.frames.first)}
    files.write_text(path, template.substitute(known | values))
