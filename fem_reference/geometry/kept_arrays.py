"""Arrays that are kept on disk because they take long to make: whole or not at all, and made anew where they are damaged."""

import logging
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

log = logging.getLogger(__name__)


def read[T](path: Path, made: Callable[[dict[str, Any]], T]) -> T | None:
    """What ``made`` makes of the arrays of a file, None where there is none that can be read whole."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            return made(dict(kept))
    except Exception as error:  # zipfile and numpy raise whatever occurs to them over a damaged file
        log.warning("%s: damaged, made anew: %s", path, error)
        return None


def write(path: Path, arrays: dict[str, Any]) -> None:
    """Keep arrays, also where several processes do so; where they cannot be written a warning says so."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".") as folder:
            part = Path(folder) / path.name
            np.savez(part, allow_pickle=False, **arrays)
            part.replace(path)
    except OSError as why:
        log.warning("%s: not kept: %s", path, why)
