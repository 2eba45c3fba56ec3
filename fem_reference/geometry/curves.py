"""Curves through a few points: the estimation techniques of report DCSE/TR-2022-03, 3.1 to 3.5, for fibres and outlines.

A curve is a callable that maps parameters (m,), 0 at its first point and 1 at its last, to points (m, d). Two formulas of the
report have misprints. The second row of the Bezier matrix (3.1) must be -3, 3, 0, 0. The matrix (3.2) belongs to the uniform
spline, not to the centripetal spline: the exponent of the knots and the tension of (3.3) are different parameters.
"""

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats

Curve = Callable[[Floats], Floats]


def knots(points: Floats, exponent: float = 1.0) -> Floats:
    """Parameters (n,) of ``points`` (n, d), from 0 to 1, with steps proportional to distance**``exponent``. The exponent is 0 for
    uniform, 0.5 for centripetal and 1 for chordal knots. Raises InputError if there are fewer than two points or if consecutive
    points coincide.
    """
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if len(points) < 2 or not (steps > 0).all():
        got = f"{len(points)} points, {int((steps == 0).sum())} repeated"
        raise InputError("curve", got, "two points or more, none repeated")
    ends = np.concatenate([[0.0], np.cumsum(steps**exponent)])
    return np.asarray(ends / ends[-1])


def constant(points: Floats) -> Curve:
    """Step function with the value of the nearest of ``points`` (n, d) in chord length (report 3.1)."""
    found: Curve = scipy.interpolate.interp1d(knots(points), points, kind="nearest", axis=0)
    return found


def linear(points: Floats) -> Curve:
    """Straight segments between consecutive ``points`` (n, d) (report 3.1)."""
    found: Curve = scipy.interpolate.interp1d(knots(points), points, axis=0)
    return found


def bezier(points: Floats) -> Curve:
    """Bezier curve of degree n - 1 with the control points ``points`` (n, d); it passes through the first and the last (3.1)."""
    knots(points)
    found: Curve = scipy.interpolate.BPoly(points[:, None], [0.0, 1.0])
    return found


def catmull_rom(points: Floats, exponent: float = 0.5) -> Curve:
    """Catmull-Rom spline through ``points`` (n, d). ``exponent``: 0 for uniform (3.2), 0.5 for centripetal, 1 for chordal knots.

    Its tangent at a point is that of the parabola through the point and its two neighbours (Barry and Goldman 1988,
    doi 10.1145/378456.378511). At an end, the end point replaces the missing neighbour (report 3.3), which halves the slope.
    """
    times = knots(points, exponent)
    slopes = np.diff(points, axis=0) / np.diff(times)[:, None]
    wide = (times[2:] - times[:-2])[:, None]
    inner = slopes[:-1] + slopes[1:] - (points[2:] - points[:-2]) / wide
    found: Curve = scipy.interpolate.CubicHermiteSpline(
        times, points, np.concatenate([slopes[:1] / 2, inner, slopes[-1:] / 2])
    )
    return found


def fourier(points: Floats) -> Curve:
    """Discrete Fourier series of ``points`` (n, d), which are assumed to be equidistant (3.4, 3.5).

    The chord, the straight line between the two ends, is subtracted first, and the remainder is extended to an odd periodic
    function, so that the curve passes through the ends.
    """
    count = len(knots(points)) - 1
    orders, at = np.arange(1, count), np.linspace(0, 1, count + 1)
    chord = linear(points[[0, -1]])
    weights = 2 / count * np.sin(np.pi * np.outer(orders, at)) @ (points - chord(at))
    return lambda t: chord(t) + np.sin(np.pi * np.outer(t, orders)) @ weights


def radial(points: Floats, shape: float = 3.0) -> Curve:
    """Interpolate ``points`` (n, d) over chord length by Gaussian radial basis functions plus a linear polynomial (3.6, 3.10).

    ``shape``: the length of the curve divided by the width of a Gaussian.
    """
    times = knots(points)
    found = scipy.interpolate.RBFInterpolator(times[:, None], points, kernel="gaussian", epsilon=shape, degree=1)
    return lambda t: np.asarray(found(np.asarray(t, dtype=float)[:, None]))


# The techniques, by the names used in pages and scenes, with the smoothness class of their curves: -1 for C^-1, 0 for C^0, ...
TECHNIQUES: dict[str, tuple[Callable[[Floats], Curve], float]] = {
    "constant": (constant, -1),
    "piecewise linear": (linear, 0),
    "Bezier": (bezier, np.inf),
    "Catmull-Rom, uniform": (partial(catmull_rom, exponent=0.0), 1),
    "Catmull-Rom, centripetal": (catmull_rom, 1),
    "Fourier": (fourier, np.inf),
    "Gaussian RBF": (radial, np.inf),
}
