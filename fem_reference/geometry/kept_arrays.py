"""Arrays kept on disk because they take long to make: written atomically, and made anew where damaged."""

import logging
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

log = logging.getLogger(__name__)

Arrays = dict[str, Any]


def kept[T](path: Path, make: Callable[[], T], to_arrays: Callable[[T], Arrays], of_arrays: Callable[[Arrays], T]) -> T:
    """The value that ``of_arrays`` reads from the file at ``path``; without one, the value of ``make``, stored by
    ``to_arrays``.
    """
    found = _read(path, of_arrays)
    if found is None:
        found = make()
        _write(path, to_arrays(found))
    return found


def _read[T](path: Path, of_arrays: Callable[[Arrays], T]) -> T | None:
    """The value in a file, None where none can be read completely."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return of_arrays(dict(arrays))
    except Exception as error:  # zipfile and numpy raise many types of errors on a damaged file
        log.warning("%s: damaged, made anew: %s", path, error)
        return None


def _write(path: Path, arrays: Arrays) -> None:
    """Store arrays, safely for several processes; warn where they cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent, prefix=".") as folder:
            part = Path(folder) / path.name
            np.savez(part, allow_pickle=False, **arrays)
            part.replace(path)
    except OSError as why:
        log.warning("%s: not kept: %s", path, why)
