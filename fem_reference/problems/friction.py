"""Coulomb friction of points on a surface: a spring keeps a point in place until its force exceeds the limit; then it slides."""

from collections.abc import Iterable
from math import isfinite
from typing import NamedTuple

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats


def check(coefficients: Iterable[float | None], *, begun: bool) -> None:
    """Raise InputError if a coefficient of friction is neither None nor above 0, or if a body with friction has ``begun`` deformed
    or under tension. The positions to which its points stick are then unknown.
    """
    for one in (one for one in coefficients if one is not None):
        if not (isfinite(one) and one > 0):
            raise InputError("friction", one, "a number above 0, or None without friction")
        if begun:
            raise InputError("friction", one, "no friction in a body that starts deformed or under tension")


class Returned(NamedTuple):
    """The traction of n points divided by their elastic slip, ``stiffness`` (n,) [MPa/mm], and its derivatives with respect to the
    length of the elastic slip, ``by_slip`` (n,), and to the limit of the traction, ``by_limit`` (n,).
    """

    stiffness: Floats
    by_slip: Floats
    by_limit: Floats


def returned(slip: Floats, limit: Floats, stiffness: float) -> Returned:
    """The traction of a spring of ``stiffness`` k [MPa/mm] at an elastic ``slip`` s (n,) [mm], up to a ``limit`` L (n,) [MPa]:
    ``min(k s, L)``, by return mapping (Giannakopoulos 1989, doi 10.1016/0045-7949(89)90175-4).

    >>> returned(np.array([0.1, 0.3]), np.array([0.4, 0.4]), 2.0).stiffness * [0.1, 0.3]
    array([0.2, 0.4])
    """
    slides = stiffness * slip > limit
    length = np.where(slides, slip, 1.0)
    by_slip, by_limit = np.where(slides, -limit / length**2, 0.0), np.where(slides, 1 / length, 0.0)
    return Returned(np.where(slides, limit / length, stiffness), by_slip, by_limit)


def since_entry(gap: Floats, before: Floats, felt: float) -> tuple[Floats, Floats]:
    """The fraction (n,) of a straight path that lies within contact, and its derivative (n,) with respect to ``gap``. The gap
    decreases from ``before`` (n,) [mm], at least ``felt`` [mm], to ``gap`` (n,) [mm], below ``felt``.
    """
    whole = before - gap
    return (felt - gap) / whole, (felt - before) / whole**2
