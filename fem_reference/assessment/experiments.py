"""Measurements of real muscles: facts from publications with their uncertainty and origin, and a record of each experiment."""

import csv
import math
import tomllib
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, parse
from fem_reference.scenes.case import HOME

FOLDER = HOME / "validation" / "experiments"
NAME = "measured.csv"
_NUMBERS = {"value": float, "sd": float, "n": int}
Kind = Literal["measurement", "model", "bands"]
_Text = Annotated[str, StringConstraints(min_length=1)]


class Fact(Record):
    """A measured number from a publication: its ``value`` in ``unit``, and its standard deviation ``sd`` over ``n`` specimens, if
    known. ``how``: the method by which it was taken from the publication. ``read_in``: the kind of text in which it was read.
    """

    experiment: str
    quantity: _Text
    condition: _Text
    value: float
    unit: Literal["1", "mm", "um", "deg", "kPa", "N", "%"]
    sd: float | None = Field(gt=0)
    n: int | None = Field(gt=0)
    how: Literal["table", "digitised", "fit", "text", "memory"]
    read_in: Literal["publication", "abstract", "quotation", "memory"]
    doi: Annotated[str, StringConstraints(pattern=r"^10\.\d{4,9}/\S+$")]
    doi_confirmed: Literal["yes", "no"]

    @property
    def validates(self) -> bool:
        """True if the number was read in the publication or its abstract (neither fitted nor recalled), and has a standard
        deviation over several specimens.
        """
        read = self.read_in in ("publication", "abstract") and self.how not in ("fit", "memory")
        return read and self.sd is not None and (self.n or 0) > 1


class Experiment(Record):
    """An experiment of a ``kind``: a measurement, a model, or bands from several publications.

    ``specimen`` and ``boundary``: the specimen and the boundary conditions. ``repeated`` and ``not_repeated``: the parts of the
    experiment that a scene repeats, and those that it does not repeat. ``file``: a file with a full curve, in the folder that the
    environment variable ``FEM_REFERENCE_DATA`` names.
    """

    title: _Text
    kind: Kind
    source: _Text
    specimen: _Text
    boundary: _Text
    repeated: _Text
    not_repeated: _Text
    file: str | None = None


def facts(folder: Path = FOLDER) -> Iterator[Fact]:
    """All measured numbers in a ``folder``. Raises InputError, with the line, if a row is incomplete or invalid."""
    with (folder / NAME).open(encoding="utf-8", newline="") as file:
        for line, row in enumerate(csv.DictReader(file, strict=True), 2):
            yield _fact(row, f"{NAME}:{line}")


def _fact(row: dict[str, str], place: str) -> Fact:
    if None in row or None in row.values():
        raise InputError(place, "a row with too few or too many cells", "one cell for each column")
    read: dict[str, object] = dict(row)
    for key, kind in _NUMBERS.items():
        try:
            read[key] = kind(row[key]) if row[key] or key == "value" else None
        except ValueError:
            raise InputError(f"{place}: {key}", f'"{row[key]}"', "a number") from None
    return parse(Fact, read, place)


def experiments(folder: Path = FOLDER) -> dict[str, Experiment]:
    """The records of all experiments in a ``folder``, by name."""
    paths = sorted(folder.glob("*.toml"))
    return {path.stem: parse(Experiment, tomllib.loads(path.read_text(encoding="utf-8")), path.name) for path in paths}


@cache
def _own() -> tuple[Fact, ...]:
    return tuple(facts())


def find(experiment: str, quantity: str, condition: str) -> Fact:
    """The only fact of an ``experiment`` and ``quantity`` whose condition contains ``condition``; LookupError if not exactly one
    fits.
    """
    found = [
        one for one in _own() if (one.experiment, one.quantity) == (experiment, quantity) and condition in one.condition
    ]
    if len(found) != 1:
        raise LookupError(f"{len(found)} facts instead of one for {quantity} of {experiment}, condition {condition!r}")
    return found[0]


def model_band(quantity: str = "mean_surface_distance") -> tuple[Fact, ...]:
    """The minimum and the maximum published difference between models and real muscles in a ``quantity``; empty without sources."""
    return tuple(one for one in _own() if (one.experiment, one.quantity) == ("scale", quantity))


def ratio(upper: Fact, lower: Fact) -> tuple[float, float]:
    """The ratio of two independent facts, and its standard deviation, which is NaN if either fact has none."""
    value = upper.value / lower.value
    parts = [math.nan if one.sd is None else one.sd / one.value for one in (upper, lower)]
    return value, abs(value) * math.hypot(*parts)


def least_specimens(several: Iterable[Fact]) -> int | None:
    """The smallest number of specimens among ``several`` facts; None if any number is unknown or there are no facts."""
    counts = [one.n for one in several]
    return None if None in counts or not counts else min(one for one in counts if one is not None)
