"""Parts of a surface that may touch: their overlap at the start, which contact search finds only if it is shallow, and the skin
beyond their rims.
"""

from functools import lru_cache

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, connected_parts, found_in, normals
from fem_reference.geometry.distance import depth_within, distances, inside
from fem_reference.geometry.intersections import crossings, overlaps, self_crossings
from fem_reference.geometry.skins import edge_lengths
from fem_reference.problems.body import Body, Cells, facet_corners, outer_facets, reference_nodes
from fem_reference.problems.touching import Touching

# Contact points are half a spacing apart. Between them, a right-angled edge can penetrate by this fraction of the spacing.
BETWEEN = 0.25
_SPLIT = np.array([[0, 1, 2], [2, 1, 3]])  # cuts a facet with four corners into two triangles


def overlap(body: Body, law: Touching) -> float:
    """The depth [mm] to which the parts of a ``law`` overlap at the start of a ``body``, measured as in ``overlap_at``."""
    points = body.mesh.points if body.start is None else body.start(np.array(body.mesh.points))
    return overlap_at(body.mesh, law, points)


def overlap_at(mesh: Cells, law: Touching, points: Floats) -> float:
    """The depth [mm] to which the parts of a ``law`` overlap if the points of the ``mesh`` are at ``points`` (n, 3) [mm].

    For two parts it is the greater of two depths: the maximum depth of the corners of each part below the skin of the other part's
    piece of the mesh (a lower bound), and the depth of facets that cross (too large where ridges cross). For a part with itself it
    is the greater of the maximum depth of the centre of a facet inside the entire skin, and the depth of facets that cross the
    skin. Curved facets are measured at their corners, and their bulge is subtracted.
    """
    one, other = mesh.facets[law.one], mesh.facets[law.other]
    owner, facets, triangles = _skin(mesh, points)
    if law.one == law.other:
        skin, own = Surface(points, triangles), found_in(facets, one)[owner]
        pairs = self_crossings(skin)
        crossed = (points[triangles[some]] for some in pairs[own[pairs].any(axis=1)].T)
        return max(float(overlaps(*crossed).max(initial=0.0)), depth_within(skin, own)) - _bulge(mesh, points, one)
    piece = _pieces(mesh)
    depths, parts = [0.0], list[Surface]()
    for part, against in ((one, other), (other, one)):
        skin = Surface(points, triangles[np.isin(piece[facets[:, 0]], piece[against])[owner]])
        corners = points[np.unique(part)]
        depths.append(distances(corners[inside(skin, corners)], skin).distance.max(initial=0.0))
        parts.append(Surface(points, triangles[found_in(facets, part)[owner]]))
    if len(pairs := crossings(*parts)):
        crossed = (points[part.triangles[some]] for part, some in zip(parts, pairs.T, strict=True))
        depths.append(overlaps(*crossed).max())
    return float(max(depths)) - _bulge(mesh, points, np.concatenate([one, other]))


def through_itself(now: Surface, rest: Surface) -> tuple[float, Floats]:
    """A lower bound on the depth [mm] to which a surface ``now`` penetrates itself, and the position (3,) of this penetration.

    Vertices at which the surface penetrates itself at ``rest`` do not count. If there are no such vertices, the depth of triangles
    within the body counts too, because the depth to which triangles cross each other is smaller.
    """
    known = _crossing(rest) if len(pairs := self_crossings(now)) else ()
    new = pairs[~np.isin(now.triangles[pairs], known).any(axis=(1, 2))]
    if not len(new):
        return 0.0, now.points[0]
    one, other = np.swapaxes(now.points[now.triangles[new]], 0, 1)
    reach = overlaps(one, other)
    within = 0.0 if len(known) else depth_within(now, np.full(len(now.triangles), True))
    return max(float(reach.max()), within), one[np.argmax(reach), 0]


@lru_cache(maxsize=8)
def _crossing(surface: Surface) -> Ints:
    """The vertices (k,) at which a surface penetrates itself."""
    return np.unique(surface.triangles[self_crossings(surface)])


def longest_edge(mesh: Cells, law: Touching) -> float:
    """The longest edge [mm] at rest of the facets of a ``law``. Contact points are at most a quarter of this length apart."""
    corners = (mesh.points[mesh.facets[name]] for name in (law.one, law.other))
    return max(float(edge_lengths(one).max()) for one in corners)


def unseen(mesh: Cells, law: Touching) -> float:
    """The depth [mm] to which a right-angled edge can penetrate between contact points that are an eighth of the longest edge
    apart, as with 42 points on a facet. With 16 points it can penetrate about twice as deep, but checks allow only this depth.
    """
    return BETWEEN * longest_edge(mesh, law) / 4


def beyond_rim(body: Body, side: str, other: str) -> Ints:
    """The facets (f, 3 or 4) of the skin around the part ``other``, on the same piece of the mesh, with which no law lets the part
    ``side`` be in contact; none for contact of a part with itself.
    """
    mesh, facets = body.mesh, outer_facets(body.mesh)[0]
    laws = [(law.one, law.other) for law in body.touching]
    named = [mesh.facets[two] for one, two in [*laws, *(law[::-1] for law in laws)] if one == side]
    piece = _pieces(mesh)
    beside = np.isin(piece[facets[:, 0]], piece[mesh.facets[other]])
    return np.asarray(facets[beside & ~found_in(facets, np.concatenate(named)) & (side != other)])


def _pieces(mesh: Cells) -> Ints:
    """The number (n,) of the connected piece of the mesh to which each point belongs."""
    return connected_parts(np.repeat(mesh.cells[:, 0], mesh.cells.shape[1]), mesh.cells.ravel(), len(mesh.points))


def _skin(mesh: Cells, points: Floats) -> tuple[Ints, Ints, Ints]:
    """The facet (t,) of each triangle of the skin, the outer facets (f, 3 or 4), and the outward triangles (t, 3) of the skin."""
    facets, cells = outer_facets(mesh)
    split = _SPLIT[: facets.shape[1] - 2]
    triangles, owner = facets[:, split].reshape(-1, 3), np.repeat(np.arange(len(facets)), len(split))
    middles = points[mesh.cells[cells]].mean(axis=1)[owner]
    corners = points[triangles]
    inwards = np.vecdot(normals(corners), corners.mean(axis=1) - middles) < 0
    triangles[inwards] = triangles[inwards][:, ::-1]
    return owner, facets, triangles


def _bulge(mesh: Cells, points: Floats, parts: Ints) -> float:
    """The bulge [mm] of the cells at the facets ``parts``: the maximum distance of a node from its position in a straight cell with
    the same corners, plus the maximum distance of a facet with four corners from its two triangles.
    """
    nodes, corners = reference_nodes(mesh.kind, mesh.degree), reference_nodes(mesh.kind, 1)
    at = points[mesh.cells[np.isin(mesh.cells[:, : len(corners)], parts).sum(axis=1) >= parts.shape[1]]]
    if mesh.kind == "tetrahedron":
        shares, warp = np.hstack([1 - nodes.sum(axis=1, keepdims=True), nodes @ corners[1:].T]), 0.0
    else:
        shares = np.where(corners[None] > 0, nodes[:, None], 1 - nodes[:, None]).prod(axis=2)
        quads = at[:, np.array(facet_corners(mesh.kind))]
        warp = np.linalg.norm(np.einsum("msci,c->msi", quads, [0.25, -0.25, -0.25, 0.25]), axis=2).max()
    return float(np.linalg.norm(at - shares @ at[:, : len(corners)], axis=2).max() + warp)
