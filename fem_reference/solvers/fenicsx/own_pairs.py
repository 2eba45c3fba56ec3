"""Pairs of points and facets that are near each other, and pairs of facets in one part of a surface that face each other."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.facets import Facets

# Two facets do not face each other if the cosine of the angle between their normals at their centres is above this value. Below it,
# they may face each other at some points, because facets are curved.
_ALIKE = 0.5


class OwnPairs:
    """Finds pairs of nearby facets among the ``facets`` of one part of a surface."""

    def __init__(self, facets: Facets) -> None:
        self.facets, self.count = facets, len(facets.rest)
        nodes = facets.dofs[:, :, 0]
        at = csr_array((np.ones(nodes.size), (np.repeat(np.arange(self.count), nodes.shape[1]), nodes.ravel())))
        self.next_to = csr_array(at @ at.T > 0)

    def beside(self, one: Ints, other: Ints) -> NDArray[np.bool_]:
        """True (n,) where the facet in ``one`` (n,) is the facet in ``other`` (n,) or shares a node with it."""
        return np.asarray(self.next_to[one, other]).ravel() if len(one) else np.zeros(0, bool)

    def near(self, balls: tuple[Floats, Floats], reach: Floats, *states: Floats) -> tuple[Ints, Ints]:
        """Pairs of facets, as two arrays (p,), that face each other in one of the ``states`` and share no node.

        ``balls``: the centres (m, 3) and radii (m,) [mm] of balls around the facets. The ball of the first facet of a pair comes
        within ``reach`` (m,) [mm] of the centre of the second facet. ``states``: positions (m, k, 3) [mm] of the nodes.
        """
        middles, radii = balls
        found = cKDTree(middles).query_ball_point(middles, reach + radii.max())
        other = np.repeat(np.arange(self.count), [len(some) for some in found])
        one = np.concatenate([np.asarray(some, np.int64) for some in found])
        normals = [self._normals(nodes) for nodes in states]
        facing = np.any([np.vecdot(each[one], each[other]) < _ALIKE for each in normals], axis=0)
        close = np.linalg.norm(middles[one] - middles[other], axis=1) <= reach[other] + radii[one]
        one, other = one[facing & close], other[facing & close]
        apart = ~self.beside(one, other)
        return one[apart], other[apart]

    def _normals(self, nodes: Floats) -> Floats:
        """The normals (m, 3) at the centres of the facets, whose ``nodes`` (m, k, 3) [mm] are given."""
        return self.facets.places(nodes, np.arange(self.count), np.full((self.count, 2), 1 / 3)).normal


def pairs(points: Floats, middles: Floats, reach: Floats) -> tuple[Ints, Ints]:
    """Pairs of points (p,) and facets (p,), the point within ``reach`` (m,) [mm] of the facet's centre (``middles``, (m, 3))."""
    low, high = (middles - reach[:, None]).min(axis=0), (middles + reach[:, None]).max(axis=0)
    near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    if not len(near):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    found = cKDTree(points[near]).query_ball_point(middles, reach)
    some = near[np.concatenate([np.asarray(one, np.int64) for one in found])]
    return some, np.repeat(np.arange(len(middles)), [len(one) for one in found])
