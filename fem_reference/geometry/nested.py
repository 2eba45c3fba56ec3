"""Refinement of each tetrahedron into eight: nested, graded towards rims, with boundary points moved onto a given surface."""

import numpy as np

from fem_reference.foundations.mesh import (
    Bools,
    Floats,
    Ints,
    Surface,
    TetMesh,
    boundary,
    enclosed_volume,
    tet_qualities,
    tet_volumes,
    upright,
)
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.coarsening import inflate
from fem_reference.geometry.distance import distances

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
# The eight parts of a tet with corners 0 to 3 and points 4 to 9 on its edges, in the order of EDGES. There is one division for each
# of the three diagonals (between points on opposite edges) along which the octahedron in the centre may be cut.
_CORNERS = [[0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]]
_DIAGONALS = np.array([[4, 9], [5, 8], [6, 7]])
PARTS = np.array(
    [
        [*_CORNERS, [4, 9, 5, 6], [4, 9, 7, 5], [4, 9, 8, 7], [4, 9, 6, 8]],
        [*_CORNERS, [5, 8, 4, 7], [5, 8, 6, 4], [5, 8, 9, 6], [5, 8, 7, 9]],
        [*_CORNERS, [6, 7, 4, 5], [6, 7, 8, 4], [6, 7, 9, 8], [6, 7, 5, 9]],
    ]
)
# The four parts of a face with corners 0 to 2 (a, b, c) and points 3 to 5 on its edges (ab, ac, bc).
_FACE_PARTS = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2], [3, 5, 4]])
# The position of the cut on an edge that begins at a rim, where displacement varies with the square root of the distance from the
# rim. With this value, each refinement divides the error due to the rim by four: the order is 2 instead of 1 (Bacuta, Nistor and
# Zikatanov 2005, doi 10.1007/s00211-005-0588-3). Where the solution is smooth, quadratic elements converge faster.
GRADED = 0.25
# A point moves towards the surface only as far as the tets around it keep at least these fractions of their volume and quality.
_KEPT_VOLUME, _KEPT_QUALITY = 0.3, 0.5
_ROUNDS, _SHORTER = 12, 0.6


def refined(mesh: TetMesh, surface: Surface | None, rims: tuple[str, ...] = ()) -> TetMesh:
    """Cut each tetrahedron of ``mesh`` into eight, and each facet of a region into four.

    Edges that begin at the rim of a region named in ``rims`` (see ``mesh.facets``) are cut at a quarter of their length, other
    edges at their midpoints. Then all boundary points move onto ``surface``, and from there along their normals to keep the
    enclosed volume, as far as the tetrahedra stay valid. If ``surface`` is None, the points stay where they are.
    """
    ends, of_tets, middles = _cut(mesh, _on_rims(mesh, rims))
    points = np.concatenate([mesh.points, middles])
    tets = _eighths(points, np.hstack([mesh.tets, len(mesh.points) + of_tets]))
    keys = ends[:, 0] * len(mesh.points) + ends[:, 1]
    facets = {name: _quartered(faces, keys, len(mesh.points)) for name, faces in mesh.facets.items()}
    if surface is not None:
        points = _snapped(points, tets, surface)
    return TetMesh(points, tets, facets, mesh.maker)


def _cut(mesh: TetMesh, on_rim: Bools) -> tuple[Ints, Ints, Floats]:
    """Return the ends (e, 2) of the edges, the edges (k, 6) of each tet, and a new point (e, 3) on each edge. ``on_rim`` (n,): mask
    of the points on rims.
    """
    ends, _, which, _ = distinct(np.sort(mesh.tets[:, EDGES].reshape(-1, 2), axis=1))
    first, second = on_rim[ends[:, 0]], on_rim[ends[:, 1]]
    at = np.where(first & ~second, GRADED, np.where(second & ~first, 1 - GRADED, 0.5))[:, None]
    points = mesh.points[ends[:, 0]] * (1 - at) + mesh.points[ends[:, 1]] * at
    return ends, which.reshape(-1, 6), points


def _on_rims(mesh: TetMesh, rims: tuple[str, ...]) -> Bools:
    """Mask (n,) of the points on the rim of a region in ``rims``: on an edge that belongs to only one facet of the region."""
    found = np.zeros(len(mesh.points), bool)
    for name in rims:
        faces = mesh.facets[name]
        sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges, _, _, count = distinct(sides)
        found[edges[count == 1]] = True
    return found


def _eighths(points: Floats, nodes: Ints) -> Ints:
    """Parts (8 k, 4) of tets with ten ``nodes`` (k, 10). The octahedron in the centre is cut along its shortest diagonal."""
    ends = points[nodes[:, _DIAGONALS]]
    shortest = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2).argmin(axis=1)
    tets = np.take_along_axis(nodes, PARTS[shortest].reshape(len(nodes), -1), axis=1).reshape(-1, 4)
    return upright(points, tets)


def _quartered(faces: Ints, keys: Ints, count: int) -> Ints:
    """Four parts (4 m, 3) of each of ``faces`` (m, 3), with the same orientation. ``keys``: the sorted keys of the edges; the
    new points on them are numbered from ``count`` on.
    """
    if len(faces) == 0:
        return faces
    pairs = np.sort(faces[:, [[0, 1], [0, 2], [1, 2]]], axis=2)
    middles = count + np.searchsorted(keys, pairs[:, :, 0] * count + pairs[:, :, 1])
    return np.hstack([faces, middles])[:, _FACE_PARTS].reshape(-1, 3)


def _snapped(points: Floats, tets: Ints, surface: Surface) -> Floats:
    """Move boundary points onto ``surface`` at constant volume, as far as the tets around them stay valid; returns all points."""
    faces, _ = boundary(tets)
    outer = np.unique(faces)
    goal = np.array(points)
    goal[outer] = distances(points[outer], surface).closest
    away = (inflate(goal, faces, enclosed_volume(surface.points, surface.triangles)) - points)[outer]
    volumes, qualities = tet_volumes(points, tets), tet_qualities(points, tets)
    share = np.ones(len(outer))
    for _ in range(_ROUNDS):
        moved = np.array(points)
        moved[outer] += share[:, None] * away
        bad = tet_volumes(moved, tets) < _KEPT_VOLUME * volumes
        bad |= tet_qualities(moved, tets) < _KEPT_QUALITY * qualities
        if not bad.any():
            return moved
        share[np.isin(outer, tets[bad])] *= _SHORTER
    return points
