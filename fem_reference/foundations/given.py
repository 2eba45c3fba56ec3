"""Checks and descriptions of arguments from Python callers, which may be of any type."""

from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.errors import InputError


def said(value: object) -> str:
    """Describe a value for a message: the shape of an array, or the type and the repr of any other value."""
    return f"an array {value.shape}" if isinstance(value, np.ndarray) else f"{type(value).__name__} {value!r}"


def path(given: Any, place: str) -> Path:
    """Convert ``given`` to a path, which need not exist; InputError that names ``place`` if it cannot be a path."""
    if not isinstance(given, str | Path) or not str(given):
        raise InputError(place, said(given), "a path")
    try:
        (Path(given) / "x").exists()
        Path(given).resolve()
        str(given).encode()
    except (OSError, ValueError) as error:  # the path is too long or contains a null character
        raise InputError(place, said(given), f"a path that can exist ({error})") from error
    return Path(given)
