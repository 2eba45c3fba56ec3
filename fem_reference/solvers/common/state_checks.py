"""Checks that a body can be in a state, made in order; the first that finds trouble ends the run."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal, enclosed_volume
from fem_reference.runs.contents import Status

# A body this many times as wide as at rest, or as its attached part, is lost.
_WIDE = 10.0
# A body of this many times its volume is lost too. Flesh keeps its volume within a few percent, and a surface that keeps only its
# dihedral angles was seen at twice its volume; a wrong root or scaling has no such bound. A body that the bones draw out to n
# times its length may have n times that.
_LARGE = 5.0


@dataclass(frozen=True)
class Trouble:
    """The status with which a state ends a run, and its defect."""

    status: Status
    sentence: str


class StateCheck(Protocol):
    """A check of states (n, 3) [mm], or of their unknowns (n,)."""

    def trouble(self, state: Floats, /) -> Trouble | None:
        """The trouble with a ``state``, or with the step that led to it; None without."""


def first_trouble(checks: Iterable[StateCheck], state: Floats) -> Trouble | None:
    """The first trouble that the ``checks`` find; later ones are not made."""
    return next((found for check in checks if (found := check.trouble(state)) is not None), None)


class Finite:
    """Checks that all positions are numbers."""

    def trouble(self, state: Floats, /) -> Trouble | None:
        """Diverged where a position is not a number."""
        lost = np.flatnonzero(~np.isfinite(state).all(axis=1))
        if len(lost) == 0:
            return None
        return Trouble("diverged", f"the position of {len(lost)} points is not a number (point {lost[0]} for one)")


class Width:
    """Checks that no surface spreads much wider than at ``rest``, or than its ``attached`` vertices (k,)."""

    def __init__(self, rest: Surface, attached: Ints) -> None:
        self.attached, self.at_rest = attached, diagonal(rest.points)

    def trouble(self, state: Floats, /) -> Trouble | None:
        """Diverged where the box around the surface is too large."""
        wide, between = diagonal(state), diagonal(state[self.attached]) if len(self.attached) else 0.0
        if wide <= _WIDE * max(self.at_rest, between):
            return None
        return Trouble("diverged", f"the muscle is spread over {wide:.3g} mm, at rest {self.at_rest:.3g} mm")


class Volume:
    """Checks that no surface is turned inside out, or encloses much more than at ``rest``."""

    def __init__(self, rest: Surface, attached: Ints) -> None:
        self.rest, self.attached = rest, attached
        self.at_rest = enclosed_volume(rest.points, rest.triangles)

    def trouble(self, state: Floats, /) -> Trouble | None:
        """Inverted where it is turned inside out, diverged where it is too large."""
        ratio = enclosed_volume(state, self.rest.triangles) / self.at_rest
        if ratio <= 0:
            return Trouble("inverted", "the surface is turned inside out")
        between = diagonal(state[self.attached]) if len(self.attached) else 0.0
        if ratio <= _LARGE * max(1, between / diagonal(self.rest.points)):
            return None
        return Trouble("diverged", f"the surface encloses {ratio:.3g} times its volume at rest")


def surface_checks(rest: Surface, attached: Ints) -> tuple[StateCheck, ...]:
    """The checks of a closed surface with ``attached`` vertices (k,), in order: without positions there is no volume."""
    return Finite(), Width(rest, attached), Volume(rest, attached)
