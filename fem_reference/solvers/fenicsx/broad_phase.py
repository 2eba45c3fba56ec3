"""A search for the material points that may be near a bone.

The points in a cell form a patch. A patch cannot come within reach of the bone until its nodes have moved by the clearance that the
last search found for the patch.
"""

from collections.abc import Callable

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.rigid_bodies import Obstacle, Sampled
from fem_reference.solvers.fenicsx.contact_points import ContactPoints


class Patches:
    """The points grouped by cell, with one patch for each of the p cells.

    A point moves at most ``spread`` (p,) times as far as the k nodes of its cell, where ``spread`` is the maximum over the patch of
    the sum of the magnitudes of the basis functions. If the basis functions do not reproduce the rest positions of the points,
    rotations add at most ``off`` (p,) [mm].
    """

    def __init__(self, points: ContactPoints) -> None:
        carried = points.carried
        _, first, patch = np.unique(points.cells, return_index=True, return_inverse=True)
        self.count = len(first)
        self.nodes: Ints = carried.which[first]
        self.order: Ints = np.argsort(patch, kind="stable")
        self.starts: Ints = np.searchsorted(patch[self.order], np.arange(self.count + 1))
        rest = np.einsum("nk,nki->ni", points.basis, carried.rest[carried.which])
        self.spread, self.off = np.zeros(self.count), np.zeros(self.count)
        np.maximum.at(self.spread, patch, np.abs(points.basis).sum(axis=1))
        np.maximum.at(self.off, patch, 2 * np.linalg.norm(points.rest - rest, axis=1))

    def points(self, some: Ints) -> tuple[Ints, Ints]:
        """The points (n,) of the patches ``some``, patch by patch, and the index at which each patch starts among them."""
        counts = self.starts[some + 1] - self.starts[some]
        begins = np.cumsum(counts) - counts
        return self.order[np.repeat(self.starts[some] - begins, counts) + np.arange(counts.sum())], begins


class Nearby:
    """Finds all points within ``reach`` [mm] of a bone of a given ``shape``, and possibly some that are farther away.

    For each patch it stores, from the last search that examined the points of the patch, their clearance ``free`` (p,) [mm] and the
    positions ``seen`` (p, k, 3) [mm] of the nodes in the bone's frame. ``met`` (p,) is True if such a search has taken place since
    the last converged state.
    """

    def __init__(self, shape: Obstacle, reach: float, patches: Patches) -> None:
        self.shape, self.reach, self.patches = shape, reach, patches
        self.clearance = shape.clearance(reach)
        self.free, self.seen = np.full(patches.count, -np.inf), np.zeros((*patches.nodes.shape, 3))
        self.met = np.ones(patches.count, bool)

    def find(self, nodes: Floats, local: Callable[[Ints], Floats]) -> tuple[Ints, Sampled]:
        """The points (n,) that may be within reach, and the distance from the bone, sampled at these points.

        ``nodes`` (m, 3) [mm]: the positions of the nodes in the bone's frame; ``local``: a function that returns the positions of
        given points in that frame.
        """
        now = nodes[self.patches.nodes]
        moved = np.sqrt(((now - self.seen) ** 2).sum(axis=2).max(axis=1, initial=0.0))
        some = np.flatnonzero(~(self.free - self.patches.spread * moved - self.patches.off > 0))
        points, begins = self.patches.points(some)
        places = local(points)
        free = self.clearance(places)
        near = np.flatnonzero(~(free > 0))
        sampled = self.shape.sample(places[near])
        free[near] = (sampled.distance - self.reach) / self.shape.steepest
        if len(some):
            self.free[some], self.seen[some], self.met[some] = np.minimum.reduceat(free, begins), now[some], True
        return points[near], sampled

    def crossing(
        self, before: Callable[[Ints], Floats], after: Callable[[Ints], Floats]
    ) -> tuple[Ints, Floats, Floats]:
        """The points (n,) whose straight paths since the last converged state may have come within reach, and the starts (n, 3) and
        the ends (n, 3) [mm] of these paths.

        ``before`` and ``after`` return the starts and the ends for given points. A patch that has not been examined since the last
        converged state lies, with the paths of its points, in a sphere clear of the bone.
        """
        points, _ = self.patches.points(np.flatnonzero(self.met))
        starts, ends = before(points), after(points)
        clear = self.clearance(starts) + self.clearance(ends)
        some = np.flatnonzero(~(clear > np.linalg.norm(ends - starts, axis=1)))
        return points[some], starts[some], ends[some]
