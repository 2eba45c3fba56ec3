"""Structured bodies: their cells fit, are upright and have the closed forms' volumes and areas."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import quad

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems import shapes
from fem_reference.problems.body import Cells, Kind, reference_nodes

KINDS: tuple[Kind, ...] = ("tetrahedron", "hexahedron")
SHAPES: dict[str, Callable[[Kind, int], Cells]] = {
    "box": lambda kind, degree: shapes.box((3, 2, 1), (3.0, 4.0, 5.0), kind, degree),
    "warped_box": lambda kind, degree: shapes.warped_box((3, 4, 3), (3.0, 4.0, 5.0), kind, degree),
    "tube_quarter": lambda kind, degree: shapes.tube_quarter(5.0, 10.0, 8.0, (2, 3, 2), kind, degree),
    "sphere_octant": lambda kind, degree: shapes.sphere_octant(5.0, 10.0, 2, 2, kind, degree),
    "ball_octant": lambda kind, degree: shapes.ball_octant(1.0, 10.0, 2, 4, kind, degree),
    "cylinder": lambda kind, degree: shapes.cylinder(10.0, 20.0, 1, 2, kind, degree),
    "ventricle": lambda kind, degree: shapes.ventricle((1, 3, 1), kind, degree),
    "ventricle_quarter": lambda kind, degree: shapes.ventricle_quarter((1, 3, 1), kind, degree),
}
EVERY = pytest.mark.parametrize(("name", "kind", "degree"), list(product(SHAPES, KINDS, (1, 2))))


def monomials(kind: Kind, degree: int) -> list[tuple[int, int, int]]:
    powers = product(range(degree + 1), repeat=3)
    return [power for power in powers if kind == "hexahedron" or sum(power) <= degree]


def slopes(kind: Kind, degree: int, at: Floats) -> Floats:
    """The slopes of the shape functions at points (q, 3) of the reference cell, (q, k, 3): Lagrange by Vandermonde."""
    powers = np.array(monomials(kind, degree))
    nodal = np.linalg.inv((reference_nodes(kind, degree)[:, None] ** powers).prod(axis=2))
    steps = [np.eye(3, dtype=int)[axis] for axis in range(3)]
    slope = [powers[:, a] * (at[:, None] ** np.maximum(powers - step, 0)).prod(axis=2) for a, step in enumerate(steps)]
    return np.einsum("aqp,pk->qka", slope, nodal)


def jacobians(body: Cells, at: Floats) -> Floats:
    """The Jacobian (m, q, 3, 3) of each cell at points (q, 3) of the reference cell."""
    return np.einsum("mki,qka->mqia", body.points[body.cells], slopes(body.kind, body.degree, at), optimize=True)


def gauss(kind: Kind) -> tuple[Floats, Floats]:
    """Points (q, 3) and weights (q,), exact up to degree 5 along each axis; of the tetrahedron by collapsing the cube."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    x = np.array(list(product((nodes + 1) / 2, repeat=3)))
    w = np.array(list(product(weights / 2, repeat=3))).prod(axis=1)
    if kind == "hexahedron":
        return x, w
    a, b, c = x.T
    return np.stack([a, b * (1 - a), c * (1 - a) * (1 - b)], axis=1), w * (1 - a) ** 2 * (1 - b)


def volume(body: Cells) -> float:
    at, weights = gauss(body.kind)
    return float((np.linalg.det(jacobians(body, at)) @ weights).sum())


def sides(body: Cells) -> list[Ints]:
    """Of each facet of the reference cell which nodes of the cell are on it."""
    nodes = reference_nodes(body.kind, body.degree)
    normals = [*np.eye(3), np.ones(3)] if body.kind == "tetrahedron" else list(np.eye(3))
    ends = [0, 0, 0, 1] if body.kind == "tetrahedron" else [0, 0, 0, 1, 1, 1]
    return [np.flatnonzero(np.isclose(nodes @ normals[i % len(normals)], end)) for i, end in enumerate(ends)]


def corner_count(body: Cells) -> int:
    return 3 if body.kind == "tetrahedron" else 4


def alone(body: Cells) -> Ints:
    """The facets, by their sorted corners, that belong to one cell only; all others belong to two that share all their nodes."""
    facets = np.concatenate([np.sort(body.cells[:, side]) for side in sides(body)])
    corners = np.concatenate([np.sort(body.cells[:, side[: corner_count(body)]]) for side in sides(body)])
    _, count = np.unique(facets, axis=0, return_counts=True)
    unique, first, again = np.unique(corners, axis=0, return_index=True, return_counts=True)
    assert len(unique) == len(count)
    assert set(count) <= {1, 2}
    return corners[first[again == 1]]


def area(body: Cells, region: str) -> float:
    """The area of a region: of each of its facets by the tangents of its cell's map."""
    wanted = {tuple(facet) for facet in np.sort(body.facets[region])}
    nodes, weights = np.polynomial.legendre.leggauss(8)
    x = np.array(list(product((nodes + 1) / 2, repeat=2)))
    w = np.array(list(product(weights / 2, repeat=2))).prod(axis=1)
    if body.kind == "tetrahedron":
        x, w = np.stack([x[:, 0], x[:, 1] * (1 - x[:, 0])], axis=1), w * (1 - x[:, 0])
    total = 0.0
    for side in sides(body):
        corners = side[: corner_count(body)]
        there = np.array([tuple(facet) in wanted for facet in np.sort(body.cells[:, corners])])
        origin, *ends = reference_nodes(body.kind, 1)[corners]
        tangents = np.stack(ends[:2]) - origin
        moved = np.einsum("mqia,ta->mqti", jacobians(body, origin + x @ tangents)[there], tangents)
        total += float((np.linalg.norm(np.cross(moved[:, :, 0], moved[:, :, 1]), axis=2) @ w).sum())
    return total


@EVERY
def test_cells_fit_and_the_named_regions_are_the_whole_surface_once(name: str, kind: Kind, degree: int) -> None:
    body = SHAPES[name](kind, degree)
    assert body.cells.shape[1] == len(reference_nodes(kind, degree))
    assert_array_equal(np.unique(body.cells), np.arange(len(body.points)))
    named = np.sort(np.concatenate(list(body.facets.values())))
    assert_array_equal(np.unique(named, axis=0), np.unique(alone(body), axis=0))
    assert len(named) == len(np.unique(named, axis=0))


@EVERY
def test_jacobians_are_positive_everywhere(name: str, kind: Kind, degree: int) -> None:
    body = SHAPES[name](kind, degree)
    ticks = np.array(list(product(np.linspace(0, 1, 5), repeat=3)))
    at = ticks if kind == "hexahedron" else ticks[ticks.sum(axis=1) <= 1]
    assert np.linalg.det(jacobians(body, at)).min() > 0


@EVERY
def test_the_surface_is_that_of_a_ball(name: str, kind: Kind, degree: int) -> None:
    body = SHAPES[name](kind, degree)
    corners = np.concatenate(list(body.facets.values()))
    edges = corners[:, [0, 1, 1, 2, 2, 0] if kind == "tetrahedron" else [0, 1, 1, 3, 3, 2, 2, 0]].reshape(-1, 2)
    different, count = np.unique(np.sort(edges), axis=0, return_counts=True)
    assert set(count) == {2}
    # Euler's number.
    assert len(np.unique(corners)) - len(different) + len(corners) == 2


@pytest.mark.parametrize(("kind", "degree"), list(product(KINDS, (1, 2))))
def test_nodes_of_a_box_are_in_the_order_of_the_reference_cell(kind: Kind, degree: int) -> None:
    body = shapes.box((2, 3, 1), (4.0, 9.0, 5.0), kind, degree)
    corners = body.points[body.cells[:, [0, 1, 2, 3 if kind == "tetrahedron" else 4]]]
    edges = corners[:, 1:] - corners[:, :1]
    # 1e-12: lattice positions are exact up to the last digit of numbers below 10.
    assert_allclose(body.points[body.cells], corners[:, :1] + reference_nodes(kind, degree) @ edges, atol=1e-12)
    assert_allclose(np.abs(np.linalg.det(edges)), 2 * 3 * 5, rtol=1e-12)


@pytest.mark.parametrize(("kind", "degree"), list(product(KINDS, (1, 2))))
def test_a_box_has_its_volume_and_faces(kind: Kind, degree: int) -> None:
    box, warped = SHAPES["box"](kind, degree), SHAPES["warped_box"](kind, degree)
    # 1e-12: sums of a few hundred products with 16 digits.
    for body in (box, warped):
        assert_allclose(volume(body), 60, rtol=1e-12)
        for face, expected in {"x0": 20, "x1": 20, "y0": 15, "y1": 15, "z0": 12, "z1": 12}.items():
            assert_allclose(area(body, face), expected, rtol=1e-12)
            axis, end = "xyz".index(face[0]), int(face[1]) * np.array([3.0, 4.0, 5.0])["xyz".index(face[0])]
            assert_allclose(body.points[body.facets[face]][..., axis], end, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_warped_box_moves_its_inner_nodes_and_nothing_else(kind: Kind) -> None:
    straight, warped = (make((3, 4, 3), (3.0, 4.0, 5.0), kind, 2) for make in (shapes.box, shapes.warped_box))
    moved = np.linalg.norm(warped.points - straight.points, axis=1)
    ends = straight.points / [3.0, 4.0, 5.0]
    surface = np.isclose(ends * (1 - ends), 0).any(axis=1)
    # The sine of pi is 1e-16, not 0.
    assert moved[surface].max() < 1e-14
    # The least moved of the inner nodes is a corner of the 6 by 8 by 6 lattice: sin(pi/6)^2 sin(pi/8) of the largest move.
    least = 0.1 * np.sin(np.pi / 6) ** 2 * np.sin(np.pi / 8) * np.linalg.norm(np.array([1, -0.7, 0.5]) * [3, 4, 5])
    assert_allclose(moved[~surface].min(), least)


def cylinder(kind: Kind, degree: int) -> Callable[[int], Cells]:
    return lambda n: shapes.cylinder(10.0, 20.0, n, 1, kind, degree)


def octant(kind: Kind, degree: int) -> Callable[[int], Cells]:
    return lambda n: shapes.sphere_octant(5.0, 10.0, n, n, kind, degree)


def tube(kind: Kind, degree: int) -> Callable[[int], Cells]:
    return lambda n: shapes.tube_quarter(5.0, 10.0, 8.0, (1, n, 1), kind, degree)


def heart(kind: Kind, degree: int) -> Callable[[int], Cells]:
    return lambda n: shapes.ventricle_quarter((n, 3 * n, n), kind, degree)


def cap(short: float, long: float) -> float:
    """The volume [mm3] of an ellipsoid of revolution below z = 5, by discs."""
    return float(quad(lambda z: np.pi * short**2 * (1 - (z / long) ** 2), -long, 5.0)[0])


def skin(short: float, long: float) -> float:
    """The area [mm2] of its curved part: circles times arc length."""

    def ring(u: float) -> float:
        return 2 * np.pi * short * np.sin(u) * np.hypot(short * np.cos(u), long * np.sin(u))

    return float(quad(ring, 0, np.arccos(-5.0 / long))[0])


WALL = cap(10.0, 20.0) - cap(7.0, 17.0)
RING = np.pi * (10.0**2 * (1 - (5 / 20) ** 2) - 7.0**2 * (1 - (5 / 17) ** 2))
CURVED = {
    "cylinder": (
        cylinder,
        np.pi * 10**2 * 20,
        {"side": 2 * np.pi * 10 * 20, "bottom": np.pi * 100, "top": np.pi * 100},
    ),
    "octant": (
        octant,
        np.pi / 6 * (10**3 - 5**3),
        {"inner": np.pi / 2 * 25, "outer": np.pi / 2 * 100} | dict.fromkeys(("x0", "y0", "z0"), np.pi / 4 * 75),
    ),
    "tube": (
        tube,
        np.pi / 4 * 75 * 8,
        {"inner": np.pi / 2 * 5 * 8, "outer": np.pi / 2 * 10 * 8, "bottom": np.pi / 4 * 75, "top": np.pi / 4 * 75},
    ),
    "heart": (heart, WALL / 4, {"endo": skin(7.0, 17.0) / 4, "epi": skin(10.0, 20.0) / 4, "base": RING / 4}),
}


@pytest.mark.parametrize(("name", "kind", "degree"), list(product(CURVED, KINDS, (1, 2))))
def test_volumes_and_areas_converge_to_the_closed_forms(name: str, kind: Kind, degree: int) -> None:
    make, truth, areas = CURVED[name]
    ladder = [make(kind, degree)(n) for n in (2, 4)]
    measured = [(volume, truth), *((partial(area, region=region), size) for region, size in areas.items())]
    for measure, size in measured:
        coarse, fine = (abs(measure(body) - size) for body in ladder)
        # A chord leaves its arc by h^2; a parabola by h^3 of alternating sign, so that its integral is off by h^4 (Simpson).
        # 0.1: the next power of h is worth up to 0.06 on these meshes.
        assert_allclose(np.log2(coarse / fine), 2 * degree, atol=0.1)


@pytest.mark.parametrize(("kind", "degree"), list(product(KINDS, (1, 2))))
def test_the_cuts_through_the_axis_of_a_tube_are_rectangles(kind: Kind, degree: int) -> None:
    body = SHAPES["tube_quarter"](kind, degree)
    # 1e-12: sums of a few hundred products with 16 digits.
    assert_allclose([area(body, "x0"), area(body, "y0")], 5 * 8, rtol=1e-12)
    assert_allclose(body.points[body.facets["x0"]][..., 0], 0, atol=1e-12)
    assert_allclose(body.points[body.facets["y0"]][..., 1], 0, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_a_ventricle_lies_where_land_et_al_put_it(kind: Kind) -> None:
    body, quarter = SHAPES["ventricle"](kind, 2), SHAPES["ventricle_quarter"](kind, 2)
    inside, outside, base = (body.points[body.facets[region]] for region in ("endo", "epi", "base"))
    # 1e-12: a few operations on numbers below 20.
    for points, short, long in ((inside, 7.0, 17.0), (outside, 10.0, 20.0)):
        assert_allclose(((points / [short, short, long]) ** 2).sum(axis=-1), 1, rtol=1e-12)
        assert_allclose(points[..., 2].min(), -long, rtol=1e-12)
    assert_allclose(base[..., 2], 5, rtol=1e-12)
    # 1e-3: of tetrahedra the quarters are cut along other diagonals.
    assert_allclose(volume(body), 4 * volume(quarter), rtol=1e-12 if kind == "hexahedron" else 1e-3)
    for axis, face in enumerate(("x0", "y0")):
        assert_allclose(quarter.points[quarter.facets[face]][..., axis], 0, atol=1e-12)
    assert quarter.points[:, :2].min() > -1e-12


def test_cells_of_a_ventricle_are_alike_in_size() -> None:
    body = shapes.ventricle_quarter((2, 7, 2), "hexahedron", 2)
    at, weights = gauss(body.kind)
    sizes = np.cbrt(np.linalg.det(jacobians(body, at)) @ weights)
    # Measured 1.33; even steps in the angle from the apex give 1.66.
    assert sizes.max() / sizes.min() < 1.5


def test_a_wrongly_glued_body_of_tetrahedra_would_show() -> None:
    halves = [
        shapes.Brick(lambda unit: unit, (1, 1, 1)),
        shapes.Brick(lambda unit: [2, 1, 0] + unit * [-1, -1, 1], (1, 1, 1)),
    ]
    right = [halves[0], shapes.Brick(lambda unit: unit + [1, 0, 0], (1, 1, 1))]
    # Eight corners less four on the common face; its two triangles are inside only where their diagonals agree.
    assert len(alone(shapes.mapped(right, "tetrahedron", 1))) == 20
    assert len(alone(shapes.mapped(halves, "tetrahedron", 1))) == 24


@pytest.mark.parametrize("counts", [(1, 1, 1), (1, 4, 1), (3, 1, 3), (4, 1, 4)])
def test_a_warped_box_of_few_curved_tetrahedra_has_none_turned_over(counts: tuple[int, int, int]) -> None:
    ticks = np.array(list(product(np.linspace(0, 1, 9), repeat=3)))
    body = shapes.warped_box(counts, (1.0, 1.0, 1.0), "tetrahedron", 2)
    assert np.linalg.det(jacobians(body, ticks[ticks.sum(axis=1) <= 1])).min() > 0


@pytest.mark.parametrize("kind", KINDS)
def test_an_octant_of_a_ball_has_its_volume_and_grows_evenly(kind: Kind) -> None:
    # Curved cells of an eighth of a turn are 3e-4 off the sphere; each layer along an axis is as many times the last.
    body = shapes.ball_octant(1.0, 10.0, 2, 5, kind, 2)
    assert volume(body) == pytest.approx(np.pi * 1000 / 6, rel=1e-3)
    assert area(body, "outer") == pytest.approx(np.pi * 100 / 2, rel=1e-3)
    on_axis = np.sort(body.points[(np.abs(body.points[:, :2]) < 1e-9).all(axis=1)][:, 2])[::2]
    layers = np.diff(on_axis[on_axis > 1 - 1e-9])
    assert layers[1:] / layers[:-1] == pytest.approx(layers[1] / layers[0], rel=1e-9)
    assert layers[0] == pytest.approx(0.5, rel=1e-9)


def test_joined_pieces_do_not_share_the_name_of_a_region() -> None:
    """One called a with its b_x0, one called a_b with its x0."""
    one = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "hexahedron")
    other = replace(one, facets={f"b_{name}": facets for name, facets in one.facets.items()})
    with pytest.raises(InputError, match="two regions with one name among a_b_x0"):
        shapes.joined({"a": other, "a_b": one})


def test_joined_pieces_stay_apart_and_keep_their_regions() -> None:
    left, right = (
        shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "hexahedron"),
        shapes.box((2, 1, 1), (1.0, 1.0, 1.0), "hexahedron"),
    )
    both = shapes.joined({"left": left, "right": right})
    assert (len(both.points), len(both.cells), len(both.facets)) == (8 + 12, 3, 12)
    assert not set(both.cells[0]) & set(both.cells[1:].ravel())
    assert both.points[both.cells[1:]].tolist() == right.points[right.cells].tolist()
    assert both.points[both.facets["right_x1"]].tolist() == right.points[right.facets["x1"]].tolist()
    with pytest.raises(InputError, match="pieces: got 2 kinds and degrees of cells, want one"):
        shapes.joined({"left": left, "right": shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")})
