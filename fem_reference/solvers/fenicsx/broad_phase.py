"""Material points that may be near a bone: whole patches of them, the points of a cell, are out of reach until their nodes
have gone as far as they were away.
"""

from collections.abc import Callable

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.rigid_bodies import Obstacle, Sampled
from fem_reference.solvers.fenicsx.contact_points import ContactPoints


class Patches:
    """The points of each of p cells. No point goes farther than the farthest of its cell's k nodes, times the ``spread`` (p,): the
    sum of the magnitudes of their functions there. Where these do not give the place at rest, a turn takes it by ``off`` (p,)
    [mm] more at most.
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
        """The points (n,) of ``some`` patches, one patch after the other, and where those of each begin."""
        counts = self.starts[some + 1] - self.starts[some]
        begins = np.cumsum(counts) - counts
        return self.order[np.repeat(self.starts[some] - begins, counts) + np.arange(counts.sum())], begins


class Nearby:
    """Finds the points within ``reach`` [mm] of a bone of a ``shape``, and perhaps some more. By patch: how ``free`` (p,)
    [mm] its points were when they were looked at last, with its nodes where they were ``seen`` (p, k, 3), in the bone's
    frame; and whether they were ``met`` since the last settled state.
    """

    def __init__(self, shape: Obstacle, reach: float, patches: Patches) -> None:
        self.shape, self.reach, self.patches = shape, reach, patches
        self.clearance = shape.clearance(reach)
        self.free, self.seen = np.full(patches.count, -np.inf), np.zeros((*patches.nodes.shape, 3))
        self.met = np.ones(patches.count, bool)

    def find(self, nodes: Floats, local: Callable[[Ints], Floats]) -> tuple[Ints, Sampled]:
        """The points (n,) that may be within reach, with ``nodes`` (m, 3) [mm] in the bone's frame, and the distance there;
        ``local`` says where any points are in that frame.
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
        """The points (n,) whose straight path since the settled state may have come within reach, and both its ends (n, 3), which
        ``before`` and ``after`` say of any. A patch that was not met is in a ball that is clear, and so are its paths.
        """
        points, _ = self.patches.points(np.flatnonzero(self.met))
        starts, ends = before(points), after(points)
        clear = self.clearance(starts) + self.clearance(ends)
        some = np.flatnonzero(~(clear > np.linalg.norm(ends - starts, axis=1)))
        return points[some], starts[some], ends[some]
