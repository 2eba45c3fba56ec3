"""Pairs of points and facets near each other; in one part of a surface, of facets that face each other and share no node."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.facets import Facets

# Facets do not face each other if the cosine between their normals is above this; other facets may in places, as they bend.
_ALIKE = 0.5


class OwnPairs:
    """Finds pairs among the ``facets`` of one part."""

    def __init__(self, facets: Facets) -> None:
        self.facets, self.count = facets, len(facets.rest)
        nodes = facets.dofs[:, :, 0]
        at = csr_array((np.ones(nodes.size), (np.repeat(np.arange(self.count), nodes.shape[1]), nodes.ravel())))
        self.next_to = csr_array(at @ at.T > 0)

    def beside(self, one: Ints, other: Ints) -> NDArray[np.bool_]:
        """True (n,) where facets ``one`` (n,) are ``other`` (n,) or share a node with them."""
        return np.asarray(self.next_to[one, other]).ravel() if len(one) else np.zeros(0, bool)

    def near(self, balls: tuple[Floats, Floats], reach: Floats, *states: Floats) -> tuple[Ints, Ints]:
        """The facets (p,) whose ``balls``, middles (m, 3) and radii (m,) [mm], come within ``reach`` (m,) of the middles of other
        facets (p,) that they face in one of the ``states``, nodes (m, k, 3) [mm], and with which they share no node.
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
        """The normals (m, 3) in the middles of the facets, with their ``nodes`` (m, k, 3) [mm]."""
        return self.facets.places(nodes, np.arange(self.count), np.full((self.count, 2), 1 / 3)).normal


def pairs(points: Floats, middles: Floats, reach: Floats) -> tuple[Ints, Ints]:
    """Points (p,) and facets (p,) where the point is within ``reach`` (m,) [mm] of the ``middles`` (m, 3) of the facet."""
    low, high = (middles - reach[:, None]).min(axis=0), (middles + reach[:, None]).max(axis=0)
    near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    if not len(near):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    found = cKDTree(points[near]).query_ball_point(middles, reach)
    some = near[np.concatenate([np.asarray(one, np.int64) for one in found])]
    return some, np.repeat(np.arange(len(middles)), [len(one) for one in found])
