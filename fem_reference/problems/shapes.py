"""Structured bodies of the catalogue: smooth maps of unit cubes that are cut into straight or curved cells.

All lengths are in mm. A region lists the corners of its facets in lattice order: in a quadrilateral, corners 0 and 3 are opposite.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np
import scipy
from scipy.spatial import cKDTree

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, connected_parts
from fem_reference.problems.body import Cells, Kind, facet_corners, reference_nodes
from fem_reference.problems.checks import check_box

Map = Callable[[Floats], Floats]
Counts = tuple[int, int, int]

# Nodes closer to each other than this fraction of the body's size are merged.
_SAME = 1e-9
# The bulge of the sides of the square in a disc, for which three blocks meet at each of its corners at angles of 120 degrees.
_BULGE = np.tan(np.pi / 12) / 2
# Half the side of the square, divided by the radius of its disc.
_SQUARE_IN_CYLINDER = 0.45
_SQUARE_IN_VENTRICLE = 0.22
# The ventricle of Land et al. 2015 (doi 10.1098/rspa.2015.0641): semi-axes inside, wall thickness, and z of its base [mm].
_SHORT, _LONG, _WALL, _BASE = 7.0, 17.0, 3.0, 5.0
# At the apex, the slope of the angle exceeds its mean by this fraction, so that the arc length grows evenly.
_APEX = 0.3


@dataclass(frozen=True, eq=False)
class Brick:
    """A block of a body. ``place``: a smooth function from points (n, 3) of the unit cube to points (n, 3) [mm]; ``counts``: the
    numbers of cells along the axes of the cube; ``faces``: the region of the surface on each face of the cube, by face, x0 to z1.

    If two blocks meet, the axes along their common face must have the same directions, so that the tetrahedra match.
    """

    place: Map
    counts: Counts
    faces: dict[str, str] = field(default_factory=dict)


def mapped(blocks: Sequence[Brick], kind: Kind, degree: int) -> Cells:
    """The mesh of a body that consists of ``blocks``. Nodes at the same position are merged; all cells have a positive Jacobian."""
    grids = [tuple(degree * count + 1 for count in block.counts) for block in blocks]
    units = [np.indices(grid).reshape(3, -1).T / np.subtract(grid, 1) for grid in grids]
    points, name = _merged(np.concatenate([block.place(unit) for block, unit in zip(blocks, units, strict=True)]))
    cells, start = [], 0
    facets: dict[str, list[Ints]] = {}
    for block, grid in zip(blocks, grids, strict=True):
        lattice = _lattice(block.counts, kind, degree)
        cells.append(name[start + np.ravel_multi_index(tuple(np.moveaxis(lattice, -1, 0)), grid)])
        start += int(np.prod(grid))
        for face, region in block.faces.items():
            facets.setdefault(region, []).append(_facets(cells[-1], lattice, grid, face, kind))
    upright = _upright(points, np.concatenate(cells), kind, degree)
    return Cells(points, upright, kind, degree, {region: np.concatenate(parts) for region, parts in facets.items()})


def _lattice(counts: Counts, kind: Kind, degree: int) -> Ints:
    """The lattice indices (m, k, 3) of the nodes of each cell. Tetrahedra are the six Kuhn tetrahedra of each cube."""
    nodes = reference_nodes(kind, degree)
    if kind == "hexahedron":
        patterns = [nodes]
    else:
        paths = [np.cumsum(np.eye(3)[list(order)], axis=0) for order in permutations(range(3))]
        patterns = [nodes @ path for path in paths]
    corners = degree * np.indices(counts).reshape(3, -1).T
    pattern = np.rint(degree * np.stack(patterns)).astype(np.int64)
    return np.asarray((corners[:, None, None] + pattern).reshape(-1, len(nodes), 3))


def _merged(points: Floats) -> tuple[Floats, Ints]:
    """The distinct points (n, 3) among ``points``, and the index of each of ``points`` among the distinct points."""
    tolerance = _SAME * float(np.ptp(points, axis=0).max())
    first, second = cKDTree(points).query_pairs(tolerance, output_type="ndarray").T
    name = connected_parts(first, second, len(points))
    return points[np.unique(name, return_index=True)[1]], name


def _facets(cells: Ints, lattice: Ints, grid: tuple[int, ...], face: str, kind: Kind) -> Ints:
    """The corners (f, 3 or 4) of the facets of ``cells`` that lie on a ``face`` of the ``lattice``, which has ``grid`` nodes."""
    axis = "xyz".index(face[0])
    there = lattice[..., axis] == int(face[1]) * (grid[axis] - 1)
    sides = [list(corners) for corners in facet_corners(kind)]
    return np.concatenate([cells[there[:, side].all(axis=1)][:, side] for side in sides])


def _upright(points: Floats, cells: Ints, kind: Kind, degree: int) -> Ints:
    """The ``cells``, of which those with negative volume are mirrored: the first two axes of their reference cell are exchanged."""
    corners = points[cells[:, [0, 1, 2, 3 if kind == "tetrahedron" else 4]]]
    wrong = np.linalg.det(corners[:, 1:] - corners[:, :1]) < 0
    nodes = reference_nodes(kind, degree)
    mirrored = (nodes[:, None] == nodes[:, [1, 0, 2]]).all(axis=2).argmax(axis=0)
    return np.where(wrong[:, None], cells[:, mirrored], cells)


_SIX = {face: face for face in ("x0", "x1", "y0", "y1", "z0", "z1")}


def box(counts: Counts, size: tuple[float, float, float], kind: Kind, degree: int = 1) -> Cells:
    """A box with a corner at the origin, faces x0, x1, y0, y1, z0, z1, and edges of lengths ``size`` [mm] along x, y, z.

    ``counts``: the numbers of cells along x, y, z; with tetrahedra, each of these cells is cut into six. ``kind``:
    ``"tetrahedron"`` or ``"hexahedron"``. ``degree``: 1 for straight cells, 2 for cells with nodes on their edges too.
    """
    check_box(counts, size, kind, degree)
    return mapped([Brick(lambda unit: unit * size, counts, _SIX)], kind, degree)


def joined(pieces: Mapping[str, Cells]) -> Cells:
    """The mesh of separate ``pieces`` of one kind and degree. Names of regions begin with the name of the piece: ``left_x1``."""
    meshes, kinds = pieces.values(), {(piece.kind, piece.degree) for piece in pieces.values()}
    if len(kinds) != 1:
        raise InputError("pieces", f"{len(kinds)} kinds and degrees of cells", "one")
    starts = dict(zip(pieces, np.cumsum([0, *(len(mesh.points) for mesh in meshes)]), strict=False))
    named = {f"{name}_{on}": starts[name] + f for name, mesh in pieces.items() for on, f in mesh.facets.items()}
    if len(named) < sum(len(mesh.facets) for mesh in meshes):
        raise InputError("pieces", f"two regions with one name among {', '.join(named)}", "different names once joined")
    cells = np.concatenate([starts[name] + mesh.cells for name, mesh in pieces.items()])
    return Cells(np.concatenate([mesh.points for mesh in meshes]), cells, *kinds.pop(), named)


def warped_box(
    counts: Counts, size: tuple[float, float, float], kind: Kind, degree: int = 1, bump: float = 0.1
) -> Cells:
    """A :func:`box` whose inner nodes are moved by up to ``bump`` times its size. Its faces do not move.

    If ``bump`` is 0.15 or more, cells may be inverted; if there is only one cell along an axis, curved tetrahedra are the first.
    """

    def place(unit: Floats) -> Floats:
        height = bump * np.sin(np.pi * unit).prod(axis=1)
        return np.asarray((unit + height[:, None] * [1.0, -0.7, 0.5]) * size)

    return mapped([Brick(place, counts, _SIX)], kind, degree)


def tube_quarter(inner: float, outer: float, length: float, counts: Counts, kind: Kind, degree: int) -> Cells:
    """The quarter x, y >= 0 of a tube along z, with the radii ``inner`` and ``outer`` and a ``length`` [mm].

    ``counts``: the numbers of cells through the wall, around the quarter and along the tube. Faces: inner, outer, x0, y0, bottom,
    top.
    """

    def place(unit: Floats) -> Floats:
        radius, angle = inner + (outer - inner) * unit[:, 0], np.pi / 2 * unit[:, 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), length * unit[:, 2]], axis=1)

    faces = {"x0": "inner", "x1": "outer", "y0": "y0", "y1": "x0", "z0": "bottom", "z1": "top"}
    return mapped([Brick(place, counts, faces)], kind, degree)


def sphere_octant(inner: float, outer: float, n: int, layers: int, kind: Kind, degree: int) -> Cells:
    """The octant x, y, z >= 0 of a hollow sphere with the radii ``inner`` and ``outer`` [mm].

    It has three patches of ``n`` by ``n`` cells, with ``layers`` of cells through the wall. The patches are equiangular: their
    lines are great circles at equal angles. Faces: inner, outer, x0, y0, z0.
    """

    def wall(_: Floats, direction: Floats, depth: Floats) -> Floats:
        return direction * (inner + (outer - inner) * depth)

    return mapped(_patches(wall, (n, n, layers), {"z0": "inner", "z1": "outer"}), kind, degree)


def _patches(place: Callable[[Floats, Floats, Floats], Floats], counts: Counts, ends: dict[str, str]) -> list[Brick]:
    """Three blocks of an octant around its corner. ``place``: a function that returns points (n, 3) [mm]. Its arguments are points
    (n, 3) on the outer faces of the unit cube; unit vectors (n, 3) at even angles along an edge; and the fraction (n, 1) of the
    path outward. ``ends``: the regions on the faces z0 and z1.
    """

    def patch(axis: int) -> Brick:
        one, other = (other for other in range(3) if other != axis)

        def at(unit: Floats) -> Floats:
            face, direction = np.ones_like(unit), np.ones_like(unit)
            face[:, [one, other]] = unit[:, :2]
            direction[:, [one, other]] = np.tan(np.pi / 4 * unit[:, :2])
            return place(face, direction / np.linalg.norm(direction, axis=1)[:, None], unit[:, 2:])

        return Brick(at, counts, {"x0": f"{'xyz'[one]}0", "y0": f"{'xyz'[other]}0"} | ends)

    return [patch(axis) for axis in range(3)]


def _square(flat: Floats, half: float) -> Floats:
    """Points (n, 2) of the rounded square of half side ``half`` in the unit disc, for coordinates ``flat`` (n, 2) in [-1, 1]."""
    return np.asarray(half * flat * (1 + _BULGE * (1 - flat[:, ::-1] ** 2)))


def _fan(unit: Floats, half: float, low: float, side: tuple[int, int]) -> Floats:
    """Points (n, 2) between a side of the square and the circle; in ``unit``, x is outward and y is along the side.

    ``half``: half the side of the square; ``low``: the lower end of y; ``side``: the (axis, sign) of the normal of the side.
    """
    axis, sign = side
    along = low + (1 - low) * unit[:, 1]
    square = _square(np.stack([np.ones_like(along), along], axis=1), half)
    circle = np.stack([np.cos(np.pi / 4 * along), np.sin(np.pi / 4 * along)], axis=1)
    points = square + unit[:, :1] * (circle - square)
    return points * [sign, 1] if axis == 0 else points[:, ::-1] * [1, sign]


def _disc(place: Map, half: float, counts: Counts, faces: dict[str, str], *, quarter: bool) -> list[Brick]:
    """Blocks of a body over the unit disc, or over its quarter x, y >= 0. ``place`` maps (x, y, third in [0, 1]) to points [mm].

    A square of half side ``half`` is in the middle. ``counts``: the numbers of cells along half the side of the square, from the
    square to the circle, and along the third coordinate. ``faces``: the regions on x1, the rim, and on z0 and z1, the ends.
    """
    side, rings, layers = counts
    low, along = (0.0, side) if quarter else (-1.0, 2 * side)
    ends = {face: faces[face] for face in ("z0", "z1")}
    cuts = ({"x0": "x0", "y0": "y0"}, {"y0": "y0"}, {"y0": "x0"}) if quarter else ({}, {}, {})

    def middle(unit: Floats) -> Floats:
        return place(np.column_stack([_square(low + (1 - low) * unit[:, :2], half), unit[:, 2]]))

    def fan(axis: int, sign: int) -> Brick:
        def outside(unit: Floats) -> Floats:
            return place(np.column_stack([_fan(unit, half, low, (axis, sign)), unit[:, 2]]))

        return Brick(outside, (rings, along, layers), faces | cuts[1 + axis])

    fans = [fan(axis, sign) for axis in range(2) for sign in ((1,) if quarter else (1, -1))]
    return [Brick(middle, (along, along, layers), ends | cuts[0]), *fans]


def cylinder(radius: float, length: float, rings: int, slices: int, kind: Kind, degree: int) -> Cells:
    """A solid cylinder with a ``radius`` and a ``length`` [mm] along z, beginning at the origin.

    In each of the ``slices``, ``rings`` of cells surround a rounded square with 2 ``rings`` cells along each side. Faces: bottom,
    top, side.
    """
    faces = {"z0": "bottom", "z1": "top", "x1": "side"}
    blocks = _disc(
        lambda disc: disc * [radius, radius, length], _SQUARE_IN_CYLINDER, (rings, rings, slices), faces, quarter=False
    )
    return mapped(blocks, kind, degree)


def _in_ventricle(disc: Floats) -> Floats:
    """Points (n, 3) [mm] of the ventricle's wall. ``disc``: x and y in the unit disc, whose rim is the base, and relative depth."""
    depth = _WALL * disc[:, 2]
    short, long = _SHORT + depth, _LONG + depth
    radius = np.hypot(disc[:, 0], disc[:, 1])
    share = radius + _APEX * np.sin(np.pi * radius) / np.pi
    angle = share * np.arccos(-_BASE / long)
    reach = short * np.sin(angle) / np.where(radius > 0, radius, 1.0)
    return np.stack([reach * disc[:, 0], reach * disc[:, 1], -long * np.cos(angle)], axis=1)


_VENTRICLE = {"z0": "endo", "z1": "epi", "x1": "base"}


def ventricle(counts: Counts, kind: Kind, degree: int) -> Cells:
    """The truncated ellipsoid of Land et al. 2015 along z. Its apex is at z = -17 inside and -20 outside; it is cut at z = 5 [mm].

    ``counts``: the numbers of cells around an eighth of a turn, from the square at the apex to the base, and through the wall. The
    cells have similar sizes for (2 n, 7 n, 2 n). Faces: endo, epi, base.
    """
    return mapped(_disc(_in_ventricle, _SQUARE_IN_VENTRICLE, counts, _VENTRICLE, quarter=False), kind, degree)


def ventricle_quarter(counts: Counts, kind: Kind, degree: int) -> Cells:
    """The quarter x, y >= 0 of :func:`ventricle`, with the additional faces x0 and y0."""
    return mapped(_disc(_in_ventricle, _SQUARE_IN_VENTRICLE, counts, _VENTRICLE, quarter=True), kind, degree)


def ball_octant(core: float, outer: float, n: int, layers: int, kind: Kind, degree: int) -> Cells:
    """The octant x, y, z >= 0 of a solid sphere with the radius ``outer`` [mm].

    At its centre it has a cube with sides of length ``core`` [mm] and ``n`` cells along each side. Around the cube there are
    ``layers`` of cells that grow by a constant factor from the cube to the sphere. Faces: outer, x0, y0, z0.
    """
    size, far = core / n, outer - core
    growth = scipy.optimize.brentq(lambda q: size * (q**layers - 1) / (q - 1) - far, 1 + 1e-9, 1 + far / size)

    def shell(face: Floats, direction: Floats, depth: Floats) -> Floats:
        share = (growth ** (layers * depth) - 1) / (growth**layers - 1)
        return np.asarray(core * face + share * (outer * direction - core * face))

    middle = Brick(lambda unit: core * unit, (n, n, n), {face: face for face in ("x0", "y0", "z0")})
    return mapped([middle, *_patches(shell, (n, n, layers), {"z1": "outer"})], kind, degree)
