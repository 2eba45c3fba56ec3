"""Friction between parts of a surface: a point of one side sticks to an anchor on a facet of the other, or slides along the facet.

Slip is measured in reference coordinates of a facet, which move with the facet. A rigid motion therefore causes no slip, and forces
and moments balance.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.friction import returned, since_entry
from fem_reference.solvers.fenicsx.facets import FacetPlaces
from fem_reference.solvers.fenicsx.touching_passes import Met, Pass

# Indices of second and third derivatives in the tables of basix.
_SECOND = np.array([[3, 4], [4, 5]])
_THIRD = np.array([[[6, 7], [7, 8]], [[7, 8], [8, 9]]])


@dataclass(frozen=True, eq=False)
class Rubbed:
    """Friction of n points, expressed by twelve quantities: x - y (3), both tangents of the facet (3 each), and the second
    derivatives of the facet along its normal (3).

    ``rows`` (n, 12, a): the derivatives of the quantities with respect to the unknowns ``dofs`` (n, a); ``pull`` (n, 12) [N]: the
    forces that belong to the quantities; ``second`` (n, 12, 12): the derivatives of the forces, with the sign of an energy's
    Hessian. ``held`` (n, 2): the anchors, in coordinates of the points' current facets; ``lost`` (n,) [N mm]: the
    dissipated work; ``far`` (n,): the distance slid beyond a facet.
    """

    dofs: Ints
    rows: Floats
    pull: Floats
    second: Floats
    held: Floats
    lost: Floats
    far: Floats


@dataclass(frozen=True, eq=False)
class Sliding:
    """The coordinates of n points on their facets: the first derivatives ``A`` (n, 2, 12) and the second derivatives ``Q``
    (n, 2, 12, 12) with respect to the twelve quantities of ``Rubbed``; and the ``metric`` (n, 2, 2) with its derivative ``turn``
    (n, 2, 2, 12).
    """

    A: Floats
    Q: Floats
    metric: Floats
    turn: Floats


def slip(there: FacetPlaces, gap: Floats, second: Floats, third: Floats) -> Sliding:
    """The derivatives of the coordinates of the facet point nearest to a point at a ``gap`` g (n,) [mm], from ``y' (x - y) = 0``.

    The facet has tangents y', metric a and second derivatives b along its normal; let ``R = x - y = g n`` and ``m = a - g b``. The
    first derivative is then ``m^-1 (y' (dx - dy) + R dy')``, and the second is m^-1 times the second derivative of the condition
    along the first. ``second`` and ``third``: derivatives of the position [mm].
    """
    count, y, R = len(gap), there.tangents, gap[:, None] * there.normal
    inverse = np.linalg.inv(there.metric - gap[:, None, None] * there.bend)
    V = np.zeros((count, 2, 12))
    V[:, :, :3] = y
    for b in (0, 1):
        V[:, b, 3 + 3 * b : 6 + 3 * b] = R
    A, S = inverse @ V, np.zeros((count, 2, 12, 12))
    for b in (0, 1):
        own = slice(3 + 3 * b, 6 + 3 * b)
        S[:, b, own, :3] += np.eye(3)
        S[:, b, :3, own] += np.eye(3)
        for c in (0, 1):
            line = np.zeros((count, 12))
            line[:, 9 + b + c] = gap
            line[:, :3] += second[:, b, c]
            line[:, own] -= y[:, c]
            line[:, 3 + 3 * c : 6 + 3 * c] -= y[:, b]
            mixed = line[:, :, None] * A[:, c, None, :]
            S[:, b] += mixed + np.swapaxes(mixed, 1, 2)
        products = np.einsum("ncdi,nei->ncde", second, y)
        curved = np.einsum("ncdi,ni->ncd", third[:, b], R) - products[:, b] - np.swapaxes(products[:, b], 1, 2)
        curved -= np.einsum("ncdi,ni->ncd", second, y[:, b])
        S[:, b] += np.einsum("ncr,ncd,nds->nrs", A, curved, A)
    slopes = np.einsum("nbci,ncr->nbir", second, A)  # the total derivatives of y'
    for b in (0, 1):
        slopes[:, b, :, 3 + 3 * b : 6 + 3 * b] += np.eye(3)
    turn = np.einsum("nai,nbir->nabr", y, slopes)
    return Sliding(A, np.einsum("nab,nbrs->nars", inverse, S), there.metric, turn + np.swapaxes(turn, 1, 2))


class Rubbing:
    """Friction of the points of one pass, by the law of the pass. ``facets`` (n,) and ``at`` (n, 2): the anchors of the points on
    the other side; the facet is -1 for a point without an anchor. ``settled`` (u,): the unknowns from which slip is counted.
    Friction ``acts`` once no overlap at rest remains to be removed.
    """

    acts = False

    def __init__(self, one: Pass, count: int) -> None:
        self.one, self.law, self.other = one, one.law, one.other
        self.facets, self.at, self.settled = np.full(len(one.areas), -1), np.zeros((len(one.areas), 2)), np.zeros(count)

    def settle(self, met: Met, held: Floats, unknowns: Floats) -> None:
        """Hold only the points that ``met`` facets, at the anchors ``held`` (k, 2) on these facets, until the next call."""
        self.acts = self.law.relaxed is None or self.one.share == 0
        self.facets[:] = -1
        self.facets[met.points], self.at[met.points], self.settled = met.facets, held, np.array(unknowns)

    def rubbed(self, met: Met, unknowns: Floats) -> Rubbed:
        """Friction of points that ``met`` facets: ``-min(k |e|, friction p) e / |e|`` for elastic slip e in the current metric."""
        tables = self.other.element.tabulate(3, met.there.at)[..., 0]
        place, whole, elastic, change = self._slipped(met, unknowns, tables)
        covector = np.einsum("nab,nb->na", place.metric, elastic)
        size = np.sqrt(np.maximum(np.vecdot(elastic, covector), 0.0))
        turned = np.einsum("nabr,nb->nar", place.turn, elastic)
        rates = np.einsum("na,nar->nr", covector, change) + np.einsum("na,nar->nr", elastic, turned) / 2
        rates /= np.maximum(size, np.finfo(float).tiny)[:, None]
        (pressure, by_gap), friction, areas = (
            self.one.pressure(met),
            self.law.friction or 0.0,
            self.one.areas[met.points],
        )
        found = returned(size, friction * pressure, self.law.stiffness)
        rates = found.by_slip[:, None] * rates
        rates[:, :3] += (found.by_limit * friction * by_gap)[:, None] * met.there.normal
        slope = (
            found.stiffness[:, None, None] * (turned + place.metric @ change) + covector[:, :, None] * rates[:, None]
        )
        force = -found.stiffness[:, None] * covector
        second = np.einsum("nar,nas->nrs", place.A, slope) - np.einsum("na,nars->nrs", force, place.Q)
        pull, kept = np.einsum("na,nar->nr", force, place.A), found.stiffness / self.law.stiffness
        return Rubbed(
            *self._rows(met, tables),
            areas[:, None] * pull,
            areas[:, None, None] * second,
            met.there.at - kept[:, None] * elastic,
            areas * found.stiffness * size**2 * (1 - kept),
            self.other.beyond(met.there.at - whole),
        )

    def _slipped(self, met: Met, unknowns: Floats, tables: Floats) -> tuple[Sliding, Floats, Floats, Floats]:
        """The derivatives of the facet coordinates, their total change (n, 2) since the settled state, the part (n, 2) of this
        change that counts as elastic slip, and the derivative (n, 2, 12) of this part. ``tables``: of the facets' basis functions.
        """
        every = np.einsum("dnk,nki->dni", tables, self.other.nodes(unknowns)[met.facets])
        place = slip(
            met.there, met.gap, *(every[which].transpose(-2, *range(which.ndim), -1) for which in (_SECOND, _THIRD))
        )
        starts, share, by_gap = self._starts(met)
        whole, normal = met.there.at - starts, np.pad(met.there.normal, ((0, 0), (0, 9)))
        change = share[:, None, None] * place.A + whole[:, :, None] * (by_gap[:, None] * normal)[:, None]
        return place, whole, share[:, None] * whole, change

    def _starts(self, met: Met) -> tuple[Floats, Floats, Floats]:
        """The facet coordinates (n, 2) from which the points slip, the fraction (n,) of the path from there that counts as slip,
        and the derivative (n,) of the fraction with respect to the gap. A point new in contact slips from the position at which its
        path comes within the smoothing.
        """
        at, share, by_gap = self.at[met.points], np.ones(len(met.gap)), np.zeros(len(met.gap))
        moved = np.flatnonzero(self.facets[met.points] != met.facets)
        held = self.facets[met.points[moved]] >= 0
        nodes, places = self.other.nodes(self.settled), self.one.places(self.settled)[met.points[moved]]
        places[held] = self.other.places(nodes, self.facets[met.points[moved[held]]], at[moved[held]]).point
        found = self.other.nearest(nodes, met.facets[moved], places)
        at[moved] = found.at
        before = np.vecdot(places - found.point, found.normal)
        entered = ~held & (before > self.law.smoothing)
        new = moved[entered]
        left = self.one.share * self.one.overlaps[met.points[new]]
        share[new], by_gap[new] = since_entry(met.gap[new] + left, before[entered] + left, self.law.smoothing)
        return at, share, by_gap

    def _rows(self, met: Met, tables: Floats) -> tuple[Ints, Floats]:
        """The unknowns (n, a) of the points and of the facets that they met, and the ``rows`` (n, 12, a) of ``Rubbed``."""
        own, others = met.here.basis, tables[[0, 1, 2, 3, 4, 5]].transpose(1, 0, 2)
        none, count = np.zeros((len(own), 6, own.shape[1])), len(own)
        by = np.concatenate([none, others], axis=2)
        by[:, 0] = np.concatenate([own, -others[:, 0]], axis=1)
        width = 3 * by.shape[2]
        vectors = (by[:, :3, None, :, None] * np.eye(3)[:, None]).reshape(count, 9, width)
        along = (by[:, 3:, :, None] * met.there.normal[:, None, None]).reshape(count, 3, width)
        dofs = np.concatenate([self.one.side.dofs[met.own], self.other.dofs[met.facets]], axis=1).reshape(count, width)
        return dofs, np.concatenate([vectors, along], axis=1)
