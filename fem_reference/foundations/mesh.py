"""Triangle surfaces, tetrahedral meshes and polylines: records, sizes, and checks that a surface is usable.

Shapes of arrays: points ``(n, 3)`` [mm]; triangles ``(m, 3)`` and tets ``(k, 4)`` of point indices.
"""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.rows import distinct

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# The maximum magnitude [mm] of a coordinate of a surface: a thousand kilometres.
FARTHEST = 1e9
# Corners of the four faces of a tet, ordered so that the normals point outwards if the tet has a positive volume.
TET_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


def read_only(values: Any, dtype: type) -> NDArray[Any]:
    """Return a read-only copy of ``values``, or ``values`` itself if it is already a read-only array that owns its data."""
    kept = isinstance(values, np.ndarray) and values.flags.owndata and not values.flags.writeable
    array: NDArray[Any] = np.array(values, dtype=dtype, order="C", copy=None if kept else True)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class Surface:
    """A triangle surface: ``points`` (n, 3) [mm], ``triangles`` (m, 3); ``place`` names its source in messages."""

    points: Floats
    triangles: Ints
    place: str = "surface"

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points, np.float64))
        object.__setattr__(self, "triangles", read_only(self.triangles, np.int64))

    def moved_to(self, points: Floats) -> "Surface":
        """Return the surface with the same triangles and with its points at ``points`` (n, 3)."""
        return Surface(points, self.triangles, self.place)


@dataclass(frozen=True, eq=False)
class TetMesh:
    """A tetrahedral mesh: ``points`` (n, 3) [mm] and ``tets`` (k, 4), all of positive volume. ``facets``: the triangles (m, 3) of
    each named region of the boundary; ``maker``: the name of the mesher, empty if there is none.
    """

    points: Floats
    tets: Ints
    facets: dict[str, Ints] = field(default_factory=dict)
    maker: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points, np.float64))
        object.__setattr__(self, "tets", read_only(self.tets, np.int64))
        object.__setattr__(self, "facets", {name: read_only(facets, np.int64) for name, facets in self.facets.items()})


def fingerprint(*arrays: NDArray[Any]) -> str:
    """Hash of the bytes, shapes and types of arrays, as 64 hex digits."""
    digest = hashlib.sha256()
    for array in arrays:
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def diagonal(points: Floats) -> float:
    """Diagonal [mm] of the bounding box of ``points`` (n, 3), used as the size of a body."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def place_of(point: Iterable[float]) -> str:
    """Format a point (3,) [mm] for a message."""
    x, y, z = point
    return f"({x:.1f}, {y:.1f}, {z:.1f}) mm"


def edge_vectors(corners: Floats) -> Floats:
    """Edge vectors (m, 3, c - 1), as columns, from the first of the ``corners`` (m, c, 3) of each cell to its other corners."""
    return np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)


def normals(corners: Floats) -> Floats:
    """Normals (m, 3) of triangles with ``corners`` (m, 3, 3); the length of a normal is twice the area of the triangle."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def unit_normals(corners: Floats) -> Floats:
    """Unit normals (m, 3) of triangles with ``corners`` (m, 3, 3); zero for a triangle without area."""
    found = normals(corners)
    lengths = np.linalg.norm(found, axis=1, keepdims=True)
    return np.asarray(np.divide(found, lengths, out=np.zeros_like(found), where=lengths > 0))


def corner_areas(corners: Floats) -> Floats:
    """Areas (m,) [mm2] of triangles with ``corners`` (m, 3, 3) [mm]."""
    return np.asarray(np.linalg.norm(normals(corners), axis=1) / 2)


def triangle_areas(points: Floats, triangles: Ints) -> Floats:
    """Areas (m,) [mm2] of ``triangles`` (m, 3) with vertices ``points`` (n, 3) [mm]."""
    return corner_areas(points[triangles])


def vertex_areas(points: Floats, triangles: Ints) -> Floats:
    """Areas (n,) [mm2] of the ``points`` (n, 3) [mm]: a third of the total area of the ``triangles`` (m, 3) around each point."""
    thirds = np.repeat(triangle_areas(points, triangles) / 3, 3)
    return np.bincount(triangles.ravel(), weights=thirds, minlength=len(points))


def tet_volumes(points: Floats, tets: Ints) -> Floats:
    """Signed volumes (k,) [mm3] of ``tets`` (k, 4) with vertices ``points`` (n, 3) [mm]."""
    a, b, c, d = (points[tets[:, corner]] for corner in range(4))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6)


def upright(points: Floats, tets: Ints) -> Ints:
    """Return the ``tets`` (k, 4) on ``points`` (n, 3) with two vertices swapped in each tet that has a negative volume."""
    return np.where((tet_volumes(points, tets) < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)


def tet_qualities(points: Floats, tets: Ints) -> Floats:
    """Mean-ratio quality (k,) of ``tets`` (k, 4) with vertices ``points`` (n, 3): 1 if regular, 0 if flat (Liu and Joe 1994)."""
    squares = sum(np.sum((points[tets[:, i]] - points[tets[:, j]]) ** 2, axis=1) for i in range(4) for j in range(i))
    return np.asarray(12 * np.cbrt(3 * np.abs(tet_volumes(points, tets))) ** 2 / squares)


def boundary(tets: Ints) -> tuple[Ints, Ints]:
    """Return the outward triangles (m, 3) that belong to only one of the ``tets`` (k, 4), and the index (m,) of that tet."""
    faces = tets[:, TET_FACES].reshape(-1, 3)
    found = distinct(np.sort(faces, axis=1))
    alone = np.sort(found.first[found.counts == 1])
    return faces[alone], alone // 4


def sorted_corners(facets: Ints) -> list[tuple[int, ...]]:
    """Return the corners of each of the ``facets`` (m, k) in ascending order, so that equal facets have equal tuples."""
    return list(map(tuple, np.sort(facets, axis=1).tolist()))


def found_in(facets: Ints, others: Ints) -> Bools:
    """Mask (m,) of the ``facets`` (m, k) that have the same corners as one of ``others`` (n, k), in any order."""
    known = set(sorted_corners(others))
    return np.array([one in known for one in sorted_corners(facets)], bool)


def united(parts: Sequence[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    """Join ``parts``, each with points and cells that index these points, into the points (n, d) and cells (m, k) of one mesh."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    cells = [own + start for (_, own), start in zip(parts, starts, strict=False)]
    return np.concatenate([points for points, _ in parts]), np.concatenate(cells)


def check_finite(surface: Surface) -> None:
    """Raise InputError if a surface has no triangles, a point that is too far away or not finite, or an invalid triangle."""
    if len(surface.triangles) == 0:
        raise InputError(surface.place, "no triangles", "a triangle surface")
    bad = np.flatnonzero(~np.isfinite(surface.points).all(axis=1))
    if len(bad):
        raise InputError(surface.place, f"a point that is not finite (vertex {bad[0]})", "finite coordinates")
    if (farthest := np.abs(surface.points).max()) > FARTHEST:
        vertex = np.abs(surface.points).max(axis=1).argmax()
        got = f"a coordinate of {farthest:.3g} mm (vertex {vertex})"
        raise InputError(surface.place, got, f"at most {FARTHEST:g} mm")
    check_corners(surface)


def check_corners(surface: Surface) -> None:
    """Raise InputError if a triangle refers to a vertex that does not exist."""
    if surface.triangles.min(initial=0) < 0 or surface.triangles.max(initial=-1) >= len(surface.points):
        want = f"vertices from 0 to {len(surface.points) - 1}"
        raise InputError(surface.place, "a triangle with a vertex that does not exist", want)


def check_closed(surface: Surface) -> Surface:
    """Return the surface, oriented outwards, if it bounds one body.

    The surface must be finite, closed, manifold and consistently oriented, and use every point. Otherwise raises InputError with
    the number of wrong edges, vertices or parts and the position of the first or the smallest of them.
    """
    check_finite(surface)
    points, triangles = surface.points, surface.triangles
    directed = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, _, _, sides = distinct(np.sort(directed, axis=1))
    for wrong, what, want in (
        (edges[sides == 1], "edges that belong to only one triangle", "a closed surface"),
        (edges[sides > 2], "edges that belong to more than two triangles", "a manifold surface"),
    ):
        if len(wrong):
            first = place_of(points[wrong[0]].mean(axis=0))
            raise InputError(surface.place, f"{len(wrong)} {what}, the first at {first}", want)
    if twice := len(directed) - len(distinct(directed).rows):
        got = f"{twice} edges along which both triangles have the same direction"
        raise InputError(surface.place, got, "one orientation")
    if lost := len(points) - len(np.unique(triangles)):
        raise InputError(surface.place, f"{lost} points that no triangle uses", "every point on the surface")
    _check_parts(surface)
    volume = enclosed_volume(points, triangles)
    if volume == 0:
        raise InputError(surface.place, "an enclosed volume of zero", "a body")
    return surface if volume > 0 else Surface(points, triangles[:, ::-1], surface.place)


def twins(triangles: Ints) -> Ints:
    """Return the two sides (e, 2) of each edge of a closed oriented surface. Side 3 t + i begins at corner i of triangle t."""
    ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.lexsort(ends.T).reshape(-1, 2)


def corner_fans(one: Ints, other: Ints, count: int) -> Ints:
    """Index (count,) of the fan of each of ``count`` triangle corners. A fan consists of corners at one vertex whose triangles are
    connected through edges. ``one`` (e,), ``other`` (e,): the two sides of each of these edges, numbered as in :func:`twins`.
    """
    after_one, after_other = (side - side % 3 + (side + 1) % 3 for side in (one, other))
    return connected_parts(np.concatenate([one, after_one]), np.concatenate([after_other, other]), count)


def connected_parts(first: Ints, second: Ints, count: int) -> Ints:
    """Index (count,) of the connected part of each of ``count`` nodes; edges connect nodes ``first`` (e,) and ``second`` (e,)."""
    links = coo_array((np.ones(len(first), bool), (first, second)), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)


def _check_parts(surface: Surface) -> None:
    """Raise InputError if a closed oriented surface has several connected parts, or a vertex with several fans of triangles."""
    one, other = twins(surface.triangles).T
    corners = surface.triangles.ravel()
    _, corner = np.unique(corner_fans(one, other, len(corners)), return_index=True)
    wrong = np.flatnonzero(np.bincount(corners[corner]) > 1)
    if len(wrong):
        first = f"vertex {wrong[0]} at {place_of(surface.points[wrong[0]])}"
        got = f"{len(wrong)} vertices where parts touch, the first {first}"
        raise InputError(surface.place, got, "a manifold surface")
    part = connected_parts(one // 3, other // 3, len(surface.triangles))
    areas = np.bincount(part, weights=triangle_areas(surface.points, surface.triangles))
    if len(areas) > 1:
        middle = surface.points[surface.triangles[part == areas.argmin()]].mean(axis=(0, 1))
        got = f"{len(areas)} separate parts, the smallest ({areas.min():.3g} mm2) around {place_of(middle)}"
        raise InputError(surface.place, got, "one connected surface")


def enclosed_volume(points: Floats, triangles: Ints) -> float:
    """Volume [mm3] inside a closed surface, by the divergence theorem about the mean of its points (eq. 5.18 of report
    DCSE/TR-2022-03 with the factor 1/6, which the report omits in places).

    >>> tet = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    >>> round(enclosed_volume(tet, TET_FACES), 12) == round(1 / 6, 12)
    True
    """
    a, b, c = (points[triangles[:, corner]] - points.mean(axis=0) for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@dataclass(frozen=True, eq=False)
class Polylines:
    """Polylines, stored one after another: ``points`` (n, 3) [mm]. Line i is ``points[offsets[i]:offsets[i + 1]]``."""

    points: Floats
    offsets: Ints

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points, np.float64))
        object.__setattr__(self, "offsets", read_only(self.offsets, np.int64))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def lengths(self, points: Floats | None = None) -> Floats:
        """Length (len(self),) [mm] of each line, at rest or with the points of the lines moved to ``points`` (n, 3)."""
        steps = np.linalg.norm(np.diff(self.points if points is None else points, axis=0), axis=1)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        return np.asarray(along[self.offsets[1:] - 1] - along[self.offsets[:-1]])
