"""Loads on a body: their amounts over time, their force and moment, and the integrals over the body that loads need."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record


class RampPoint(Record):
    """The amount of an effect at a frame number: a factor of its parameters, up to a thousand."""

    frame: float
    amount: float = Field(ge=0, le=1000)

    def __str__(self) -> str:
        return f"{self.amount:g} at frame {self.frame:g}"


class Wrench(NamedTuple):
    """A ``force`` (3,) [N] and its ``moment`` (3,) [N mm] about the origin."""

    force: Floats
    moment: Floats


class Shape(Protocol):
    """The present shape of a body, and its velocity."""

    def measure(self, on: str | None = None) -> tuple[float, Floats]:
        """Volume [mm3] at rest, or area [mm2] of a region ``on``; integral (3,) of present positions over it; NaN if unknown."""

    def facing(self, on: str) -> tuple[Floats, Floats] | None:
        """The present vector area (3,) [mm2] of a region, outward, and its moment (3,) [mm3] about the origin; None if unknown."""

    def motion(self) -> tuple[Floats, Floats] | None:
        """The integral of the velocity (3,) [mm4/s] over the rest volume and its moment (3,) [mm5/s]; None if unknown."""


def dead(density: ArrayLike, shape: Shape, on: str | None = None) -> Wrench:
    """The wrench of a force of ``density`` (3,) per unit rest volume or area, which moves with the body and keeps its direction."""
    (measure, first), each = shape.measure(on), np.asarray(density, float)
    return Wrench(each * measure, np.cross(first, each))


def total(wrenches: list[Wrench]) -> Wrench:
    """The sum of wrenches."""
    force, moment = np.sum([np.zeros((2, 3)), *map(np.stack, wrenches)], axis=0)
    return Wrench(force, moment)
