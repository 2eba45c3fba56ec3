"""Regions of a body at rest: the share of each region at a point, from 0 to 1, independent of the mesh of the body."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, tet_volumes
from fem_reference.geometry.distance import distances
from fem_reference.geometry.fibres import FibreField
from fem_reference.geometry.signed_distance import signed_distances

# Functions that take rest points (n, 3) [mm] and return shares (n,), from 0 to 1, or depths (n,) [mm] inside a border. They can be
# pickled.
Region = Callable[[Floats], Floats]
Depth = Callable[[Floats], Floats]
# The slope of the share at the depth ``width``, divided by its slope at the border.
_RISE = 1000.0
# Points on the border of a cell are moved by this fraction of the way to its centre, to be in the same regions as the cell.
INWARDS = 1e-6
# The approximate number of grid points in the bounding box of a body.
_SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class Blended:
    """The region in which ``depth`` is positive. Its share is ``(1000^t - 1) / 999``, where t grows from 0 at the border to 1 at a
    depth of ``width`` [mm]; with a width of 0 the share jumps to 1.

    In a region that is a thousand times as stiff as the body, the stiffness then grows by the same factor in equal parts of the
    width, so elements that resolve the width converge; with ``3 t^2 - 2 t^3`` most of the growth would be in a fiftieth of the
    width. The region should therefore be the stiffer material. In tension across the border, 0.14 of the width acts as soft
    material.
    """

    depth: Depth
    width: float

    def __call__(self, points: Floats) -> Floats:
        """Shares (n,) at ``points`` (n, 3)."""
        depth = self.depth(points)
        if self.width == 0:
            return np.where(depth >= 0, 1.0, 0.0)
        t = np.clip(depth / self.width, 0, 1)
        return np.asarray((_RISE**t - 1) / (_RISE - 1))


@dataclass(frozen=True, eq=False)
class Union:
    """Union of several ``regions`` with shares a, b, ...: ``1 - (1 - a) (1 - b) ...``."""

    regions: tuple[Region, ...]

    def __call__(self, points: Floats) -> Floats:
        """Shares (n,) at ``points`` (n, 3)."""
        return np.asarray(1 - np.prod([1 - region(points) for region in self.regions], axis=0))


@dataclass(frozen=True, eq=False)
class Inside:
    """Depth inside a closed ``surface``."""

    surface: Surface

    def __call__(self, points: Floats) -> Floats:
        """Depths (n,) [mm] of ``points`` (n, 3)."""
        return -signed_distances(points, self.surface)


@dataclass(frozen=True, eq=False)
class Around:
    """Depth inside the part of a body that is within ``reach`` [mm] of a ``surface``, closed or not."""

    surface: Surface
    reach: float

    def __call__(self, points: Floats) -> Floats:
        """Depths (n,) [mm] of ``points`` (n, 3)."""
        return self.reach - distances(points, self.surface).distance


@dataclass(frozen=True, eq=False)
class Between:
    """Depth inside the part of a body in which a Laplace ``field``, 0 and 1 on two attachments, is between ``first`` and ``last``.
    The depth is the difference between the field and the nearer of these values, divided by the mean slope of the field. A
    ``first`` of 0 or a ``last`` of 1 is not a border.
    """

    field: FibreField
    first: float
    last: float

    def __call__(self, points: Floats) -> Floats:
        """Depths (n,) [mm] of ``points`` (n, 3)."""
        mesh = self.field.mesh
        values = self.field.locator.embed(points).interpolate(mesh, self.field.values)
        slopes = np.linalg.norm(self.field.gradients[mesh.tets].mean(axis=1), axis=1)
        above = np.where(self.first > 0, values - self.first, np.inf)
        inside = np.minimum(above, np.where(self.last < 1, self.last - values, np.inf))
        return np.asarray(inside / np.average(slopes, weights=tet_volumes(mesh.points, mesh.tets)))


def samples(surface: Surface) -> Floats:
    """Points (n, 3) [mm] inside a closed ``surface``, each representing an equal volume, from a grid of about 20,000 nodes."""
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    step = np.cbrt(np.prod(high - low) / _SAMPLES)
    axes = [np.linspace(a, b, 2 * max(1, round((b - a) / step)) + 1)[1::2] for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[signed_distances(grid, surface) < 0]
