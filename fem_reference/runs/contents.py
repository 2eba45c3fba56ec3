"""The contents of run.json as a record. It is parsed strictly: a file with any damage is rejected."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import AfterValidator, ConfigDict, Field

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import said
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Name, Record, increasing, rule
from fem_reference.io import files, texts
from fem_reference.scenes.muscle import LAST_FRAME, MOST_FRAMES

Status = Literal[
    "converged",
    "denied",
    "diverged",
    "inverted",
    "collapsed",
    "limit point",
    "out of steps",
    "timed out",
    "stalled",
    "crashed",
    "stopped",
]
FORMAT = 1
# The contents of run.json while a run is being solved.
RunJson = dict[str, Any]


class Origin(Record):
    """The part of the provenance of a run on which results depend."""

    model_config = ConfigDict(frozen=True, strict=True, extra="allow")
    versions: dict[str, str] = Field(default_factory=dict)
    mesh: dict[str, float | str] = Field(default_factory=dict)


class Contents(Record):
    """The contents of run.json for a finished run."""

    format: Literal[1]
    name: Name
    solver: str
    status: Status
    message: str
    frames: tuple[int, ...]
    numbers: Annotated[
        tuple[Annotated[int, Field(ge=0, le=LAST_FRAME)], ...],
        Field(min_length=1, max_length=MOST_FRAMES),
        AfterValidator(partial(increasing, want="frame numbers that increase")),
    ]
    scalars: dict[str, tuple[float | None, ...]]
    residuals: tuple[tuple[float, ...], ...] = ()
    cost: dict[str, float]
    origin: Origin
    parts: tuple[str, ...]

    _check_scalars = rule(
        lambda one: all(len(values) == len(one.numbers) for values in one.scalars.values()),
        "as many values of each scalar as frame numbers",
    )


def frame_file(number: float, suffix: str) -> str:
    """The name of a file for the frame ``number``. Raises ValueError if the number is not an integer, as two frames might then have
    the same file.

    >>> frame_file(10, ".vtp")
    'frame_0010.vtp'
    """
    if number % 1:
        raise ValueError(f"frame {number:g} has no file, as its number is not an integer")
    return f"frame_{number:04.0f}{suffix}"


def amend(folder: Path, **changes: Any) -> None:
    """Change the values of keys in the run.json of the run in ``folder``."""
    place = folder / "run.json"
    stored = texts.read_json(place, "a run")
    files.write_text(place, json.dumps(stored | changes, indent=1, allow_nan=False))


def vector_scalars(name: str, vector: Floats) -> dict[str, float]:
    """The components of a ``vector`` (3,) as scalars of a frame, each with a name that consists of ``name`` and its axis."""
    return {f"{name}_{axis}": float(value) for axis, value in zip("xyz", vector, strict=True)}


def vector_names(scalars: Mapping[str, Floats], kind: str) -> list[str]:
    """The names of all vectors of a ``kind`` whose components are in ``scalars``; for forces, the names of the bones.

    >>> vector_names(dict.fromkeys(vector_scalars("force_on_femur", np.zeros(3))), "force_on_")
    ['femur']
    """
    return [key[len(kind) : -2] for key in scalars if key.startswith(kind) and key.endswith("_x")]


def scalar_vectors(scalars: Mapping[str, Floats], kind: str, name: str) -> Floats:
    """The vectors (f, 3) of a ``kind`` with a ``name``, from components in ``scalars``. Raises InputError if there are none."""
    keys = [f"{kind}{name}_{axis}" for axis in "xyz"]
    if not set(keys) <= set(scalars):
        known = ", ".join(vector_names(scalars, kind))
        want = f"one of {known}" if known else "a run of the reference: this run has no forces"
        raise InputError("bone", f'"{name}"', want)
    return np.stack([scalars[key] for key in keys], axis=1)


def point(centre: ArrayLike) -> Floats:
    """The point (3,) [mm] that a user gives as ``centre``. Raises InputError unless it consists of three finite numbers."""
    try:
        found = np.asarray(centre, float)
    except (TypeError, ValueError, OverflowError):
        found = np.full(1, np.nan)
    if found.shape != (3,) or not np.isfinite(found).all():
        raise InputError("centre", said(centre), "a point: three finite numbers [mm]")
    return found
