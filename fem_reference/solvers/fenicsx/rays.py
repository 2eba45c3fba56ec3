"""Contact along the normals of the points: each point presses on the other side where the line along the point's normal meets it.

The normal of a point never jumps, and at the common edge of two facets the line meets both facets at the same position, so forces
are continuous there. A force and its reaction act along one line, so forces and moments balance to within rounding, although the
forces have no energy.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.facets import FacetPlaces
from fem_reference.solvers.fenicsx.own_pairs import pairs
from fem_reference.solvers.fenicsx.touching_passes import GRAZING, Met, Pass, PressedPoints, Settled

_FRONTAL = 0.7  # the cosine, defined as for ``GRAZING``, from which the full pressure acts
# The distance beyond an edge, in reference coordinates, over which the pressure fades where no other facet follows; without it, a
# point at a sharp edge would alternate between contact and no contact.
_WIDE = 0.1
# Beyond an edge, in radii of the facet at rest: the depth at which the pressure vanishes, and the distance within which another
# point on a facet takes a share of the pressure.
_SHALLOW, _NEAR = 0.25, 0.4
_STAYS = 4.0  # beyond edges, a point stays on its last facet unless another has this many times the pressure
_ON = 1e-7  # a line meets a facet up to this distance beyond the facet's edges, in reference coordinates
_AT = 0.02  # the same for the point of a facet that is nearest to a point
_BENT = 3.0  # largest height, in bulges of a facet, of a point inside the body that faces the facet; 2.1 for a bend of 45 degrees
_SAME = 1e-6  # two crossings of a line are the same up to this distance [mm]
# A point is in contact if it has at least this fraction of its full pressure, or if its depth beyond the smoothing is at most this
# many times the depth that belongs to its pressure.
_HALF, _YIELDS = 0.5, 2.0


def _step(x: Floats) -> tuple[Floats, Floats]:
    """A smooth step (n,) from 0 at ``x`` = 0 to 1 at 1, and its derivative."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x), 6 * x * (1 - x)


def facing(here: FacetPlaces, there: FacetPlaces) -> tuple[Floats, Floats]:
    """The fraction (n,) of the pressure that acts, and its derivative with respect to the cosine (defined as for ``GRAZING``)."""
    share, slope = _step((-np.vecdot(here.normal, there.normal) - GRAZING) / (_FRONTAL - GRAZING))
    return share, slope / (_FRONTAL - GRAZING)


def _close(apart: Floats, near: Floats) -> tuple[Floats, Floats]:
    """The closeness (n,) of two crossings ``apart`` (n,) [mm] on a line, 0 at a distance of ``near`` [mm], and its derivative."""
    share, slope = _step(1 - np.abs(apart) / near)
    return share, -slope / near * np.sign(apart)


@dataclass(frozen=True, eq=False)
class Shades:
    """Points ``there`` on ``facets`` (k,), with gaps ``gap`` (k,) [mm], that take a share of the pressure from the hits ``of``
    (k,), which are beyond edges. They do so within a distance ``near`` (k,) [mm].
    """

    of: Ints
    facets: Ints
    there: FacetPlaces
    gap: Floats
    near: Floats


@dataclass(frozen=True, eq=False)
class Hits(Met):
    """Points where lines along normals hit facets. A point has at most one hit on a facet and one beyond an edge. ``left`` (n,):
    the fraction of its pressure that the ``shades`` leave to a hit beyond an edge.
    """

    left: Floats
    shades: Shades


@dataclass(frozen=True, eq=False)
class Changes:
    """The first-order changes of n hits, expressed by nine quantities.

    The quantities are x - y (3), the tangents of the point's facet along the point's normal (2), and the tangents of the other
    facet along the other normal (2) and along the point's normal (2). ``rows`` (n, 9, a): the derivatives of the quantities with
    respect to the unknowns. Derivatives with respect to the quantities: ``turn`` (n, 3, 9) of the point's normal, ``slid``
    (n, 2, 9) of the hit's reference coordinates, ``opened`` (n, 9) of the gap, and ``cosine`` (n, 9) of the cosine (defined as
    for ``GRAZING``).
    """

    rows: Floats
    turn: Floats
    slid: Floats
    opened: Floats
    cosine: Floats


def changes(here: FacetPlaces, there: FacetPlaces, gap: Floats) -> Changes:
    """The first-order changes of hits, derived from ``y = x + g n``."""
    n, other = here.normal, there.normal
    count, k = here.basis.shape
    rows = np.zeros((count, 9, k + there.basis.shape[1], 3))
    rows[:, :3] = np.concatenate([here.basis, -there.basis], axis=1)[:, None, :, None] * np.eye(3)[:, None]
    rows[:, 3:5, :k] = here.slopes[:, :, :, None] * n[:, None, None]
    rows[:, 5:7, k:] = there.slopes[:, :, :, None] * other[:, None, None]
    rows[:, 7:9, k:] = there.slopes[:, :, :, None] * n[:, None, None]
    turn = np.zeros((count, 3, 9))
    turn[:, :, 3:5] = -np.swapaxes(np.linalg.inv(here.metric) @ here.tangents, 1, 2)
    moved = gap[:, None, None] * turn
    moved[:, :, :3] += np.eye(3)
    across = np.stack([there.tangents[:, 0], there.tangents[:, 1], -n], axis=2)
    solved = np.linalg.solve(across, moved)
    bent = there.bend @ solved[:, :2]
    bent[:, [0, 1], [5, 6]] += 1
    dual = np.linalg.inv(there.metric) @ there.tangents
    cosine = np.einsum("ni,nai,nar->nr", n, dual, bent) - np.einsum("ni,nir->nr", other, turn)
    return Changes(rows.reshape(count, 9, 3 * rows.shape[2]), turn, solved[:, :2], solved[:, 2], cosine)


class RayPass(Pass):
    """Points of one side whose normals meet facets of the other side."""

    degree = 14  # 42 points on a facet instead of 16, so that a point leaving a sharp margin takes less force with it

    def met(self, unknowns: Floats, most: float, last: Met | None = None, _: Settled | None = None) -> Hits:
        """The hits of lines along the points' normals, at gaps up to ``most`` [mm] along the lines and down to the depth
        of ``Pass.met``. On either side of a point the first crossing decides: if its facet faces away, the point is not inside (for
        a crossing behind the point) or not outside (for a crossing in front of it).
        """
        nodes = self.other.nodes(unknowns)
        some, facets, here = self._lines(unknowns, nodes, most)
        there, gap = self.other.along(nodes, facets, here.point, here.normal)
        beyond, share = self.other.beyond(there.at), facing(here, there)[0]
        felt = (gap < most) & (gap > -self._reach(nodes)[facets]) & (share > 0)
        on = np.flatnonzero(beyond <= _ON)
        far = np.abs(gap) - _ON * share  # at a common edge, prefers the facet that faces the point
        first = on[_first(2 * some[on] + (gap[on] < 0), far[on])]
        hits = first[felt[first]]
        hits = hits[_first(some[hits], far[hits])]
        size = self.other.balls(self.other.rest)[1][facets]
        out = np.flatnonzero((beyond > _ON) & (beyond < _WIDE) & felt)
        left, shade = np.ones(len(some)), np.full(len(some), -1)
        for one, by in _of_same(some, out, on[share[on] > 0]):
            rest = 1 - share[by] * _close(gap[one] - gap[by], _NEAR * size[one])[0]
            less = rest < left[one]
            left[one[less]], shade[one[less]] = rest[less], by[less]
        ends = self._ends(there.at[out], gap[out], facets[out])[0]
        full = (left * share)[out] * ends * self.law.pressure(gap[out])[0]
        if last is not None:
            stays = np.isin(some[out] * len(nodes) + facets[out], last.points * len(nodes) + last.facets)
            full[stays] *= _STAYS
        out, full = out[full > 0], full[full > 0]
        found = np.sort(np.concatenate([hits, out[_first(some[out], -full)]]))
        found = np.delete(found, self._hidden(nodes, here[found], gap[found]))
        of = np.flatnonzero((shade[found] >= 0) & (left[found] > 0) & (beyond[found] > _ON))
        by = shade[found[of]]
        shades = Shades(of, facets[by], there[by], gap[by], _NEAR * size[found[of]])
        own, points = some[found] // self.each, some[found]
        left[hits] = 1.0
        return Hits(points, own, here[found], facets[found], there[found], gap[found], left[found], shades)

    def _hidden(self, nodes: Floats, here: FacetPlaces, gap: Floats) -> Ints:
        """The hits (k,) that lie behind a nearer crossing with a facet out of reach; ``_lines`` leaves such crossings out."""
        reach = self._reach(nodes)
        deep = np.flatnonzero(-gap > reach.min())
        if not len(deep):
            return deep
        half, (middles, radii) = gap[deep, None] / 2, self.other.balls(nodes)
        one, facets = pairs(here.point[deep] + half * here.normal[deep], middles, radii + np.abs(half).max())
        some = deep[one]
        there, nearer = self.other.along(nodes, facets, here.point[some], here.normal[some])
        between = (nearer < -reach[facets]) & (nearer > gap[some] + _SAME) & (self.other.beyond(there.at) <= _ON)
        return np.unique(some[between])

    def _lines(self, unknowns: Floats, nodes: Floats, most: float) -> tuple[Ints, Ints, FacetPlaces]:
        """Pairs of points (p,) and facets (p,) that lines along normals may hit, and the points' positions on their own facets."""
        points, (middles, radii) = self.places(unknowns), self.other.balls(nodes)
        reach = np.maximum(self._reach(nodes), most)
        some, facets = self._near(points, (middles, radii), radii + reach, 0 * points[:, 0], nodes)
        height, bulge = self._heights(nodes, points, some, facets)
        kept = np.flatnonzero(np.abs(height) < (reach + bulge)[facets])
        some, facets, height = some[kept], facets[kept], height[kept]
        here = self._here(self.side.nodes(unknowns), some)
        away = middles[facets] - here.point
        kept = np.vecdot(away, away) - np.vecdot(away, here.normal) ** 2 <= radii[facets] ** 2
        # Keep only points that can have contact. A bent facet may face a point above its middle plane by more than its bulge.
        kept &= np.isin(some, some[kept & (height < most + _BENT * bulge[facets])])
        return some[kept], facets[kept], here[np.flatnonzero(kept)]

    def _ends(self, at: Floats, gap: Floats, facets: Ints) -> tuple[Floats, Floats, Floats]:
        """The fraction (n,) of the pressure that acts beyond edges; its derivatives with respect to place (n, 2) and gap (n,)."""
        size, (beyond, leaving) = _SHALLOW * self.other.balls(self.other.rest)[1][facets], self.other.leaving(at)
        (wide, by_place), (shallow, by_gap) = _step(1 - beyond / _WIDE), _step(2 + 2 * gap / size)
        out = beyond > _ON
        by_gap, shallow = np.where(out, 2 * by_gap / size, 0.0), np.where(out, shallow, 1.0)
        return wide * shallow, -(by_place * shallow / _WIDE)[:, None] * leaving, wide * by_gap

    def shares(self, met: Met) -> Floats:
        """The fractions (n,) of the full pressure that act on hits."""
        assert isinstance(met, Hits)  # found by ``met``
        return met.left * facing(met.here, met.there)[0] * self._ends(met.there.at, met.gap, met.facets)[0]

    def depth(self, met: Met) -> float:
        """The maximum depth [mm], normal to the facets, of the points whose hits are on facets."""
        cosine, on = -np.vecdot(met.here.normal, met.there.normal), self.other.beyond(met.there.at) <= _ON
        return float((-met.gap * cosine)[on].max(initial=0.0))

    def pressed(self, met: Met) -> PressedPoints:
        """The contact of hits; the pressure acts along the normal of the point."""
        assert isinstance(met, Hits)  # found by ``met``
        by, n = changes(met.here, met.there, met.gap), met.here.normal
        whole, slope = self.whole(met)
        cosine, turned = facing(met.here, met.there)
        ends, by_place, by_gap = self._ends(met.there.at, met.gap, met.facets)
        areas, pressure = self.areas[met.points], whole * met.left * cosine * ends
        rise = (cosine * (slope * ends + whole * by_gap))[:, None] * by.opened
        rise += (whole * turned * ends)[:, None] * by.cosine
        rise += (whole * cosine)[:, None] * np.einsum("na,nar->nr", by_place, by.slid)
        rise *= met.left[:, None]
        second, pull = np.zeros((len(n), 9, 9)), np.zeros((len(n), 9))
        second[:, :3] = n[:, :, None] * rise[:, None] + pressure[:, None, None] * by.turn
        second[:, 7:9] = -pressure[:, None, None] * by.slid
        pull[:, :3] = -(areas * pressure)[:, None] * n
        return PressedPoints(self._dofs(met), by.rows, pull, areas[:, None, None] * second, pull[:, :3])

    def shaded(self, met: Hits) -> PressedPoints:
        """The change of the forces beyond edges when their shades move: a tangent without forces."""
        of, shades = met.shades.of, met.shades
        here, there = met.here[of], met.there[of]
        hit, shade = changes(here, there, met.gap[of]), changes(here, shades.there, shades.gap)
        (share, turned), (close, parted) = facing(here, shades.there), _close(met.gap[of] - shades.gap, shades.near)
        by_shade = (turned * close)[:, None] * shade.cosine - (share * parted)[:, None] * shade.opened
        own, other = 3 * here.basis.shape[1], 3 * there.basis.shape[1]
        rows = np.zeros((len(of), 4, own + 2 * other))
        rows[:, :3, : own + other] = hit.rows[:, :3]
        rows[:, 3, : own + other] = np.einsum("nr,nrw->nw", (share * parted)[:, None] * hit.opened, hit.rows)
        taken = np.einsum("nr,nrw->nw", by_shade, shade.rows)
        rows[:, 3, :own] += taken[:, :own]
        rows[:, 3, own + other :] = taken[:, own:]
        second, areas = np.zeros((len(of), 4, 4)), self.areas[met.points[of]]
        second[:, :3, 3] = -(areas * self.pressure(met)[0][of] / met.left[of])[:, None] * here.normal
        dofs = np.concatenate([self._dofs(met)[of], self.other.dofs[shades.facets].reshape(len(of), other)], axis=1)
        return PressedPoints(dofs, rows, np.zeros((len(of), 4)), second, np.zeros((len(of), 3)))

    def through(self, before: Floats, last: Met, now: Floats, met: Met) -> Ints:
        """The points (k,) that went through the other side, as in ``Pass.through``.

        Points that ``met`` the other side are in contact if they have at least half of their full pressure. All other points, and
        points that ``Pass`` would meet, are in contact only to a depth that fits their pressure. Points that end in front of the
        nearest facet and face it are not lost: they slid round an edge.
        """
        deep = np.full(len(self.areas), self.law.smoothing)
        np.maximum.at(deep, met.points, self.law.smoothing + _YIELDS / self.law.stiffness * self.pressure(met)[0])
        near = Pass.met(self, now, self.law.smoothing, None, (before, last))
        held = near.points[near.gap > -deep[near.points]]
        lost = self._passed_by(before, last, now, np.union1d(held, met.points[self.shares(met) >= _HALF]), deep)
        nodes, points = self.other.nodes(now), self.places(now)[lost]
        middles, radii = self.other.balls(nodes)
        some, facets = pairs(points, middles, 2 * radii)
        there = self.other.nearest(nodes, facets, points[some])
        on = np.flatnonzero(self.other.beyond(there.at) <= _AT)
        on = on[_first(some[on], np.linalg.norm(points[some[on]] - there.point[on], axis=1))]
        here, there = self._here(self.side.nodes(now), lost[some[on]]), there[on]
        front = (np.vecdot(here.point - there.point, there.normal) > 0) & (facing(here, there)[0] > 0)
        return np.delete(lost, some[on][front])


def _first(keys: Ints, values: Floats) -> Ints:
    """The indices (k,) of the smallest of the ``values`` (n,) for each of the different ``keys`` (n,)."""
    order = np.lexsort((values, keys))
    return np.asarray(order[np.unique(keys[order], return_index=True)[1]])


def _of_same(points: Ints, one: Ints, other: Ints) -> list[tuple[Ints, Ints]]:
    """Pairs of entries of ``one`` (n,) and ``other`` (m,), which are indices into ``points``, that belong to the same point. The
    list has one item for the first partners of the entries of ``one``, one for the second partners, and so on.
    """
    other = other[np.argsort(points[other], kind="stable")]
    low, high = (np.searchsorted(points[other], points[one], side) for side in ("left", "right"))
    has = [np.flatnonzero(low + i < high) for i in range(int((high - low).max(initial=0)))]
    return [(one[some], other[low[some] + i]) for i, some in enumerate(has)]
