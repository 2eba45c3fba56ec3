"""Python processes of our own: they import this copy of the package and nothing from the folder that they are started in."""

import os
import sys
from pathlib import Path

_ROOT = Path(__file__).resolve().parent.parent.parent


def command(*words: str) -> list[str]:
    """The command line of a Python that does not look for modules where it is started, with ``words`` behind it."""
    return [sys.executable, "-P", *words]


def environment(**settings: str) -> dict[str, str]:
    """Our environment with this copy of the package before any other, and with ``settings``."""
    theirs = [str(Path(path).absolute()) for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    paths = [str(_ROOT), *theirs]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), **settings}
