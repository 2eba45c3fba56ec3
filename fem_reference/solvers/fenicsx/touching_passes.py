"""One side of a body's surface in contact with another: points that meet facets, their pressure, and points that pass through."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.passing import passed, seen_along
from fem_reference.problems.touching import Touching
from fem_reference.solvers.fenicsx.facets import FacetPlaces, Facets
from fem_reference.solvers.fenicsx.own_pairs import OwnPairs, pairs

# A point counts as on a facet up to this distance beyond the edges, in reference coordinates: on a convex surface, points between
# the normals of two facets at their common edge project onto neither facet.
_BEYOND = 0.02
# A point stays on its facet up to this distance beyond the edges, unless another facet is nearer by more than the smoothing: where
# two facets meet at an angle, Newton's method would otherwise go back and forth between them.
_STAYS = 0.05
# The cosine between normals above which a point that slides off a sharp edge is free, as the part faces another way there.
_FACING = -0.5
# In self-contact, a point counts as in front of a facet up to this depth, as a fraction of each facet's radius and half thickness.
_DEEP = 0.125
# There is no contact pressure up to this cosine between a point's normal and minus the facet's: the point does not face the facet.
GRAZING = 0.3
_AT_ONCE = 100000  # pairs of points and facets whose paths are followed together
_SWING = 5 / 3  # a point of a facet moves at most this many times as far as its nodes (Lebesgue constant of P2)
_BULGE = 1.25  # a facet bulges from a plane at most this many times as far as its farthest node


@dataclass(frozen=True, eq=False)
class Met:
    """The n ``points`` of one side that are near the other: their places ``here`` on their own facets ``own`` (n,), the places
    ``there`` that they meet on the other side's ``facets`` (n,), and the ``gap`` (n,) [mm] along the normal there, negative inside.
    """

    points: Ints
    own: Ints
    here: FacetPlaces
    facets: Ints
    there: FacetPlaces
    gap: Floats

    def some(self, which: Ints) -> "Met":
        """The points with the indices ``which`` (k,) in this record."""
        here, there = self.here[which], self.there[which]
        return Met(self.points[which], self.own[which], here, self.facets[which], there, self.gap[which])


@dataclass(frozen=True, eq=False)
class PressedPoints:
    """Contact of n points. ``dofs`` (n, a): the unknowns of the nodes that carry the points and the places they meet; ``rows``
    (n, r, a): the derivatives with respect to these unknowns of r quantities, such as the gap, the position along two tangents and
    the tangents along the normal; ``pull`` (n, r) [N]: the forces that belong to the quantities; ``second`` (n, r, r): their
    derivatives, with the sign of an energy's Hessian; ``force`` (n, 3) [N]: the forces on the points.
    """

    dofs: Ints
    rows: Floats
    pull: Floats
    second: Floats
    force: Floats


# The unknowns (n,) of a settled state, and the points that met facets in this state, if known.
Settled = tuple[Floats, Met | None]


class Pass:
    """Points of one ``side`` against facets of the ``other``. ``areas`` (n,) [mm2]: half the rest areas; ``names``: of both."""

    degree = 8  # of the quadrature; with 5, the pressure between blocks with non-matching meshes is off by 5 %, not 2 %

    def __init__(self, law: Touching, side: Facets, other: Facets, names: tuple[str, str]) -> None:
        self.law, self.side, self.other, self.names = law, side, other, names
        self.at, weights = side.rule(self.degree)
        count, self.each = len(side.dofs), len(weights)
        metric = self._here(side.rest, np.arange(count * self.each)).metric
        self.areas = np.sqrt(np.linalg.det(metric)) * np.tile(weights, count) / 2
        self.basis = side.element.tabulate(0, self.at)[0, :, :, 0]
        corners = Delaunay(other.element.points).simplices  # the corners of flat pieces of a facet
        turned = np.linalg.det(other.element.points[corners[:, 1:]] - other.element.points[corners[:, :1]]) < 0
        corners[turned] = corners[turned][:, ::-1]
        self.overlaps, self.share = np.zeros(len(self.areas)), 0.0  # at rest, and the fraction of them subtracted now
        self.pieces = np.where(other.outward[:, None, None] > 0, corners, corners[:, ::-1])
        middle = other.places(other.rest, np.arange(len(other.rest)), np.full((len(other.rest), 2), 1 / 3))
        self.own = OwnPairs(side) if side is other else None
        # A point below half the thickness of a part is nearer its far side. Self-penetration at rest does not count as thinness.
        inset = law.smoothing if self.own else 0.0
        triangles = other.rest[np.arange(len(other.rest))[:, None, None], self.pieces].reshape(-1, 3, 3)
        starts = middle.point - inset * middle.normal
        self.deepest = (seen_along(starts, -middle.normal, triangles) + inset) / 2

    def _here(self, nodes: Floats, points: Ints) -> FacetPlaces:
        """The places of ``points`` (n,) on their own facets."""
        return self.side.places(nodes, points // self.each, self.at[points % self.each])

    def places(self, unknowns: Floats) -> Floats:
        """The current positions (n, 3) [mm] of the points."""
        return np.asarray((self.basis @ self.side.nodes(unknowns)).reshape(-1, 3))

    def met(self, unknowns: Floats, most: float, last: Met | None = None, settled: Settled | None = None) -> Met:
        """The points at gaps up to ``most`` [mm], each with the nearest facet that faces it, or with the facet that it met
        ``last``. A facet is met to a depth of its radius or half the thickness of its part, whichever is smaller. In self-contact
        the body itself is behind a facet; so a point counts only if, in the ``settled`` state (by default the current one), it was
        in front of the facet, or in contact with the facet or a neighbour.
        """
        nodes, points = self.other.nodes(unknowns), self.places(unknowns)
        middles, radii = self.other.balls(nodes)
        some, facets = self._near(points, (middles, radii), radii + np.maximum(radii, most), 0 * points[:, 0], nodes)
        some, facets = self._beside(nodes, points, some, facets, most)
        some, facets = self._outside(some, facets, settled or (unknowns, None))
        there = self.other.nearest(nodes, facets, points[some])
        gap = np.einsum("ni,ni->n", points[some] - there.point, there.normal)
        beyond, before = self.other.beyond(there.at), np.full(len(points), -1)
        if last is not None:
            before[last.points] = last.facets
        held = before[some] == facets
        at_edge = beyond <= np.where(held, _STAYS, _BEYOND)
        felt = np.flatnonzero((gap < most) & (gap > -self._reach(nodes)[facets]) & at_edge)
        here = self._here(self.side.nodes(unknowns), some[felt])
        facing = np.einsum("ni,ni->n", here.normal, there.normal[felt])
        # A point just beyond the edge of a facet seen from inside is outside the body: the facet before the point is out of reach.
        edge_on = (gap[felt] < -most) & (beyond[felt] > 0) & (facing > _FACING) & ~held[felt]
        faces = (facing < 0) & ~edge_on
        found = Met(some[felt], some[felt] // self.each, here, facets[felt], there[felt], gap[felt])
        depth, nearest = np.abs(found.gap), np.full(len(points), np.inf)
        np.minimum.at(nearest, found.points[faces], depth[faces])
        far = depth > nearest[found.points] + most
        beyond[felt[far]], beyond[felt[held[felt] & ~far]] = np.inf, -1.0
        order = np.lexsort((depth, beyond[felt], found.points))
        order = order[faces[order]]
        return found.some(order[np.unique(found.points[order], return_index=True)[1]])

    def _outside(self, some: Ints, facets: Ints, settled: Settled) -> tuple[Ints, Ints]:
        """Keep, in self-contact, only pairs in which the point was in front of the facet or in contact with it or a neighbour."""
        if self.own is None:
            return some, facets
        unknowns, then = settled
        nodes, points = self.other.nodes(unknowns), self.places(unknowns)
        height, bulge = self._heights(nodes, points, some, facets)
        sizes = self._reach(nodes)
        least = np.minimum(self.law.smoothing, _DEEP * np.minimum(sizes[some // self.each], sizes[facets]))
        before = np.full(len(points), -1)
        if then is not None:
            before[then.points] = then.facets
        held = before[some] >= 0
        held[held] = self.own.beside(before[some[held]], facets[held])
        kept = (height > -least - bulge[facets]) | held
        return some[kept], facets[kept]

    def _near(
        self, points: Floats, balls: tuple[Floats, Floats], reach: Floats, more: Floats, *states: Floats
    ) -> tuple[Ints, Ints]:
        """Pairs of ``points`` (n, 3) and facets in which the point is within the facet's ``reach`` (m,) [mm] plus the point's
        ``more`` (n,) [mm] of the facet's centre. In self-contact, only pairs of facets that may touch (``OwnPairs.near``) count.
        """
        if self.own is None:
            return pairs(points, balls[0], reach + more.max())
        one, facets = self.own.near(balls, reach, *states)
        some, facets = (one[:, None] * self.each + np.arange(self.each)).ravel(), np.repeat(facets, self.each)
        close = np.linalg.norm(points[some] - balls[0][facets], axis=1) <= reach[facets] + more[some]
        return some[close], facets[close]

    def _beside(self, nodes: Floats, points: Floats, some: Ints, facets: Ints, most: float) -> tuple[Ints, Ints]:
        """Those of the given pairs of points and facets whose gap may be at most ``most`` [mm] and whose depth may be within reach,
        judged by the plane through the centre of the facet and the heights of the nodes above this plane.
        """
        height, bulge = self._heights(nodes, points, some, facets)
        kept = (height < most + bulge[facets]) & (height > -(self._reach(nodes) + bulge)[facets])
        return some[kept], facets[kept]

    def _heights(self, nodes: Floats, points: Floats, some: Ints, facets: Ints) -> tuple[Floats, Floats]:
        """The heights (n,) [mm] of points above planes through the centres of facets, and the maximum bulge (m,) of each facet."""
        middle = self.other.places(nodes, np.arange(len(nodes)), np.full((len(nodes), 2), 1 / 3))
        heights = np.einsum("mki,mi->mk", nodes - middle.point[:, None], middle.normal)
        bulge = np.abs(heights).max(axis=1) * _BULGE
        return np.vecdot(points[some] - middle.point[facets], middle.normal[facets]), bulge

    def pressure(self, met: Met) -> tuple[Floats, Floats]:
        """The pressure (n,) [MPa] on ``met`` points, with overlaps at rest subtracted, and its slope with respect to the gap."""
        (whole, slope), shares = self.whole(met), self.shares(met)
        return shares * whole, shares * slope

    def whole(self, met: Met) -> tuple[Floats, Floats]:
        """The ``pressure`` before multiplication by ``shares``, and its slope with respect to the gap."""
        return self.law.pressure(met.gap + self.share * self.overlaps[met.points])

    def shares(self, met: Met) -> Floats:
        """The fractions (n,) of the full pressure that act on the points."""
        return np.ones(len(met.gap))

    def let_fall(self, met: Met) -> None:
        """In self-contact whose overlap at rest stays, reduce the subtracted overlap until the points that ``met`` the other side
        just have no pressure, and to 0 for all other points: points that come apart press as usual when they meet again.
        """
        if self.own and self.law.relaxed is None:
            left = np.zeros_like(self.overlaps)
            np.maximum.at(left, met.points, self.law.smoothing - met.gap)
            self.overlaps = np.minimum(self.overlaps, left)

    def pressed(self, met: Met) -> PressedPoints:
        """The contact of the points that ``met`` the other side.

        The gap of a point x is ``g = n (x - y)``, where y(s, t) is the place on the facet, with unit normal n, for which x - y is
        along n. So ``dg = n (dx - dy)``. With ``T = y' (dx - dy)`` and ``D = n dy'`` along both tangents y', ``a = y' y'``,
        ``b = n y''`` and ``m = a - g b``, the second derivative is ``-d2g = T m^-1 b a^-1 T + 2 T m^-1 D + g D m^-1 D``.
        """
        there, (pressure, change) = met.there, self.pressure(met)
        away = np.concatenate([met.here.basis, -there.basis], axis=1)
        turn = [np.concatenate([0 * met.here.basis, slope], axis=1) for slope in np.moveaxis(there.slopes, 1, 0)]
        vectors = [there.normal, *np.moveaxis(there.tangents, 1, 0), there.normal, there.normal]
        products = zip([away, away, away, *turn], vectors, strict=True)
        count, width = len(away), 3 * away.shape[1]
        rows = [(a[:, :, None] * b[:, None]).reshape(count, width) for a, b in products]
        scaled = pressure[:, None, None] * np.linalg.inv(there.metric - met.gap[:, None, None] * there.bend)
        second = np.zeros((count, 5, 5))
        second[:, 0, 0] = -change
        second[:, 1:3, 1:3] = np.linalg.inv(there.metric) @ there.bend @ scaled
        second[:, 1:3, 3:5] = second[:, 3:5, 1:3] = scaled
        second[:, 3:5, 3:5] = met.gap[:, None, None] * scaled
        areas = self.areas[met.points]
        pull = np.zeros((count, 5))
        pull[:, 0] = areas * pressure
        force = pull[:, :1] * there.normal
        return PressedPoints(self._dofs(met), np.stack(rows, axis=1), pull, areas[:, None, None] * second, force)

    def _dofs(self, met: Met) -> Ints:
        """The unknowns (n, a) of the nodes that carry the points and the places that they ``met``."""
        dofs = np.concatenate([self.side.dofs[met.own], self.other.dofs[met.facets]], axis=1)
        return dofs.reshape(len(dofs), 3 * dofs.shape[1])

    def depth(self, met: Met) -> float:
        """The maximum depth [mm] of the points that ``met`` the other side."""
        return float((-met.gap).max(initial=0.0))

    def through(self, before: Floats, last: Met, now: Floats, met: Met) -> Ints:
        """The points (k,) that went through the other side from the unknowns ``before`` to ``now`` (n,), except points that
        ``met`` it: points that are behind the facet that they were near, and points that passed a facet on their path. Paths that
        begin inside, or so near that flat pieces of a facet may be in front of them, are also followed from in front: raised by at
        most the depth to which points are met. Points that end in front of a facet have passed only flat pieces of it.
        """
        return self._passed_by(before, last, now, met.points, np.zeros(len(self.areas)))

    def _passed_by(self, before: Floats, last: Met, now: Floats, seen: Ints, deep: Floats) -> Ints:
        """The points as in ``through``, except those ``seen`` or up to ``deep`` (n,) [mm] behind a facet they do not face."""
        starts, ends = self.places(before), self.places(now)
        old, new = self.other.nodes(before), self.other.nodes(now)
        shift = (new - old).mean(axis=(0, 1))  # a common displacement changes nothing
        ends, new = ends - shift, new - shift
        free, none = ~np.isin(np.arange(len(ends)), seen), np.zeros(0, np.int64)
        rise, reach, clear = np.zeros_like(starts), self._reach(old), self._heights(old, starts, none, none)[1]
        travel = sum(float(np.linalg.norm(way, axis=-1).max()) for way in (ends - starts, _SWING * (new - old)))
        most = min(max(self.law.smoothing, float(clear.max()), travel), float(self.other.balls(old)[1].max()))
        near = Pass.met(self, before, most, None, (before, last))
        near = near.some(np.flatnonzero(free[near.points]))
        for one in (near, last):
            high = np.maximum(self.law.smoothing, clear[one.facets]) - one.gap
            rise[one.points] = np.clip(high, 0, reach[one.facets])[:, None] * one.there.normal
        paths = (starts, ends, free), (starts + rise, ends + rise, free & rise.any(axis=1))
        passed_by = [self._passed(a, b, some, old, new) for a, b, some in paths]
        points, facets = np.concatenate([np.stack([near.points, near.facets]), *passed_by], axis=1)
        there, first = self.other.nearest(new, facets, ends[points]), np.arange(len(points)) < len(near.points)
        gap, on = np.vecdot(ends[points] - there.point, there.normal), self.other.beyond(there.at) <= _BEYOND
        here = self._here(self.side.nodes(now), points)
        beside = np.vecdot(here.normal, there.normal) > -GRAZING
        safe = (gap > 0) | (beside & (gap > -deep[points]))
        return np.unique(points[np.where(first, on & ~safe & (gap < 0), ~(on & safe))])

    def _reach(self, nodes: Floats) -> Floats:
        """The depth (m,) [mm] to which facets with ``nodes`` (m, k, 3) are met: the smaller of radius and half thickness."""
        return np.minimum(self.other.balls(nodes)[1], self.deepest)

    def slid(self, now: Floats, pressed: Ints, met: Ints) -> Ints:
        """The points (k,) that reach the other side, here a skin that may not be touched, at the unknowns ``now`` (n,): points that
        were ``pressed`` before by the part next to the skin, and all deep points, except points that ``met`` the part, as they are
        in contact. A point above the part may be behind a wall of the skin, but is then beyond the wall's edge and not counted.
        """
        near = self.met(now, self.law.smoothing)
        facing = np.einsum("ni,ni->n", near.here.normal, near.there.normal) < _FACING
        deep = (near.gap < -self.law.smoothing) & (self.other.beyond(near.there.at) <= 0)
        lost = (np.isin(near.points, pressed) & facing) | deep
        return np.asarray(near.points[lost & ~np.isin(near.points, met)])

    def _passed(self, starts: Floats, ends: Floats, free: NDArray[np.bool_], old: Floats, new: Floats) -> Ints:
        """The ``free`` points (n,) that pass flat pieces of facets on their paths, and these facets: (2, p)."""
        (first, wide), (last, later) = self.other.balls(old), self.other.balls(new)
        far = np.linalg.norm(ends - starts, axis=1) / 2
        radii = np.maximum(wide, later) + np.linalg.norm(last - first, axis=1) / 2
        some, facets = self._near((starts + ends) / 2, ((first + last) / 2, radii), radii, far, old, new)
        some, facets = some[free[some]], facets[free[some]]
        lost = [np.zeros((2, 0), np.int64)]
        for part in np.array_split(np.arange(len(some)), len(some) // _AT_ONCE + 1):
            pieces = self.pieces[facets[part]]
            which, points = facets[part, None, None], np.repeat(some[part], pieces.shape[1])
            corners = (nodes[which, pieces].reshape(-1, 3, 3) for nodes in (old, new))
            found = passed(starts[points], ends[points], *corners).reshape(pieces.shape[:2]).any(axis=1)
            lost.append(np.stack([some, facets])[:, part[found]])
        return np.concatenate(lost, axis=1)
