"""Friction on bones: a point sticks to an anchor on the bone, and drags the anchor along when it slides."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.rigid_bodies import Sampled
from fem_reference.problems.contact import ContactLaw
from fem_reference.problems.friction import returned, since_entry

# Returns the positions (m, 3) [mm] of points (m,) in the bone's frame, and their gaps (m,) [mm], in the last settled state.
Before = Callable[[Ints], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class Grip:
    """Friction of n points ``which`` (n,), in the frame of the bone: the ``traction`` (n, 3) [MPa], its derivative ``slope``
    (n, 3, 3) [MPa/mm] and the anchors ``stuck`` (n, 3) [mm]. ``lost`` (n,) [N/mm]: the work dissipated per unit rest area since the
    settled state.
    """

    which: Ints
    traction: Floats
    slope: Floats
    stuck: Floats
    lost: Floats


class Friction:
    """The friction on one bone, by a ``law`` with a coefficient of friction. ``stuck`` (n, 3) [mm]: the anchors of the points in
    the frame of the bone; NaN for points that are not pressed.
    """

    def __init__(self, law: ContactLaw, stuck: Floats) -> None:
        self.law, self.stuck = law, stuck

    def grip(self, which: Ints, here: Floats, gaps: Sampled, before: Before) -> Grip:
        """The friction of the pressed points ``which`` (n,) at positions ``here`` (n, 3) [mm] in the frame of the bone. ``gaps``:
        the gaps there, with derivatives; ``before``: a function, see ``Before``.

        The elastic slip e is the vector from the anchor to the point, without its component along the unit normal n. The traction
        is ``-min(k |e|, friction p) e/|e|``, with stiffness k and pressure p. A point that has come into contact since the settled
        state slips from the position at which its straight path comes within the smoothing.
        """
        slip, change = self._slip(which, here, gaps, before)
        length = np.linalg.norm(gaps.gradient, axis=1)
        normal = gaps.gradient / length[:, None]
        turn = (np.eye(3) - _outer(normal, normal)) @ gaps.curvature / length[:, None, None]
        along = np.vecdot(slip, normal)
        elastic = slip - along[:, None] * normal
        change = change - _outer(normal, _rows(normal, change) + _rows(slip, turn)) - along[:, None, None] * turn
        size = np.linalg.norm(elastic, axis=1)
        direction = elastic / np.maximum(size, np.finfo(float).tiny)[:, None]
        pressure, by_gap = self.law.pressure(gaps.distance)
        friction = self.law.friction or 0.0
        steeper = by_gap[:, None] * length[:, None] * gaps.gradient + pressure[:, None] * _rows(normal, gaps.curvature)
        found = returned(size, friction * pressure * length, self.law.stiffness)
        by_place = found.by_slip[:, None] * _rows(direction, change) + found.by_limit[:, None] * friction * steeper
        slope = -found.stiffness[:, None, None] * change - _outer(elastic, by_place)
        kept = found.stiffness / self.law.stiffness
        lost = found.stiffness * size**2 * (1 - kept)
        return Grip(which, -found.stiffness[:, None] * elastic, slope, here - kept[:, None] * elastic, lost)

    def _slip(self, which: Ints, here: Floats, gaps: Sampled, before: Before) -> tuple[Floats, Floats]:
        """The displacement (n, 3) [mm] of points from their anchors, and its derivative (n, 3, 3) with respect to the positions."""
        slip, change = here - self.stuck[which], np.tile(np.eye(3), (len(which), 1, 1))
        new = np.flatnonzero(np.isnan(slip).any(axis=1))
        if len(new):
            places, last = before(which[new])
            share, by_gap = since_entry(gaps.distance[new], last, self.law.smoothing)
            path = here[new] - places
            slip[new] = share[:, None] * path
            change[new] = share[:, None, None] * np.eye(3) + _outer(path, by_gap[:, None] * gaps.gradient[new])
        return slip, change

    def settle(self, grip: Grip) -> None:
        """Hold only the points of ``grip``, at its anchors ``stuck``, until the next call."""
        self.stuck[:] = np.nan
        self.stuck[grip.which] = grip.stuck


def _outer(one: Floats, other: Floats) -> Floats:
    """The outer products (n, 3, 3) of vectors (n, 3)."""
    return one[:, :, None] * other[:, None, :]


def _rows(vectors: Floats, matrices: Floats) -> Floats:
    """The vectors (n, 3) times the matrices (n, 3, 3)."""
    return np.asarray(np.einsum("ni,nij->nj", vectors, matrices))
