"""Arguments of any type from callers in Python: described for messages, or checked as a path."""

from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.errors import InputError


def said(value: object) -> str:
    """A value as messages show it."""
    return f"an array {value.shape}" if isinstance(value, np.ndarray) else f"{type(value).__name__} {value!r}"


def path(given: Any, place: str) -> Path:
    """The ``given`` path, whether it exists or not; InputError if it cannot be a path."""
    if not isinstance(given, str | Path) or not str(given):
        raise InputError(place, said(given), "a path")
    try:
        (Path(given) / "x").exists()
        Path(given).resolve()
        str(given).encode()
    except (OSError, ValueError) as error:  # too long, or with a null character
        raise InputError(place, said(given), f"a path that can exist ({error})") from error
    return Path(given)
