"""Fibres traced through a muscle: the lines of steepest ascent of a Laplace field from one attachment to the other."""

from dataclasses import dataclass

import igl
import numpy as np
import skfem
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skfem.models.poisson import laplace

from fem_reference.errors import InputError
from fem_reference.geometry.distance import distances
from fem_reference.geometry.embedding import Locator
from fem_reference.mesh import Floats, Ints, Polylines, TetMesh, tet_volumes

_POINTS = 40  # of each line
_NEAR = 1e-3  # the field this close to 0 or 1 counts as having arrived
# Seeds that differ by less, relatively, are told apart by their number, so that a turned mesh gives the same lines.
_TIES = 1e-6
_HALFWAY = 0.5 - _TIES  # where the field is 1/2 but for round-off it is above

Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Field:
    """A field's ``values`` (n,) and ``gradients`` (n, 3) at the points of a mesh, and the mean edge ``size`` [mm]."""

    locator: Locator
    values: Floats
    gradients: Floats
    size: float

    def directions(self, points: Floats) -> Floats:
        """Unit vectors (m, 3) of steepest ascent at ``points`` (m, 3)."""
        found = self.locator.embed(points).interpolate(self.locator.mesh, self.gradients)
        return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1), np.finfo(float).tiny)[:, None])

    def on_the_way(self, points: Floats) -> Bools:
        """Which of ``points`` (m, 3) are in the mesh and not yet at an attachment, (m,)."""
        embedding = self.locator.embed(points)
        values = embedding.interpolate(self.locator.mesh, self.values)
        return np.asarray((embedding.outside == 0) & (values > _NEAR) & (values < 1 - _NEAR))


def trace(mesh: TetMesh, start: str, end: str, count: int) -> Polylines:
    """``count`` lines of 40 points each from the attachment ``start`` to ``end`` (keys of ``mesh.facets``).

    They are spread over the section halfway; InputError when the muscle has room for fewer.
    """
    field = _field(mesh, mesh.facets[start], mesh.facets[end])
    seeds = _seeds(field)
    if len(seeds) == 0:
        got = f'nothing between "{start}" and "{end}"'
        raise InputError("fibres.traced", got, "two attachments with muscle between them")
    seeds = _spread(seeds, 4 * count)
    back, came_back = _follow(field, seeds, mesh.facets[start], -1.0)
    ahead, came_ahead = _follow(field, seeds, mesh.facets[end], 1.0)
    whole = np.flatnonzero(came_back & came_ahead)[:count]
    if len(whole) < count:
        want = f'at most {len(whole)}, the fibres that could be traced from "{start}" to "{end}"'
        raise InputError("fibres.traced.count", count, want)
    lines = [_resample(np.concatenate([back[i][::-1], ahead[i][1:]])) for i in whole]
    return Polylines(np.concatenate(lines), np.arange(count + 1) * _POINTS)


def directions(mesh: TetMesh, start: str, end: str) -> Floats:
    """Unit vectors (k, 3) along the fibres that :func:`trace` follows, one for each tet: the field's direction at its middle."""
    field = _field(mesh, mesh.facets[start], mesh.facets[end])
    found = field.directions(mesh.points[mesh.tets].mean(axis=1))
    flat = np.linalg.norm(found, axis=1) < 0.5  # no slope: all around is one attachment
    found[flat] = found[~flat].mean(axis=0) / np.linalg.norm(found[~flat].mean(axis=0))
    return found


def nearest_directions(mesh: TetMesh, lines: Polylines) -> Floats:
    """Unit vectors (k, 3), one for each tet: along the segment of ``lines`` whose middle is nearest to the tet's."""
    starts = np.setdiff1d(np.arange(len(lines.points) - 1), lines.offsets[1:] - 1)
    ways = lines.points[starts + 1] - lines.points[starts]
    lengths = np.linalg.norm(ways, axis=1)
    middles = (lines.points[starts] + ways / 2)[lengths > 0]
    _, nearest = cKDTree(middles).query(mesh.points[mesh.tets].mean(axis=1))
    return np.asarray((ways[lengths > 0] / lengths[lengths > 0][:, None])[nearest])


def _field(mesh: TetMesh, start: Ints, end: Ints) -> _Field:
    """The Laplace field that is 0 on the triangles ``start``, 1 on ``end``, without flux elsewhere; linear elements.

    On a coarse mesh attachments may touch: there it is 1/2.
    """
    zeros, ones = np.unique(start), np.unique(end)
    values = np.zeros(len(mesh.points))
    values[ones] = 1.0
    values[np.intersect1d(zeros, ones)] = 0.5
    basis = skfem.Basis(skfem.MeshTet(mesh.points.T.copy(), mesh.tets.T.copy()), skfem.ElementTetP1())
    values = skfem.solve(*skfem.condense(laplace.assemble(basis), x=values, D=np.union1d(zeros, ones)))
    edges = mesh.points[mesh.tets[:, [0, 0, 0, 1, 1, 2]]] - mesh.points[mesh.tets[:, [1, 2, 3, 2, 3, 3]]]
    size = float(np.linalg.norm(edges, axis=2).mean())
    return _Field(Locator(mesh), values, _gradients(mesh, values), size)


def _gradients(mesh: TetMesh, values: Floats) -> Floats:
    """Gradient (n, 3) at each point: that of the tets around it, averaged by volume."""
    corners = mesh.points[mesh.tets]
    rises = values[mesh.tets[:, 1:]] - values[mesh.tets[:, :1]]
    slopes = np.linalg.solve(corners[:, 1:] - corners[:, :1], rises[:, :, None])[:, :, 0]
    volumes = np.repeat(tet_volumes(mesh.points, mesh.tets), 4)
    share = np.bincount(mesh.tets.ravel(), weights=volumes, minlength=len(mesh.points))
    sums = [
        np.bincount(mesh.tets.ravel(), weights=volumes * np.repeat(slope, 4), minlength=len(mesh.points))
        for slope in slopes.T
    ]
    return np.asarray(np.stack(sums, axis=1) / share[:, None])


def _seeds(field: _Field) -> Floats:
    """Points (k, 3) on the section where the field is 1/2, away from the skin.

    Where the section cuts a tet, the middle of the cut and the points halfway from there to its corners.
    """
    mesh = field.locator.mesh
    ends = mesh.tets[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
    low, high = (field.values[ends[:, :, side]] - _HALFWAY for side in range(2))
    cut = (low < 0) != (high < 0)
    some = cut.any(axis=1)
    ends, cut, share = ends[some], cut[some], np.where(cut, low / np.where(cut, low - high, 1.0), 0.0)[some]
    crossings = mesh.points[ends[:, :, 0]] * (1 - share)[:, :, None] + mesh.points[ends[:, :, 1]] * share[:, :, None]
    middles = (crossings * cut[:, :, None]).sum(axis=1) / cut.sum(axis=1)[:, None]
    halfway = ((crossings + middles[:, None]) / 2)[cut]
    seeds = np.concatenate([middles, halfway])
    depths = distances(seeds, field.locator.skin).distance
    enough = (1 - _TIES) * min(field.size / 4, depths.max(initial=0) / 2)
    return np.asarray(seeds[depths > enough])


def _spread(points: Floats, count: int) -> Floats:
    """At most ``count`` of ``points`` (k, 3), the most central first, then each the farthest from those before it."""
    chosen = [_first_best(-np.linalg.norm(points - points.mean(axis=0), axis=1))]
    distances = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        distances = np.minimum(distances, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(_first_best(distances))
    return points[chosen]


def _first_best(scores: Floats) -> int:
    """The first index whose score is the greatest but for round-off."""
    return int(np.argmax(scores >= scores.max() - _TIES * np.abs(scores).max()))


def _follow(field: _Field, seeds: Floats, goal: Ints, sign: float) -> tuple[list[Floats], Bools]:
    """Lines from ``seeds`` (k, 3) along the field (``sign`` 1) or against it (-1) to the attachment ``goal`` (m, 3).

    And which of them came there rather than out of the skin, (k,).
    """
    step = sign * field.size / 4
    lines = [[seed] for seed in seeds]
    going, points = np.arange(len(seeds)), seeds
    for _ in range(
        4 * int(field.locator.diagonal / abs(step))
    ):  # a line four times as long as the mesh goes in circles
        points = _runge_kutta(field, points, step)
        goes_on = field.on_the_way(points)
        going, points = going[goes_on], points[goes_on]
        for i, point in zip(going, points, strict=True):
            lines[i].append(point)
        if len(going) == 0:
            break
    lasts = np.array([line[-1] for line in lines])
    square, _, closest = igl.point_mesh_squared_distance(lasts, field.locator.mesh.points, goal)
    whole = [np.array([*line, point]) for line, point in zip(lines, closest, strict=True)]
    return whole, np.sqrt(square) <= field.size / 2


def _runge_kutta(field: _Field, points: Floats, step: float) -> Floats:
    """``points`` (k, 3) one step [mm] further, by the classical fourth order rule."""
    first = field.directions(points)
    second = field.directions(points + step / 2 * first)
    third = field.directions(points + step / 2 * second)
    fourth = field.directions(points + step * third)
    return np.asarray(points + step / 6 * (first + 2 * second + 2 * third + fourth))


def _resample(line: Floats) -> Floats:
    """The line (k, 3) by 40 points at equal distances along it."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, along[-1], _POINTS)
    return np.stack([np.interp(at, along, line[:, axis]) for axis in range(3)], axis=1)
