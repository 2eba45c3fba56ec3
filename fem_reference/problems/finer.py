"""Bodies with finer cells: each cell is cut into eight parts of half its size. The volume and the regions remain the same."""

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, edge_vectors
from fem_reference.geometry.embedding import barycentric
from fem_reference.geometry.fibres import Directions
from fem_reference.geometry.nested import EDGES, PARTS
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Body, Cells, Kind, facet_corners, reference_nodes

# The weights (shares) of the corners of a cell at the nodes of its parts are integer multiples of 1 / _SHARES.
_SHARES = 64


@dataclass(frozen=True, eq=False)
class OfParts:
    """The fibre directions in the parts of cells, taken from the cells. The eight parts of a cell have successive numbers."""

    fibre: Directions

    def __call__(self, cells: Ints, points: Floats) -> Floats:
        """The directions (n, 3) in the parts ``cells`` (n,)."""
        return self.fibre(np.asarray(cells) // 8, points)


def finer(body: Body) -> tuple[Body, Ints]:
    """The ``body`` with each cell cut into eight, and the index (n,) in the finer mesh of each point of the coarser mesh, -1 for a
    point that belongs to no cell. The shape of the coarser cells is preserved: no surface becomes smoother.
    """
    mesh, shared = _cut(body.mesh)

    def place(on: str | Skin) -> str | Skin:
        return on if isinstance(on, str) else _in_parts(on, body.mesh)

    return replace(
        body,
        mesh=mesh,
        prescribed=tuple(replace(entry, on=place(entry.on)) for entry in body.prescribed),
        contact=None if body.contact is None else replace(body.contact, on=place(body.contact.on)),
        fibre=None if body.fibre is None else OfParts(body.fibre),
    ), shared


def _cut(mesh: Cells) -> tuple[Cells, Ints]:
    """The finer mesh, in which each cell of ``mesh`` is cut into eight, and the index (n,) in it of each point of ``mesh``."""
    own = reference_nodes(mesh.kind, mesh.degree)
    nodes = _linear(mesh.kind, own) @ _parts(mesh.kind)  # (8, k, 3), in the reference cell
    shares = np.rint(_SHARES * _linear(mesh.kind, nodes)).astype(np.int64)  # (8, k, c)
    names, first = _named(mesh.cells[:, : shares.shape[2]], shares)
    places = _shape(mesh.kind, mesh.degree, nodes.reshape(-1, 3)) @ mesh.points[mesh.cells]
    points = places.reshape(-1, 3)[first]
    shared = np.full(len(mesh.points), -1)
    for i, node in enumerate(own):
        part, j = np.argwhere((nodes == node).all(axis=2))[0]
        shared[mesh.cells[:, i]] = names[:, part, j]
    points[shared[shared >= 0]] = mesh.points[shared >= 0]  # equal up to rounding
    facets = _facets(mesh, names, shares)
    return Cells(points, names.reshape(-1, len(own)), mesh.kind, mesh.degree, facets), shared


def _parts(kind: Kind) -> Floats:
    """The corners (8, c, 3) of the parts of the reference cell. All parts have positive volume."""
    corners = reference_nodes(kind, 1)
    if kind == "hexahedron":
        return np.stack([(corners + low) / 2 for low in product((0, 1), repeat=3)])
    ten = np.concatenate([corners, corners[EDGES].mean(axis=1)])
    parts = ten[
        PARTS[2]
    ]  # four at the corners, four around the line from the midpoint of edge 03 to the midpoint of edge 12
    wrong = np.linalg.det(parts[:, 1:] - parts[:, :1]) < 0
    return np.asarray(np.where(wrong[:, None, None], parts[:, [1, 0, 2, 3]], parts))


def _linear(kind: Kind, places: Floats) -> Floats:
    """The values (..., c) of the linear shape functions of the corners at ``places`` (..., 3) of the reference cell."""
    return _shape(kind, 1, places.reshape(-1, 3)).reshape(*places.shape[:-1], -1)


def _shape(kind: Kind, degree: int, places: Floats) -> Floats:
    """The values (q, k) of the shape functions of the nodes at ``places`` (q, 3) of the reference cell."""
    powers = np.array([p for p in product(range(degree + 1), repeat=3) if kind == "hexahedron" or sum(p) <= degree])
    nodes, points = ((some[:, None, :] ** powers).prod(axis=2) for some in (reference_nodes(kind, degree), places))
    return np.asarray(np.linalg.solve(nodes.T, points.T).T)


def _named(corners: Ints, shares: Ints) -> tuple[Ints, Ints]:
    """The index (m, 8, k) of each node of the parts in the finer mesh, and the first occurrence of each index.

    ``corners`` (m, c): the corners of the cells; ``shares`` (8, k, c): the weights of the corners at the nodes of the parts. Nodes
    with equal weights of the same corners are one node.
    """
    some = np.where(shares > 0, corners[:, None, None], -1)
    order = np.argsort(some, axis=-1)
    rows = np.stack([some, np.broadcast_to(shares, some.shape)], axis=-1)
    rows = np.take_along_axis(rows, order[..., None], axis=-2).reshape(-1, 2 * shares.shape[-1])
    _, first, names = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return names.reshape(some.shape[:-1]), first


def _facets(mesh: Cells, names: Ints, shares: Ints) -> dict[str, Ints]:
    """The regions of the finer mesh: for each region, those facets of the parts that lie on a facet of the region."""
    sides = facet_corners(mesh.kind)
    every = np.arange(shares.shape[-1])
    parts = []  # for each side, the facets (part, corners of the part) that lie on it
    for side in sides:
        off = shares[:, every[:, None], np.setdiff1d(every, side)].any(axis=2)  # (8, c)
        parts.append([(part, other) for part in range(8) for other in sides if not off[part, list(other)].any()])
    cells = enumerate(mesh.cells.tolist())
    at = {tuple(sorted(cell[k] for k in side)): (i, j) for i, cell in cells for j, side in enumerate(sides)}
    found = {}
    for name, facets in mesh.facets.items():
        places = [at[tuple(sorted(facet))] for facet in facets.tolist()]
        cut = [names[i, part, list(corners)] for i, j in places for part, corners in parts[j]]
        found[name] = np.array(cut, np.int64).reshape(-1, facets.shape[1])
    return found


def _in_parts(skin: Skin, mesh: Cells) -> Skin:
    """The ``skin`` with each point in the nearest part of its cell, found by barycentric coordinates in straight tetrahedra."""
    corners = mesh.points[mesh.cells[skin.cells, :4]]
    places, parts = barycentric(skin.points, corners)[:, 1:], _parts("tetrahedron")
    inside = np.linalg.solve(edge_vectors(parts)[None], (places[:, None] - parts[None, :, 0])[..., None])
    least = _linear("tetrahedron", inside[..., 0]).min(axis=-1)
    return replace(skin, cells=8 * skin.cells + least.argmax(axis=1))
