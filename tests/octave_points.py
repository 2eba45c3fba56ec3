"""Points of the report's Octave examples, transcribed: listing 4.3, the first lines of listing 4.5 and eq. 4.11."""

import numpy as np
from scipy import spatial

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints

# Listing 4.5, line 8: points along a side of the square plate.
SIDE = 20


def uniform(n: int) -> tuple[Floats, Floats]:
    """Listing 4.3: a grid of ``n`` points (n, 2), a square number, on the unit square, and its rim fixed at 0, (2, m)."""
    side = round(np.sqrt(n))
    if n < 4 or side * side != n:
        raise InputError("n", n, "a square number, at least 4")
    x, y = np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side))
    across, along = np.arange(1, side - 1), np.arange(0, n - side, side)
    rim = np.concatenate([across, along, along + side - 1, np.arange(n - side, n)])
    return np.column_stack([x.T.ravel(), y.T.ravel()]), fixed_at_zero(rim)


def square() -> tuple[Floats, Floats]:
    """Listing 4.5, lines 7 to 11: the grid of listing 4.3 on the square from (-1, -1) to (1, 1) and its rim fixed at 0."""
    coords, bounds = uniform(SIDE**2)
    return coords * 2 - 1, bounds


def spiral(n: int) -> Floats:
    """Eq. 4.11: points (n, 2) at the radius ``i / n`` and the angle ``i (1 + sqrt 5) / 2`` [rad], i = 1 to ``n``.

    This is no golden angle (2.400 rad): four steps are 3 % more than a turn, which makes four arms. The report does not say
    which points are its boundary.
    """
    i = np.arange(1, n + 1)
    theta = i * (1 + np.sqrt(5)) / 2
    return np.asarray((i / n)[:, None] * np.column_stack([np.cos(theta), np.sin(theta)]))


def delaunay(points: Floats) -> Ints:
    """A Delaunay triangulation (m, 3) of ``points`` (n, 2) by scipy.

    In a grid every diagonal is a tie, and Octave breaks ties otherwise: in its square plate 158 of 361 diagonals differ, which
    changes what listing 4.5 draws by 14 % of its maximum.
    """
    return np.asarray(spatial.Delaunay(points).simplices, dtype=np.int64)


def rim(triangles: Ints) -> Ints:
    """The vertices (m,) on edges that belong to one triangle only: those of the convex hull in a Delaunay triangulation."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, sides = np.unique(edges, axis=0, return_counts=True)
    return np.unique(unique[sides == 1])


def fixed_at_zero(vertices: Ints) -> Floats:
    """Bounds (2, m) that fix ``vertices`` (m,) at 0."""
    return np.array([vertices, np.zeros(len(vertices))], dtype=np.float64)
