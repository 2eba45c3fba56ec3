"""Edges and corners of facets as they deform, and the nearest places on them: at a crease no facet is nearest to a point."""

import basix
import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.facets import FacetPlaces, Facets

_ITERATIONS, _LONGEST, _SMALL = 30, 0.5, 1e-15  # of Newton's method along an edge, of length 1, and its steps
_SHARP = 1e-10  # radius [mm] of an edge, and of a corner


class FacetEdges:
    """The edges of m ``facets`` that two of them share, and the corners of which all edges are shared: at others the part ends."""

    def __init__(self, facets: Facets) -> None:
        self.facets, cell = facets, facets.element.cell_type
        self.corners, self.ends = np.asarray(basix.geometry(cell)), np.array(basix.topology(cell)[1])
        self.starts, self.lines = self.corners[self.ends[:, 0]], np.diff(self.corners[self.ends], axis=1)[:, 0]
        both = np.concatenate([self.ends, self.ends[:, ::-1]])
        both = both[np.argsort(both[:, 0], kind="stable"), 1].reshape(-1, 2)
        self.into = self.corners[both] - self.corners[:, None]  # from each corner along both edges
        _, numbers = np.unique(facets.dofs[:, : len(self.corners), 0], return_inverse=True)
        numbers = numbers.reshape(-1, len(self.corners))
        pairs = numbers[:, self.ends].reshape(-1, 2)
        _, edge, counts = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True)
        shared = counts[edge.ravel()] == 2
        self.numbers, self.shared = numbers, shared.reshape(-1, len(self.ends))
        self.within: NDArray[np.bool_] = ~np.isin(numbers, pairs[~shared])
        self.order: Ints = np.argsort(numbers.ravel(), kind="stable")  # facets and their corners by corner of the part
        self.first: Ints = np.searchsorted(numbers.ravel()[self.order], np.arange(numbers.max() + 2))
        order = np.flatnonzero(shared)[np.argsort(edge.ravel()[shared], kind="stable")].reshape(-1, 2)
        self.beside: Ints = np.zeros(len(pairs), np.int64)  # facets and their edges on the other side of edges
        self.beside[order], self.turned = order[:, ::-1], np.zeros(len(pairs), bool)
        self.turned[shared] = pairs[shared, 0] != pairs[self.beside[shared], 0]

    def instead(
        self, there: FacetPlaces, nodes: Floats, pairs: tuple[Ints, Floats], asked: Ints
    ) -> tuple[FacetPlaces, NDArray[np.bool_]]:
        """The places ``there`` (n,) of ``pairs`` of facets (n,) and points (n, 3), the ``asked`` ones (k,) on edges where those are
        nearest; and True (n,) for these.
        """
        changed = np.zeros(len(pairs[0]), bool)
        if len(asked):
            on, inner = self.nearest(nodes, pairs[0][asked], pairs[1][asked])
            changed[asked[inner]] = True
            there = there.replaced(asked[inner], on[np.flatnonzero(inner)])
        return there, changed

    def before(self, nodes: Floats, points: Floats, depths: Floats) -> NDArray[np.bool_]:
        """True (n,) where ``points`` (n, 3) [mm] are in front of a facet at less than the ``depths`` (n,) [mm] at which they are
        behind others: outside, then.
        """
        middles, radii = self.facets.balls(nodes)
        found = np.zeros(len(points), bool)
        some, facets = np.nonzero(np.linalg.norm(points[:, None] - middles, axis=2) < radii + depths[:, None])
        there = self.facets.nearest(nodes, facets, points[some])
        gap = np.vecdot(points[some] - there.point, there.normal)
        found[some[(gap > 0) & (gap < depths[some]) & (self.facets.beyond(there.at) <= 0)]] = True
        return found

    def nearest(self, nodes: Floats, which: Ints, points: Floats) -> tuple[FacetPlaces, NDArray[np.bool_]]:
        """The places on the edges of the facets ``which`` (n,) that are nearest to ``points`` (n, 3) [mm]; and True (n,) where the
        part does not end there and no place beside it is nearer.
        """
        sides, every = len(self.ends), np.arange(len(which))
        edges, own = np.tile(np.arange(sides), len(which)), np.repeat(nodes[which], sides, axis=0)
        along = self._along(own, edges, np.repeat(points, sides, axis=0))
        away = np.linalg.norm(np.repeat(points, sides, axis=0) - self._curve(own, edges, along)[0], axis=1)
        best = away.reshape(-1, sides).argmin(axis=1)
        along = along.reshape(-1, sides)[every, best]
        ended, corner = (along <= 0) | (along >= 1), self.ends[best, np.rint(along).astype(int)]
        place = self.facets.places(nodes, which, self.starts[best] + along[:, None] * self.lines[best])
        curve = self._curve(nodes[which], best, along)
        inner, outward = np.where(ended, self.within[which, corner], self.shared[which, best]), np.zeros_like(points)
        for some, around in (
            (np.flatnonzero(inner & ended), self._corners(self.numbers[which, corner][inner & ended])),
            (
                np.flatnonzero(inner & ~ended),
                self._sides((which * sides + best)[inner & ~ended], along[inner & ~ended]),
            ),
        ):
            nearest, outward[some] = self._cone(nodes, around, (points - curve[0])[some])
            inner[some] = nearest
        return self._sharp(place, points - curve[0], self.lines[best] * ~ended[:, None], (*curve[1:], outward)), inner

    def _corners(self, corners: Ints) -> tuple[Ints, Ints, Floats, Floats]:
        """Surroundings of ``corners`` (n,) of the part: the numbers (k,), in order, and for each the facets (k,) there, the
        coordinates (k, 2) in these, and two directions (k, 2, 2) from there into them.
        """
        counts = self.first[corners + 1] - self.first[corners]
        skipped = np.repeat(self.first[corners] - np.cumsum(counts) + counts, counts)
        facets, corner = np.divmod(self.order[skipped + np.arange(counts.sum())], len(self.corners))
        return np.repeat(np.arange(len(corners)), counts), facets, self.corners[corner], self.into[corner]

    def _sides(self, edges: Ints, along: Floats) -> tuple[Ints, Ints, Floats, Floats]:
        """Surroundings, like those of corners, of places ``along`` (n,) edges, by the numbers ``edges`` (n,) of facet and edge."""
        both = np.stack([edges, self.beside[edges]], axis=1).ravel()
        where = np.stack([along, np.where(self.turned[edges], 1 - along, along)], axis=1).ravel()
        facets, edge = np.divmod(both, len(self.ends))
        at = self.starts[edge] + where[:, None] * self.lines[edge]
        into = np.repeat((self.corners.mean(axis=0) - at)[:, None], 2, axis=1)
        return np.repeat(np.arange(len(edges)), 2), facets, at, into

    def _cone(
        self, nodes: Floats, around: tuple[Ints, Ints, Floats, Floats], away: Floats
    ) -> tuple[NDArray[np.bool_], Floats]:
        """True (n,) where points that are ``away`` (n, 3) from places are not nearer to what is ``around`` these, and the sum
        (n, 3) of the normals there, at corners by the angles of facets (Baerentzen and Aanaes 2005, doi 10.1109/TVCG.2005.49): a
        direction into the body has a negative product with it, however its surface is cut into facets.
        """
        number, facets, at, into = around
        place, outward, nearest = self.facets.places(nodes, facets, at), np.zeros_like(away), np.ones(len(away), bool)
        inwards = into @ place.tangents
        one, other = np.swapaxes(inwards / np.linalg.norm(inwards, axis=2, keepdims=True), 0, 1)
        angles = np.arccos(np.clip(np.vecdot(one, other), -1.0, 1.0))
        weights = np.where((into[:, 0] == into[:, 1]).all(axis=1), 1.0, angles)  # of the two facets at an edge alike
        np.add.at(outward, number, weights[:, None] * place.normal)
        nearest[number[((inwards @ away[number][:, :, None]) > 0).any(axis=(1, 2))]] = False
        return nearest, outward

    def _along(self, nodes: Floats, edges: Ints, points: Floats) -> Floats:
        """The coordinates (n,) from 0 to 1 of the places on ``edges`` (n,) nearest to ``points`` (n, 3), by Newton's method; each
        has the ``nodes`` (n, k, 3) of its facet.
        """
        along = np.full(len(edges), 0.5)
        for _ in range(_ITERATIONS):
            point, slope, second = self._curve(nodes, edges, along)
            squared = np.vecdot(slope, slope)
            curved = squared - np.vecdot(second, points - point)
            step = np.vecdot(slope, points - point) / np.where(curved > 0, curved, squared)
            before, along = along, np.clip(along + np.clip(step, -_LONGEST, _LONGEST), 0.0, 1.0)
            if np.abs(along - before).max(initial=0.0) < _SMALL:
                break
        return along

    def _curve(self, nodes: Floats, edges: Ints, along: Floats) -> tuple[Floats, Floats, Floats]:
        """The places (n, 3) [mm] at the coordinates ``along`` (n,) of ``edges``, and their first and second derivatives."""
        a, b = (line[:, None] for line in self.lines[edges].T)
        tables = self.facets.element.tabulate(2, self.starts[edges] + along[:, None] * self.lines[edges])[..., 0]
        point, u, v, uu, uv, vv = np.einsum("dnk,nki->dni", tables, nodes)
        return point, a * u + b * v, a * a * uu + 2 * a * b * uv + b * b * vv

    @staticmethod
    def _sharp(place: FacetPlaces, away: Floats, lines: Floats, curve: tuple[Floats, Floats, Floats]) -> FacetPlaces:
        """The ``place`` on facets (n,) as one on an edge, or at a corner where ``lines`` (n, 2) are 0: its normal has the direction
        of ``away`` (n, 3), and its tangents are those along the edge and across. ``curve``: the first and second derivatives (n, 3)
        of the place along the edge, and a direction outward. In a direction in which the point may turn about the place, this is
        a surface of the radius of an edge.
        """
        slope, second, outward = curve
        distance, least = np.linalg.norm(away, axis=1), np.finfo(float).tiny
        sign = np.where(np.vecdot(away, outward) < 0, -1.0, 1.0)
        normal = sign[:, None] * away / np.maximum(distance, least)[:, None]
        normal[distance == 0] = place.normal[distance == 0]
        slope = slope - np.vecdot(slope, normal)[:, None] * normal
        across = np.cross(normal, slope)
        across /= np.maximum(np.linalg.norm(across, axis=1), least)[:, None]
        bend, slopes = np.zeros_like(place.bend), np.zeros_like(place.slopes)
        bend[:, 1, 1] = -sign / _SHARP
        bend[:, 0, 0] = np.where(lines.any(axis=1), np.vecdot(second, normal), bend[:, 1, 1] * np.vecdot(slope, slope))
        slopes[:, 0] = np.einsum("na,nak->nk", lines, place.slopes)
        tangents = np.stack([slope, across], axis=1)
        return FacetPlaces(place.at, place.basis, slopes, place.point, tangents, normal, bend)
