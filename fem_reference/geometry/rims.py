"""Rims of attachments as edges of a coarse surface, so that no triangle extends across a rim."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from fem_reference.foundations.mesh import (
    Bools,
    Floats,
    Ints,
    Surface,
    connected_parts,
    enclosed_volume,
    triangle_areas,
)
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.coarsening import flip_edges, free_part
from fem_reference.geometry.distance import distances
from fem_reference.geometry.parts import Parts, between, relaxed, widened
from fem_reference.geometry.sectors import attached_area, sectors, shares_at

# These parameters were chosen by trials on hip muscles. The smoothing length of the shares, in triangle sizes (a larger value
# rounds corners more).
_SMOOTHED = 0.1
# A vertex that is nearer to a crossing of an edge with the rim than this fraction of the edge moves onto the crossing. Above 0.35
# triangles degenerate; below 0.25 slivers remain.
_NEAR = 0.3
# A vertex that cannot move and is nearer to a crossing than this fraction of the edge counts as lying on the rim.
_THERE = 0.2
# An edge across a piece of, or a gap in, an attachment is cut if more than this fraction of the edge is in the piece or gap.
_NARROW = 0.3
_REFINED = 2  # number of rounds of the search for narrow pieces and gaps
_ISLAND = 0.1  # the minimum area of an island of an attachment that is kept, relative to the squared triangle size
_WIDENED = 0.1  # the maximum outward movement of a rim in each round, in triangle sizes
_SAMPLES = 17  # the number of samples of the shares along an edge
_TRIALS = 10  # the number of trials in the search for the level whose line encloses the original area


def with_rims(coarse: Surface, fine: Surface, shares: Mapping[str, Floats], size: float) -> tuple[Surface, Ints]:
    """Cut a ``coarse`` surface along the rims of attachments. Returns the surface and the label (m,) of each of its m triangles: 0
    if it is free, i + 1 if it is in attachment i. ``fine``: the surface on which attachments are defined, by the attached
    ``shares`` (k, 3) of the corners of its triangles; ``size`` [mm]: the length of the edges of the coarse surface.

    The shares are smoothed over a tenth of ``size``, which removes single vertices and pinholes. The rim is the level line that
    encloses the original area. Vertices near the rim move onto it, and edges across it are cut there (Labelle and Shewchuk 2007,
    doi 10.1145/1276377.1276448, adapted to surfaces).
    """
    free = np.zeros(len(coarse.triangles), np.int64)
    parts = Parts(coarse.points, coarse.triangles, free, np.zeros(len(coarse.points), bool))
    for label, attached in enumerate(shares.values(), start=1):
        area = attached_area(fine, attached)
        smooth = _smoothed(fine, attached, _SMOOTHED * size)
        parts = _seeded(parts, fine, smooth, _ISLAND * size**2)
        parts = _best(parts, fine, smooth, label, area)
    parts = relaxed(parts, fine, size)
    areas = [attached_area(fine, attached) for attached in shares.values()]
    points = widened(parts, areas, enclosed_volume(fine.points, fine.triangles), _WIDENED * size)
    return Surface(points, parts.triangles, coarse.place), parts.labels


def _smoothed(surface: Surface, shares: Floats, length: float) -> Floats:
    """Smooth the ``shares`` (m, 3) by one implicit step of diffusion over ``length`` [mm], but not across sharp edges."""
    nodes = sectors(surface)
    count = int(nodes.max()) + 1
    corners = surface.points[surface.triangles]
    mass = np.bincount(nodes.ravel(), np.repeat(triangle_areas(surface.points, surface.triangles) / 3, 3), count)
    given = np.zeros(count)
    given[nodes] = shares
    rows, columns, weights = [], [], []
    for here, left, right in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        one, other = corners[:, left] - corners[:, here], corners[:, right] - corners[:, here]
        across = np.maximum(np.linalg.norm(np.cross(one, other), axis=1), np.finfo(float).tiny)
        rows.append(nodes[:, left])
        columns.append(nodes[:, right])
        weights.append(np.clip(np.einsum("ij,ij->i", one, other) / across, 0, 10) / 2)
    half = coo_array((np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), shape=(count, count))
    links = (half + half.T).tocsr()
    stiffness = diags_array(np.asarray(links.sum(axis=1)).ravel()) - links
    mass = np.maximum(mass, mass.mean() * 1e-9)
    solved = splu((diags_array(mass) + length**2 * stiffness).tocsc()).solve(mass * given)
    return np.asarray(solved[nodes])


def _seeded(parts: Parts, fine: Surface, shares: Floats, least: float) -> Parts:
    """Add a point in each island with an area of at least ``least`` [mm2] that contains no point of the coarse surface."""
    number = _islands(fine, shares)
    attached = number >= 0
    thirds = np.tile(triangle_areas(fine.points, fine.triangles)[:, None] / 3, 3)
    sizes = np.bincount(number[attached], thirds[attached])
    nearest = distances(parts.points, fine)
    there = number[nearest.triangle, nearest.barycentric.argmax(axis=1)]
    sizes[there[there >= 0]] = 0
    for island in np.flatnonzero(sizes >= least):
        peak = fine.triangles[number == island][shares[number == island].argmax()]
        at = int(distances(fine.points[[peak]], parts.surface).triangle[0])
        a, b, c = parts.triangles[at]
        new = len(parts.points)
        triangles = np.concatenate([np.delete(parts.triangles, at, axis=0), [[a, b, new], [b, c, new], [c, a, new]]])
        labels = np.concatenate([np.delete(parts.labels, at), np.repeat(parts.labels[at], 3)])
        points = np.concatenate([parts.points, fine.points[[peak]]])
        triangles = flip_edges(points, triangles, labels)
        parts = Parts(points, triangles, labels, between(triangles, labels, len(points)))
    return parts


def _islands(fine: Surface, shares: Floats) -> Ints:
    """Index (m, 3) of the connected island of shares above 1/2 to which each corner belongs, -1 for corners outside all islands."""
    attached = np.zeros(len(fine.points), bool)
    attached[fine.triangles[shares > 1 / 2]] = True
    ends = fine.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ends = ends[attached[ends].all(axis=1)]
    part = connected_parts(ends[:, 0], ends[:, 1], len(attached))
    return np.where(shares > 1 / 2, part[fine.triangles], -1)


def _best(parts: Parts, fine: Surface, shares: Floats, label: int, area: float) -> Parts:
    """Find the level at which the attached area is closest to ``area`` [mm2], by bisection, and return the parts with that rim."""
    for _ in range(_REFINED):
        parts = _refined(parts, fine, _Edges.of(parts, fine, shares))
    edges = _Edges.of(parts, fine, shares)
    best, low, high = None, 0.0, 1.0
    for _ in range(_TRIALS):
        level = (low + high) / 2
        found = _cut(parts, fine, edges.at(level), label)
        if best is None or abs(found.area(label) - area) < abs(best.area(label) - area):
            best = found
        low, high = (level, high) if found.area(label) > area else (low, level)
    assert best is not None
    return best


def _refined(parts: Parts, fine: Surface, edges: "_Edges") -> Parts:
    """Cut edges with both ends on one side of the level 1/2 and a large part on the other side."""
    other = (edges.along > 1 / 2) != (edges.along[:, :1] > 1 / 2)
    narrow = np.flatnonzero((other.mean(axis=1) > _NARROW) & ~other[:, -1])
    at = (other[narrow] @ np.arange(_SAMPLES) / other[narrow].sum(axis=1) / (_SAMPLES - 1))[:, None]
    a, b = (parts.points[edges.ends[narrow, i]] for i in (0, 1))
    points, triangles, parent = _split(parts, fine, edges, narrow, a * (1 - at) + b * at)
    labels = parts.labels[parent]
    triangles = flip_edges(points, triangles, labels)
    return Parts(points, triangles, labels, between(triangles, labels, len(points)))


@dataclass(frozen=True, eq=False)
class _Edges:
    """Shares along the edges of a surface. ``ends`` (e, 2): the vertices; ``of_triangles`` (m, 3): the edge opposite each corner;
    ``along`` (e, s): samples from end to end; ``at_points`` (n,), ``at_middles`` (m,): the shares at points and triangle centroids.
    """

    ends: Ints
    of_triangles: Ints
    along: Floats
    at_points: Floats
    at_middles: Floats

    @classmethod
    def of(cls, parts: Parts, fine: Surface, shares: Floats) -> "_Edges":
        sides = np.sort(parts.triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
        ends, _, which, _ = distinct(sides)
        fractions = np.linspace(0, 1, _SAMPLES)[:, None]
        samples = parts.points[ends[:, 0]][:, None] * (1 - fractions) + parts.points[ends[:, 1]][:, None] * fractions
        at_points = shares_at(parts.points, fine, shares)
        along = shares_at(samples[:, 1:-1].reshape(-1, 3), fine, shares).reshape(len(ends), -1)
        along = np.column_stack([at_points[ends[:, 0]], along, at_points[ends[:, 1]]])
        middles = parts.points[parts.triangles].mean(axis=1)
        return cls(ends, which.reshape(-1, 3), along, at_points, shares_at(middles, fine, shares))

    def at(self, level: float) -> "_Crossings":
        above = self.along - level
        change = (above[:, :-1] > 0) != (above[:, 1:] > 0)
        crossed = change.any(axis=1)
        fractions = []
        for step in (change.argmax(axis=1), change.shape[1] - 1 - change[:, ::-1].argmax(axis=1)):
            before, after = (np.take_along_axis(above, step[:, None] + i, axis=1)[:, 0] for i in (0, 1))
            part = before / np.where(crossed, before - after, 1.0)
            fractions.append(np.where(crossed, (step + part) / (_SAMPLES - 1), np.nan))
        signs = np.where(self.at_points > level, 1, -1)
        return _Crossings(self, np.column_stack(fractions), signs, self.at_middles > level)


@dataclass(frozen=True, eq=False)
class _Crossings:
    """Crossings of ``edges`` with a level. ``fractions`` (e, 2): the first and the last crossing of each edge, as fractions of its
    length, NaN if there is none; ``signs`` (n,): 1 for points above the level, else -1; ``within`` (m,): mask of triangles with a
    centroid above the level.
    """

    edges: _Edges
    fractions: Floats
    signs: Ints
    within: Bools


def _cut(parts: Parts, fine: Surface, crossings: _Crossings, label: int) -> Parts:
    """Cut triangles along the crossings; free triangles inside the rim get the ``label``."""
    points, signs = _snapped(parts, fine, crossings)
    ends = crossings.edges.ends
    split = np.flatnonzero(signs[ends[:, 0]] * signs[ends[:, 1]] < 0)
    at = crossings.fractions[split, :1]
    a, b = (points[ends[split, i]] for i in (0, 1))
    parts = replace(parts, points=points)
    points, triangles, parent = _split(parts, fine, crossings.edges, split, a * (1 - at) + b * at)
    signs = np.concatenate([signs, np.zeros(len(split), np.int64)])
    total = signs[triangles].sum(axis=1)
    within = np.where(total == 0, crossings.within[parent], total > 0)
    labels = np.where(within & (parts.labels[parent] == 0), label, parts.labels[parent])
    return Parts(points, triangles, labels, between(triangles, labels, len(points)))


def _snapped(parts: Parts, fine: Surface, crossings: _Crossings) -> tuple[Floats, Ints]:
    """Points (n, 3), moved to near crossings unless they would leave a sharp edge or another rim; and signs (n,), 0 on the rim."""
    across = ~np.isnan(crossings.fractions[:, 0])
    ends, fractions = crossings.edges.ends[across], crossings.fractions[across]
    point = np.concatenate([ends[:, 0], ends[:, 1]])
    share = np.concatenate([fractions[:, 0], 1 - fractions[:, 1]])
    direction = parts.points[ends[:, 1]] - parts.points[ends[:, 0]]
    shift = np.concatenate([direction, -direction]) * share[:, None]
    free = free_part(parts.points, parts.triangles, point, shift)
    stuck = parts.rim[point] | (np.linalg.norm(shift - free, axis=1) > np.linalg.norm(shift, axis=1) / 3)
    near = share < np.where(stuck, np.where(parts.rim[point], _NEAR, _THERE), _NEAR)
    order = np.lexsort([np.linalg.norm(shift, axis=1), stuck, point])
    order = order[near[order]]
    moved, first = np.unique(point[order], return_index=True)
    chosen = order[first]
    signs, points = crossings.signs.copy(), np.array(parts.points)
    signs[moved] = 0
    goes = ~stuck[chosen]
    points[moved[goes]] = distances(points[moved[goes]] + shift[chosen[goes]], fine).closest
    return points, signs


def _split(parts: Parts, fine: Surface, edges: _Edges, chosen: Ints, middles: Floats) -> tuple[Floats, Ints, Ints]:
    """Cut the ``chosen`` edges at ``middles`` (k, 3) on ``fine``; returns the points, the triangles and their parents."""
    new = np.full(len(edges.ends), -1)
    new[chosen] = len(parts.points) + np.arange(len(chosen))
    points = np.concatenate([parts.points, distances(middles, fine).closest])
    return points, *_divided(points, parts.triangles, new[edges.of_triangles])


def _divided(points: Floats, triangles: Ints, cuts: Ints) -> tuple[Ints, Ints]:
    """Cut triangles at the points ``cuts`` (m, 3) opposite their corners, -1 for none; returns the triangles and their parents."""
    count = (cuts >= 0).sum(axis=1)
    pieces, parents = [triangles[count == 0]], [np.flatnonzero(count == 0)]
    one = np.flatnonzero(count == 1)
    a, b, c, middle, _, _ = _turned(triangles, cuts, one, (cuts[one] >= 0).argmax(axis=1))
    pieces += [np.column_stack([a, b, middle]), np.column_stack([a, middle, c])]
    two = np.flatnonzero(count == 2)
    a, b, c, _, on_ca, on_ab = _turned(triangles, cuts, two, (cuts[two] < 0).argmax(axis=1))
    pieces.append(np.column_stack([a, on_ab, on_ca]))
    shorter = np.linalg.norm(points[b] - points[on_ca], axis=1) <= np.linalg.norm(points[c] - points[on_ab], axis=1)
    pieces.append(np.where(shorter[:, None], np.column_stack([b, on_ca, on_ab]), np.column_stack([c, on_ca, on_ab])))
    pieces.append(np.where(shorter[:, None], np.column_stack([b, c, on_ca]), np.column_stack([b, c, on_ab])))
    three = np.flatnonzero(count == 3)
    a, b, c, on_bc, on_ca, on_ab = _turned(triangles, cuts, three, np.zeros(len(three), np.int64))
    corners = ((a, on_ab, on_ca), (on_ab, b, on_bc), (on_ca, on_bc, c), (on_ab, on_bc, on_ca))
    pieces += [np.column_stack(piece) for piece in corners]
    return np.concatenate(pieces), np.concatenate([*parents, one, one, two, two, two, three, three, three, three])


def _turned(triangles: Ints, cuts: Ints, chosen: Ints, first: Ints) -> tuple[Ints, ...]:
    """Return the corners (k,) of the ``chosen`` triangles and the cuts opposite them, in order from the corner ``first`` (k,)."""
    turn = (first[:, None] + np.arange(3)) % 3
    return (*triangles[chosen[:, None], turn].T, *cuts[chosen[:, None], turn].T)
