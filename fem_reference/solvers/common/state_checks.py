"""Checks of the state of a body. They are made in order, and the first check that finds trouble ends the run."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal, enclosed_volume
from fem_reference.runs.contents import Status

# A body has diverged if its size is more than this multiple of its size at rest and of the present size of its attached part.
_WIDE = 10.0
# A body has also diverged if it encloses more than this multiple of its volume at rest. The volume of flesh changes by a few
# percent, and a surface that preserves only its dihedral angles reached twice its rest volume; a wrong root or scaling gives an
# arbitrary volume. If bones stretch a body to n times its size, the limit is n times as large.
_LARGE = 5.0


@dataclass(frozen=True)
class Trouble:
    """The ``status`` with which a state ends the run, and a ``sentence`` about the defect."""

    status: Status
    sentence: str


class StateCheck(Protocol):
    """A check of a state, given as positions (n, 3) [mm] or as unknowns (n,)."""

    def trouble(self, state: Floats, /) -> Trouble | None:
        """The trouble with a ``state`` or with the step that led to it; None if there is none."""


def first_trouble(checks: Iterable[StateCheck], state: Floats) -> Trouble | None:
    """The first trouble that one of the ``checks`` finds, after which no further check is made; None if there is none."""
    return next((found for check in checks if (found := check.trouble(state)) is not None), None)


class SurfaceCheck:
    """A check that a closed surface is plausible for a muscle with the shape ``rest`` and ``attached`` vertices (k,)."""

    def __init__(self, rest: Surface, attached: Ints) -> None:
        self.rest, self.attached = rest, attached
        self.width, self.volume = diagonal(rest.points), enclosed_volume(rest.points, rest.triangles)

    def trouble(self, state: Floats, /) -> Trouble | None:
        """The trouble with positions ``state`` (n, 3) [mm]; None if there is none.

        The surface has *diverged* if a position is not a number, if the surface is much larger than at rest and than the extent of
        its attached vertices, or if its volume is much larger than at rest. It is *inverted* if it is turned inside out.
        """
        lost = np.flatnonzero(~np.isfinite(state).all(axis=1))
        if len(lost):
            return Trouble("diverged", f"the position of {len(lost)} points is not a number (first: point {lost[0]})")
        wide, apart = diagonal(state), diagonal(state[self.attached]) if len(self.attached) else 0.0
        if wide > _WIDE * max(self.width, apart):
            return Trouble(
                "diverged", f"the muscle extends over {wide:.3g} mm, compared with {self.width:.3g} mm at rest"
            )
        ratio = enclosed_volume(state, self.rest.triangles) / self.volume
        if ratio <= 0:
            return Trouble("inverted", "the surface is turned inside out")
        if ratio > _LARGE * max(1, apart / self.width):
            return Trouble("diverged", f"the surface encloses {ratio:.3g} times its volume at rest")
        return None
