"""Regions of a body at rest: the share of each region at a point, from 0 to 1, independent of the mesh of the body."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, tet_volumes
from fem_reference.geometry.distance import distances
from fem_reference.geometry.fibres import FibreField
from fem_reference.geometry.signed_distance import signed_distances

# Functions of points (n, 3) [mm] at rest that give shares (n,), from 0 to 1, or depths (n,) [mm] below a border. Picklable.
Region = Callable[[Floats], Floats]
Depth = Callable[[Floats], Floats]
# The slope of the share at the depth ``width``, divided by its slope at the border.
_RISE = 1000.0
# Points on the border of a cell are moved by this fraction of the way to its middle, so that they are in the regions of the cell.
INWARDS = 1e-6
# The approximate number of grid points in the bounding box of a body of any size.
_SAMPLES = 20_000


@dataclass(frozen=True, eq=False)
class Blended:
    """The region where the depth is above 0: its share is ``(1000^t - 1) / 999``, where t grows from 0 at the border to 1 at depth
    ``width`` [mm].

    In a region a thousand times as stiff as the body, the stiffness grows by the same factor in equal parts of the width, so
    elements that resolve the width converge. With ``3 t^2 - 2 t^3`` most of the growth would be in a fiftieth of the width. The
    stiffer material should therefore be the region. In tension across the border, 0.14 of the width acts as soft material.
    """

    depth: Depth
    width: float

    def __call__(self, points: Floats) -> Floats:
        """The shares (n,)."""
        depth = self.depth(points)
        if self.width == 0:
            return np.where(depth >= 0, 1.0, 0.0)
        t = np.clip(depth / self.width, 0, 1)
        return np.asarray((_RISE**t - 1) / (_RISE - 1))


@dataclass(frozen=True, eq=False)
class Union:
    """The union of several ``regions`` of shares a, b, ...: ``1 - (1 - a) (1 - b) ...``."""

    regions: tuple[Region, ...]

    def __call__(self, points: Floats) -> Floats:
        """The shares (n,)."""
        return np.asarray(1 - np.prod([1 - region(points) for region in self.regions], axis=0))


@dataclass(frozen=True, eq=False)
class Inside:
    """The depth inside a closed ``surface``."""

    surface: Surface

    def __call__(self, points: Floats) -> Floats:
        """The depths (n,) [mm]."""
        return -signed_distances(points, self.surface)


@dataclass(frozen=True, eq=False)
class Around:
    """The part of a body within a ``reach`` [mm] of a ``surface``, closed or not."""

    surface: Surface
    reach: float

    def __call__(self, points: Floats) -> Floats:
        """The depths (n,) [mm]."""
        return self.reach - distances(points, self.surface).distance


@dataclass(frozen=True, eq=False)
class Between:
    """The part of a body where a Laplace ``field`` between two attachments is between ``first`` and ``last``; the field is 0
    and 1 on the attachments. The depth is the difference of the field from these values divided by its mean slope.
    """

    field: FibreField
    first: float
    last: float

    def __call__(self, points: Floats) -> Floats:
        """The depths (n,) [mm]."""
        mesh = self.field.mesh
        values = self.field.locator.embed(points).interpolate(mesh, self.field.values)
        slopes = np.linalg.norm(self.field.gradients[mesh.tets].mean(axis=1), axis=1)
        above = np.where(self.first > 0, values - self.first, np.inf)
        inside = np.minimum(above, np.where(self.last < 1, self.last - values, np.inf))
        return np.asarray(inside / np.average(slopes, weights=tet_volumes(mesh.points, mesh.tets)))


def samples(surface: Surface) -> Floats:
    """Points (n, 3) [mm] inside a closed ``surface``, of equal volume each: nodes of a grid of about 20,000 in its bounding box."""
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    step = np.cbrt(np.prod(high - low) / _SAMPLES)
    axes = [np.linspace(a, b, 2 * max(1, round((b - a) / step)) + 1)[1::2] for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[signed_distances(grid, surface) < 0]
