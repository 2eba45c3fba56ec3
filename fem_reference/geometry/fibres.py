"""Fibre directions and traced fibres, which are lines of steepest ascent of a Laplace field from one attachment to the other."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from scipy.spatial import cKDTree
from skfem.models.poisson import laplace

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Bools, Floats, Ints, Polylines, Surface, TetMesh, tet_volumes
from fem_reference.geometry.distance import distances
from fem_reference.geometry.embedding import Locator
from fem_reference.geometry.nested import EDGES

POINTS = 40  # the number of points on each line
_NEAR = 1e-3  # a line has arrived at an attachment if the field differs from 0 or 1 by at most this
# Seeds whose scores differ by less than this fraction are taken in the order of their indices, so that rotating a mesh does not
# change the lines.
_TIES = 1e-6
_HALFWAY = 0.5 - _TIES  # a field value that differs from 1/2 only by rounding counts as above it

# A function that maps cells (n,) and rest points (n, 3) in them to unit vectors (n, 3); it can be pickled.
Directions = Callable[[Ints, Floats], Floats]


@dataclass(frozen=True, eq=False)
class FibreField:
    """A Laplace field between two attachments. ``values`` (n,), ``gradients`` (n, 3): the field and its gradient at the points of
    its own ``mesh``; ``start``, ``end`` (m, 3): the triangles of the attachments, on which the field is 0 and 1.
    """

    mesh: TetMesh
    values: Floats
    gradients: Floats
    start: Ints
    end: Ints

    def __getstate__(self) -> dict[str, object]:
        """Return the state without cached properties, for transfer to other processes."""
        return {name: value for name, value in vars(self).items() if name not in ("locator", "size")}

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """Unit vectors (n, 3) along the fibres at the rest positions ``points`` (n, 3); ``cells`` is ignored."""
        found = self.directions(points)
        flat = np.linalg.norm(found, axis=1) < 0.5  # zero gradient: all nearby mesh points belong to one attachment
        if flat.any():
            mean = self.gradients.mean(axis=0)
            found[flat] = mean / np.linalg.norm(mean)
        return found

    @cached_property
    def locator(self) -> Locator:
        """Search trees that locate points in the mesh."""
        return Locator(self.mesh)

    @cached_property
    def size(self) -> float:
        """Mean length [mm] of the edges of the mesh."""
        first, second = np.moveaxis(self.mesh.points[self.mesh.tets[:, EDGES]], 2, 0)
        return float(np.linalg.norm(first - second, axis=2).mean())

    def directions(self, points: Floats) -> Floats:
        """Unit vectors (m, 3) of steepest ascent at ``points`` (m, 3)."""
        return self.sampled(points)[0]

    def sampled(self, points: Floats) -> tuple[Floats, Bools]:
        """Unit vectors (m, 3) of steepest ascent at ``points`` (m, 3), and a mask (m,) of the points that are in the mesh but
        not on an attachment.
        """
        embedding = self.locator.embed(points)
        ascent, values = (embedding.interpolate(self.mesh, one) for one in (self.gradients, self.values))
        unit = ascent / np.maximum(np.linalg.norm(ascent, axis=1), np.finfo(float).tiny)[:, None]
        return np.asarray(unit), np.asarray((embedding.outside == 0) & (values > _NEAR) & (values < 1 - _NEAR))


def fibre_field(mesh: TetMesh, start: str, end: str) -> FibreField:
    """Solve the Laplace equation with linear elements in a muscle whose free boundary is insulated. The field is 0 on the facets
    ``start`` of ``mesh``, 1 on the facets ``end``, and 1/2 where these touch, as they may on a coarse mesh.
    """
    zeros, ones = np.unique(mesh.facets[start]), np.unique(mesh.facets[end])
    values = np.zeros(len(mesh.points))
    values[ones] = 1.0
    values[np.intersect1d(zeros, ones)] = 0.5
    basis = skfem.Basis(skfem.MeshTet(mesh.points.T.copy(), mesh.tets.T.copy()), skfem.ElementTetP1())
    values = skfem.solve(*skfem.condense(laplace.assemble(basis), x=values, D=np.union1d(zeros, ones)))
    return FibreField(mesh, values, averaged(mesh, _slopes(mesh, values)), mesh.facets[start], mesh.facets[end])


def trace(field: FibreField, count: int) -> Polylines:
    """Trace ``count`` lines of 40 points each along ``field`` from one attachment to the other.

    The lines are spread over the section on which the field is 1/2. Raises InputError if fewer lines can be traced.
    """
    seeds = _seeds(field)
    if len(seeds) == 0:
        got = "nothing between the two attachments"
        raise InputError("fibres.traced", got, "two attachments with muscle between them")
    seeds = spread(seeds, 4 * count)
    back, came_back = _follow(field, seeds, field.start, -1.0)
    ahead, came_ahead = _follow(field, seeds, field.end, 1.0)
    whole = np.flatnonzero(came_back & came_ahead)[:count]
    if len(whole) < count:
        raise InputError("fibres.traced.count", count, f"at most {len(whole)}, the number that could be traced")
    lines = [resample(np.concatenate([back[i][::-1], ahead[i][1:]])) for i in whole]
    return Polylines(np.concatenate(lines), np.arange(count + 1) * POINTS)


@dataclass(frozen=True, eq=False)
class NearestLine:
    """Fibre directions: at each point, the direction of the segment of ``lines`` whose midpoint is nearest."""

    lines: Polylines

    def __getstate__(self) -> dict[str, object]:
        return {"lines": self.lines}

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """Unit vectors (n, 3) at the rest positions ``points`` (n, 3); ``cells`` is ignored."""
        middles, directions = self.segments
        _, nearest = cKDTree(middles).query(points)
        return np.asarray(directions[nearest])

    @cached_property
    def segments(self) -> tuple[Floats, Floats]:
        """Return the midpoint (k, 3) and the direction (k, 3) of each segment."""
        lines = self.lines
        starts = np.setdiff1d(np.arange(len(lines.points) - 1), lines.offsets[1:] - 1)
        along = lines.points[starts + 1] - lines.points[starts]
        lengths = np.linalg.norm(along, axis=1)
        middles = (lines.points[starts] + along / 2)[lengths > 0]
        return middles, (along / np.maximum(lengths, np.finfo(float).tiny)[:, None])[lengths > 0]


@dataclass(frozen=True, eq=False)
class Turned:
    """Fibre ``directions`` that are all rotated by one ``matrix`` (3, 3)."""

    directions: Directions
    matrix: Floats

    def __call__(self, cells: Ints, points: Floats) -> Floats:
        """Unit vectors (n, 3) at the rest positions ``points`` (n, 3) in ``cells`` (n,)."""
        return np.asarray(self.directions(cells, points) @ self.matrix.T)


def _slopes(mesh: TetMesh, values: Floats) -> Floats:
    """Gradient (k, 3) in each tet of the field with ``values`` (n,) at the points."""
    corners = mesh.points[mesh.tets]
    rises = values[mesh.tets[:, 1:]] - values[mesh.tets[:, :1]]
    return np.asarray(np.linalg.solve(corners[:, 1:] - corners[:, :1], rises[:, :, None])[:, :, 0])


def averaged(mesh: TetMesh, slopes: Floats) -> Floats:
    """Average the vectors ``slopes`` (k, 3) of the tets around each point of a ``mesh``, weighted by volume; returns (n, 3)."""
    volumes = np.repeat(tet_volumes(mesh.points, mesh.tets), 4)
    share = np.bincount(mesh.tets.ravel(), weights=volumes, minlength=len(mesh.points))
    weighted = (volumes * np.repeat(slope, 4) for slope in slopes.T)
    sums = [np.bincount(mesh.tets.ravel(), weights=one, minlength=len(mesh.points)) for one in weighted]
    return np.asarray(np.stack(sums, axis=1) / share[:, None])


def _seeds(field: FibreField) -> Floats:
    """Points (k, 3) on the section where the field is 1/2, except those near the skin: in each tet that it cuts, the centre of the
    cut, and the points halfway from there to the corners of the cut.
    """
    mesh = field.mesh
    ends = mesh.tets[:, EDGES]
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


def spread(points: Floats, count: int) -> Floats:
    """Choose at most ``count`` of ``points`` (k, d): first the nearest to their mean, then always the farthest from all chosen."""
    chosen = [_first_best(-np.linalg.norm(points - points.mean(axis=0), axis=1))]
    distances = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        distances = np.minimum(distances, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(_first_best(distances))
    return points[chosen]


def _first_best(scores: Floats) -> int:
    """Index of the first score that is equal to the maximum up to rounding."""
    return int(np.argmax(scores >= scores.max() - _TIES * np.abs(scores).max()))


def _follow(field: FibreField, seeds: Floats, goal: Ints, sign: float) -> tuple[list[Floats], Bools]:
    """Follow the field from ``seeds`` (k, 3), in its direction (``sign`` 1) or against it (-1), to the triangles ``goal`` (m, 3).
    Returns the lines and a mask (k,) of those that have arrived.
    """
    step = sign * field.size / 4
    lines = [[seed] for seed in seeds]
    going, points, ascent = np.arange(len(seeds)), seeds, field.directions(seeds)
    # A line four times as long as the diagonal of the mesh must run in circles.
    for _ in range(4 * int(field.locator.diagonal / abs(step))):
        points = _runge_kutta(field, points, ascent, step)
        ascent, goes_on = field.sampled(points)
        going, points, ascent = going[goes_on], points[goes_on], ascent[goes_on]
        for i, point in zip(going, points, strict=True):
            lines[i].append(point)
        if len(going) == 0:
            break
    lasts = np.array([line[-1] for line in lines])
    ends = distances(lasts, Surface(field.mesh.points, goal))
    whole = [np.array([*line, point]) for line, point in zip(lines, ends.closest, strict=True)]
    return whole, ends.distance <= field.size / 2


def _runge_kutta(field: FibreField, points: Floats, first: Floats, step: float) -> Floats:
    """Advance ``points`` (k, 3) by one ``step`` [mm] with the classical fourth-order Runge-Kutta method. ``first`` (k, 3): the
    directions at the points.
    """
    second = field.directions(points + step / 2 * first)
    third = field.directions(points + step / 2 * second)
    fourth = field.directions(points + step * third)
    return np.asarray(points + step / 6 * (first + 2 * second + 2 * third + fourth))


def resample(line: Floats) -> Floats:
    """Resample the line (k, 3) at 40 points, equally spaced along it."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, along[-1], POINTS)
    return np.stack([np.interp(at, along, line[:, axis]) for axis in range(3)], axis=1)
