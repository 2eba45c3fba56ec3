"""Coulomb friction on a surface: a spring keeps a point in place until its force exceeds the limit; then the point slides."""

from collections.abc import Iterable
from math import isfinite
from typing import NamedTuple

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats


def check(coefficients: Iterable[float | None], *, begun: bool) -> None:
    """Raise InputError if a coefficient of friction is neither None nor above 0, or if a body with friction starts deformed or
    under tension (``begun``), because the positions to which its points stick are then unknown.
    """
    for one in (one for one in coefficients if one is not None):
        if not (isfinite(one) and one > 0):
            raise InputError("friction", one, "a number above 0, or None without friction")
        if begun:
            raise InputError("friction", one, "no friction in a body that starts deformed or under tension")


class Returned(NamedTuple):
    """The secant stiffness of friction at n points. ``stiffness`` (n,) [MPa/mm]: the traction divided by the elastic slip.
    ``by_slip`` (n,), ``by_limit`` (n,): the derivatives of ``stiffness`` with respect to the length of the elastic slip and to the
    limit of the traction.
    """

    stiffness: Floats
    by_slip: Floats
    by_limit: Floats


def returned(slip: Floats, limit: Floats, stiffness: float) -> Returned:
    """The secant stiffness of friction with the traction ``min(k s, L)``, by return mapping (Giannakopoulos 1989,
    doi 10.1016/0045-7949(89)90175-4).

    ``slip``: the elastic slip s (n,) [mm]; ``limit``: the limit L (n,) [MPa] of the traction; ``stiffness``: k [MPa/mm].

    >>> returned(np.array([0.1, 0.3]), np.array([0.4, 0.4]), 2.0).stiffness * [0.1, 0.3]
    array([0.2, 0.4])
    """
    slides = stiffness * slip > limit
    length = np.where(slides, slip, 1.0)
    by_slip, by_limit = np.where(slides, -limit / length**2, 0.0), np.where(slides, 1 / length, 0.0)
    return Returned(np.where(slides, limit / length, stiffness), by_slip, by_limit)


def since_entry(gap: Floats, before: Floats, felt: float) -> tuple[Floats, Floats]:
    """The fraction (n,) of each of n straight paths along which there is contact, and its derivative (n,) with respect to ``gap``.

    The gap decreases from ``before`` (n,) [mm], which is at least ``felt`` [mm], to ``gap`` (n,) [mm], which is below ``felt``.
    """
    whole = before - gap
    return (felt - gap) / whole, (felt - before) / whole**2
