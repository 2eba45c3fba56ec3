"""Loads on a body: amounts over time, resultant forces and moments, and the integrals over the body that the resultants need."""

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record


class RampPoint(Record):
    """The amount of an effect at a frame number: a factor from 0 to 1000 that multiplies the parameters of the effect."""

    frame: float
    amount: float = Field(ge=0, le=1000)

    def __str__(self) -> str:
        return f"{self.amount:g} at frame {self.frame:g}"


class Wrench(NamedTuple):
    """A ``force`` (3,) [N] and its ``moment`` (3,) [N mm] about the origin."""

    force: Floats
    moment: Floats


class Shape(Protocol):
    """The current shape of a body, and its velocity."""

    def measure(self, on: str | None = None) -> tuple[float, Floats]:
        """Return the rest volume [mm3], or the rest area [mm2] of a region ``on``, and the integral (3,) of the current positions
        over that volume or area, which is NaN if the positions are unknown.
        """

    def facing(self, on: str) -> tuple[Floats, Floats] | None:
        """Current vector area (3,) [mm2] of a region, outward, and its moment (3,) [mm3] about the origin; None if unknown."""

    def motion(self) -> tuple[Floats, Floats] | None:
        """Return integrals over the rest volume of the velocity (3,) [mm4/s] and of its moment (3,) [mm5/s]; None if unknown."""


def dead(density: ArrayLike, shape: Shape, on: str | None = None) -> Wrench:
    """Wrench of a dead load, which moves with the body and keeps its direction. ``density`` (3,): the force per unit rest volume,
    or per unit rest area of the region ``on``.
    """
    (measure, first), each = shape.measure(on), np.asarray(density, float)
    return Wrench(each * measure, np.cross(first, each))


def total(wrenches: list[Wrench]) -> Wrench:
    """The sum of wrenches."""
    force, moment = np.sum([np.zeros((2, 3)), *map(np.stack, wrenches)], axis=0)
    return Wrench(force, moment)
