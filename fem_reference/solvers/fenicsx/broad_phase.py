"""A search for material points that may be near a bone. The points of a cell form a patch, which stays out of reach until its nodes
have moved by its clearance at the last search.
"""

from collections.abc import Callable

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.rigid_bodies import Obstacle, Sampled
from fem_reference.solvers.fenicsx.contact_points import ContactPoints


class Patches:
    """The points of each of p cells. A point moves at most ``spread`` (p,) times as far as the k nodes of its cell: the sum of the
    magnitudes of basis functions. If these do not reproduce its rest position, rotations add at most ``off`` (p,) [mm].
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
        """The points (n,) of ``some`` patches, patch by patch, and the start index of each patch."""
        counts = self.starts[some + 1] - self.starts[some]
        begins = np.cumsum(counts) - counts
        return self.order[np.repeat(self.starts[some] - begins, counts) + np.arange(counts.sum())], begins


class Nearby:
    """Finds the points within ``reach`` [mm] of a bone of a ``shape``, and perhaps some more. For each patch it stores, from the
    last search that examined its points, their clearance ``free`` (p,) [mm] and the positions ``seen`` (p, k, 3) of its nodes in
    the bone's frame; ``met`` (p,): True if there was such a search since the last converged state.
    """

    def __init__(self, shape: Obstacle, reach: float, patches: Patches) -> None:
        self.shape, self.reach, self.patches = shape, reach, patches
        self.clearance = shape.clearance(reach)
        self.free, self.seen = np.full(patches.count, -np.inf), np.zeros((*patches.nodes.shape, 3))
        self.met = np.ones(patches.count, bool)

    def find(self, nodes: Floats, local: Callable[[Ints], Floats]) -> tuple[Ints, Sampled]:
        """The points (n,) that may be within reach, and their distance to the bone. ``nodes`` (m, 3) [mm] are in the bone's frame;
        ``local`` gives the positions of points in that frame.
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
        """The points (n,) whose straight path since the last converged state may have come within reach, and the ends (n, 3) of
        the path, which ``before`` and ``after`` give for any points. A patch that was not examined since then lies, with the paths
        of its points, in a sphere clear of the bone.
        """
        points, _ = self.patches.points(np.flatnonzero(self.met))
        starts, ends = before(points), after(points)
        clear = self.clearance(starts) + self.clearance(ends)
        some = np.flatnonzero(~(clear > np.linalg.norm(ends - starts, axis=1)))
        return points[some], starts[some], ends[some]
