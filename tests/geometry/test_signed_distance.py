"""The distance grid: against spheres and boxes of closed form, its own stated error, its smoothness, its store."""

import logging
import pickle
from pathlib import Path

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.interpolate import NdBSpline

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry import signed_distance
from fem_reference.geometry.rigid_bodies import Box, Sphere
from fem_reference.geometry.signed_distance import FAR, Grid, build, cached, resolve, signed_distances
from fem_reference.io import files

RADIUS = 10.0  # [mm]
BALL = shapes.sphere(4, RADIUS)  # 5120 triangles, up to 0.0115 mm below the sphere
SHIFT = np.array([146.0, 238.0, -431.0])  # [mm], where hips are
CUBE = shapes.skin(shapes.box((2, 2, 2), (20.0, 20.0, 20.0)))


@pytest.fixture(scope="module")
def ball() -> Grid:
    return build(BALL, 1.0, 4.0)


def _shell(seed: int, low: float, high: float, count: int = 5000) -> Floats:
    """Random points (n, 3) between two radii about the origin."""
    random = np.random.default_rng(seed)
    direction = random.normal(size=(count, 3))
    return direction / np.linalg.norm(direction, axis=1, keepdims=True) * random.uniform(low, high, (count, 1))


def test_exact_distance_of_a_cube_inside_and_outside() -> None:
    points = np.random.default_rng(1).uniform(-20, 40, (3000, 3))
    expected = Box((10, 10, 10), (20, 20, 20), 0).sample(points).distance
    assert_allclose(signed_distances(points, CUBE), expected, atol=1e-12)  # round-off of lengths near 40
    assert signed_distances(np.zeros((0, 3)), CUBE).shape == (0,)


@pytest.mark.slow
def test_ball_is_as_near_as_the_sphere(ball: Grid) -> None:
    points = _shell(2, 6.0, 14.0)
    found, exact = ball.sample(points), Sphere((0, 0, 0), RADIUS).sample(points)
    # The triangles lie up to 0.0115 mm inside the sphere, their normals turn by up to e / 2 r = 0.04 away from its own; the
    # spline adds less. Facets have no curvature: on the scale of a cell it is that of the sphere within a fifth or so.
    assert_allclose(found.distance, exact.distance, atol=0.013)
    assert_allclose(found.gradient, exact.gradient, atol=0.04)
    means = np.mean(np.trace(found.curvature, axis1=1, axis2=2)), np.mean(np.trace(exact.curvature, axis1=1, axis2=2))
    assert_allclose(*means, rtol=0.02)
    assert_allclose(found.curvature, found.curvature.transpose(0, 2, 1))


@pytest.mark.slow
def test_error_falls_with_the_fourth_power_of_the_spacing_where_distance_is_smooth(monkeypatch) -> None:
    # The nodes get the distance to a perfect sphere: what is left is the spline's own error, of fourth order in theory.
    smooth = Sphere((0, 0, 0), RADIUS)
    monkeypatch.setattr(signed_distance, "signed_distances", lambda points, _: smooth.sample(points).distance)
    points = _shell(3, 8.0, 12.0)
    exact, errors = smooth.sample(points), []
    for spacing in (1.6, 0.8, 0.4):
        parts = zip(build(BALL, spacing, 8.0).sample(points), exact, strict=True)
        errors.append([np.abs(found - wanted).max() for found, wanted in parts])
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    # Distance 4, gradient 3, curvature 2; the coarsest spacing is not small against the radii from 8 mm: a tenth less.
    assert (orders > 0.9 * np.array([4, 3, 2])).all(), orders


@pytest.mark.slow
@pytest.mark.parametrize("surface", [BALL, CUBE], ids=["ball", "cube"])
@pytest.mark.parametrize("spacing", [2.0, 1.0])
def test_stated_error_bounds_an_independent_sample(surface: Surface, spacing: float) -> None:
    grid = build(surface, spacing, 3.0)
    random = np.random.default_rng(4)
    corners = surface.points[surface.triangles[random.integers(len(surface.triangles), size=20_000)]]
    on_surface = np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), len(corners)), corners)
    points = on_surface + _shell(10, 0.0, spacing, len(corners))
    found = np.abs(grid.sample(points).distance - signed_distances(points, surface))
    # Two samples of the same thing: the stated one may fall short of the other by a few percent, and is no idle bound.
    assert 0.3 * grid.error < found.max() < 1.05 * grid.error
    # Means of 20 000 and 30 000 values whose squares scatter by less than ten times their mean: 0.05 at one sigma of both.
    assert_allclose(grid.mean_error, np.sqrt(np.mean(found**2)), rtol=0.1)


@pytest.mark.slow
def test_error_at_sharp_edges_falls_with_the_spacing() -> None:
    # By hand: a spline misses the tip of |x| by up to 0.34 of a spacing; across the edge of a cube the slope jumps by less.
    coarse, fine = (build(CUBE, spacing, 2.0).error for spacing in (2.2, 1.1))
    assert 0.05 * 1.1 < fine < 0.34 * 1.1
    assert 1.4 < coarse / fine < 2.8


def test_gradient_and_curvature_are_the_slopes_of_the_distance(ball: Grid) -> None:
    points, step = _shell(5, 7.0, 13.0, 500), 1e-5
    found = ball.sample(points)
    steps = [(ball.sample(points + step * axis), ball.sample(points - step * axis)) for axis in np.eye(3)]
    slopes = np.stack([(after.distance - before.distance) / (2 * step) for after, before in steps], axis=1)
    bends = np.stack([(after.gradient - before.gradient) / (2 * step) for after, before in steps], axis=2)
    # Round-off of a distance of 5 mm over the step is 1e-10; the third derivative jumps between cells: 1e-5 of about 1 / mm2.
    assert_allclose(slopes, found.gradient, atol=1e-8)
    assert_allclose(bends, found.curvature, atol=1e-5)


def test_the_spline_is_scipys(ball: Grid) -> None:
    points = _shell(7, 7.0, 13.0, 500)
    at, order = (points - ball.origin) / ball.spacing, np.eye(3, dtype=int)
    # Counted in cells, B-spline i has its middle at i and its knots up to two cells away.
    knots = tuple(np.arange(-2.0, count + 2) for count in ball.coefficients.shape)
    spline, found = NdBSpline(knots, ball.coefficients, 3), ball.sample(points)
    slopes = np.stack([spline(at, nu=one) for one in order], axis=1)
    bends = np.stack([np.stack([spline(at, nu=one + other) for one in order], axis=1) for other in order], axis=2)
    # Round-off of sums of 64 terms of up to 15 mm.
    assert_allclose(found.distance, spline(at), atol=1e-13)
    assert_allclose(found.gradient, slopes / ball.spacing, atol=1e-13)
    assert_allclose(found.curvature, bends / ball.spacing**2, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_everything_goes_on_across_the_faces_of_cells(ball: Grid, axis: int) -> None:
    points = _shell(6, 7.0, 13.0, 500)
    nodes = np.round((points[:, axis] - ball.origin[axis]) / ball.spacing)
    points[:, axis] = ball.origin[axis] + nodes * ball.spacing
    beside = 1e-9 * np.eye(3)[axis]
    before, after = ball.sample(points - beside), ball.sample(points + beside)
    # 1e-9 mm apart with slopes of about 1: what is more is a jump.
    for one, other in zip(before, after, strict=True):
        assert_allclose(one, other, atol=1e-8)


@pytest.mark.slow
def test_coarse_far_field_leaves_the_margin_alone(monkeypatch) -> None:
    asked = []

    def counting(points: Floats, surface: Surface) -> Floats:
        asked.append(len(points))
        return signed_distances(points, surface)

    monkeypatch.setattr(signed_distance, "signed_distances", counting)
    saving = build(BALL, 0.5, 1.0)
    spent = sum(asked[:2])
    monkeypatch.setattr(signed_distance, "_STRIDE", 1)
    exact = build(BALL, 0.5, 1.0)
    assert spent < 0.9 * asked[3]
    points = _shell(11, 9.0, 11.0)
    # Trilinear over 2 mm misses a sphere of radius 5 mm by 2^2 / 8 (1 / 5 + 1 / 5) = 0.2 mm; four cells away 0.27^4 is left.
    assert_allclose(saving.sample(points).distance, exact.sample(points).distance, atol=1e-3)
    centre = np.zeros((1, 3))
    assert_allclose(exact.sample(centre).distance, -RADIUS, atol=0.4)
    # No corner of its coarse cell is farther from the centre than the diagonal of that cell.
    assert -RADIUS - 0.1 < saving.sample(centre).distance[0] < -RADIUS + 2 * 3**0.5


def test_sign_and_distance_beyond_the_margin(ball: Grid) -> None:
    # By hand, with the tip of the cone at the centre blunted by half a spacing at most.
    points = np.array([[0.0, 0, 0], [12, 12, 12], [0, 0, -5], [-12, 0, 12]])
    assert_allclose(ball.sample(points).distance, [-10, 12 * 3**0.5 - 10, -5, 12 * 2**0.5 - 10], atol=0.5)


def test_outside_the_grid_all_is_far_and_flat(ball: Grid) -> None:
    found = ball.sample(np.array([[100.0, 0, 0], [0, -16.5, 0], [0, 0, 1e300]]))
    assert (found.distance == FAR).all()
    assert not found.gradient.any()
    assert not found.curvature.any()
    edges = np.array(ball.origin) + ball.spacing * np.array([[1, 1, 1], np.array(ball.coefficients.shape) - 2])
    assert (ball.sample(edges).distance < FAR).all()


def test_distances_alone_are_those_of_samples(ball: Grid) -> None:
    """In the grid, beyond it, and NaN; rounding of 10 mm is 2e-15."""
    points = np.random.default_rng(0).uniform(-30, 30, (3000, 3))
    points[0] = np.nan
    wanted = ball.sample(points).distance
    assert 0 < (wanted == FAR).sum() < len(points) - 1
    assert_allclose(ball.distances(points), wanted, rtol=0, atol=1e-13)
    assert_allclose(Sphere((0, 0, 0), RADIUS).distances(points), Sphere((0, 0, 0), RADIUS).sample(points).distance)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_has_no_distance(ball: Grid, bad: float) -> None:
    assert np.isnan(ball.sample(np.array([[0.0, bad, 0.0]])).distance).all()
    assert len(ball.sample(np.zeros((0, 3))).distance) == 0


def test_nothing_is_deeper_than_half_the_thickness(ball: Grid) -> None:
    inside = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    deepest = -ball.sample(inside).distance.min()
    assert 0 < deepest <= ball.half_thickness < 1.4 * deepest
    assert build(shapes.sphere(3, 1.0), 3.0, 4.0).half_thickness == np.inf


@pytest.mark.slow
def test_place_of_the_body_does_not_matter(ball: Grid) -> None:
    moved = build(BALL.moved_to(BALL.points + SHIFT), 1.0, 4.0)
    points = _shell(7, 7.0, 13.0)
    # Coordinates near 500 have 1e-13 left; curvature divides by nothing smaller than a spacing of 1.
    for one, other in zip(ball.sample(points), moved.sample(points + SHIFT), strict=True):
        assert_allclose(one, other, atol=1e-9)


@pytest.mark.slow
def test_triangles_may_have_any_orientation(ball: Grid) -> None:
    triangles = BALL.triangles.copy()
    triangles[100:200] = triangles[100:200, ::-1]
    assert_allclose(build(Surface(BALL.points, triangles), 1.0, 4.0).coefficients, ball.coefficients, atol=1e-9)
    inside_out = Surface(BALL.points, BALL.triangles[:, ::-1])
    assert_allclose(build(inside_out, 1.0, 4.0).coefficients, ball.coefficients, atol=1e-9)


def test_what_bounds_no_body() -> None:
    with pytest.raises(InputError, match=r"edges that belong to only one triangle, .* want a closed surface"):
        build(Surface(BALL.points, BALL.triangles[1:], "ball"), 1.0, 4.0)
    with pytest.raises(InputError, match="ball: got a triangle with a vertex that does not exist"):
        build(Surface(BALL.points[1:], BALL.triangles, "ball"), 1.0, 4.0)


@pytest.mark.slow
def test_resolve_halves_until_the_error_is_reached() -> None:
    body = shapes.sphere(3, RADIUS)
    first = np.ptp(body.points, axis=0).max() / 24
    enough = build(body, first, 2.0).mean_error / 2
    grid = resolve(body, enough, 2.0)
    assert grid.mean_error <= enough
    assert_allclose(grid.spacing, first / 2)
    assert_allclose(resolve(body, 0.2, 2.0).spacing, first)
    rounded = resolve(body, enough, 2.0, 0.7)  # the limit is for the grid without rounding, which moves the surface
    assert rounded.mean_error > enough
    assert_array_equal(rounded.coefficients, build(body, first / 2, 2.0, 0.7).coefficients)


def test_resolve_stops_at_the_largest_grid_and_says_so(monkeypatch, caplog) -> None:
    monkeypatch.setattr(signed_distance, "MOST_NODES", 200_000)
    with caplog.at_level(logging.WARNING):
        grid = resolve(CUBE, 1e-3, 2.0)
    assert grid.mean_error > 1e-3
    assert "instead of 0.001 mm" in caplog.text
    # One halving more would be more than twice as fine along each axis and eight times as many nodes, less the rim.
    assert 200_000 / 9 < grid.coefficients.size < 1.3 * 200_000


@pytest.fixture
def counted(monkeypatch) -> list[float]:
    """The errors that were asked of ``resolve``, which gives a small grid without work."""
    asked: list[float] = []
    random = np.random.default_rng(8).normal(size=(6, 7, 8))

    def small(_surface: Surface, error: float, margin: float, _rounding: float) -> Grid:
        asked.append(error)
        return Grid(random, (0.1, 1 / 3, -2.0), 1 / 7, margin, error / 3, error / 9)

    monkeypatch.setattr(signed_distance, "resolve", small)
    return asked


def test_store_gives_back_the_same_bits(counted: list[float], tmp_path: Path) -> None:
    first, second = (cached(BALL, 0.1, 2.0, 0.0, tmp_path / "new") for _ in range(2))
    assert counted == [0.1]
    assert first.coefficients.tobytes() == second.coefficients.tobytes()
    assert not second.coefficients.flags.writeable
    for name in ("origin", "spacing", "margin", "error", "mean_error"):
        assert getattr(first, name) == getattr(second, name)
    assert len(list((tmp_path / "new").iterdir())) == 1


def test_store_distinguishes_surfaces_errors_and_margins(counted: list[float], tmp_path: Path) -> None:
    cached(BALL, 0.1, 2.0, 0.0, tmp_path)
    cached(BALL, 0.2, 2.0, 0.0, tmp_path)
    cached(BALL, 0.1, 3.0, 0.0, tmp_path)
    cached(BALL.moved_to(1.001 * BALL.points), 0.1, 2.0, 0.0, tmp_path)
    cached(Surface(BALL.points, np.roll(BALL.triangles, 1, axis=0)), 0.1, 2.0, 0.0, tmp_path)
    assert len(counted) == 5


@pytest.mark.parametrize("damage", ["cut", "empty", "text", "bit"])
def test_damaged_files_are_made_anew(counted: list[float], tmp_path: Path, caplog, damage: str) -> None:
    cached(BALL, 0.1, 2.0, 0.0, tmp_path)
    (path,) = tmp_path.iterdir()
    whole = path.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 4] ^= 1
    path.write_bytes({"cut": whole[:-300], "empty": b"", "text": b"not a grid", "bit": bytes(flipped)}[damage])
    again = cached(BALL, 0.1, 2.0, 0.0, tmp_path)
    assert len(counted) == 2
    assert "damaged and are computed again" in caplog.text
    cached(BALL, 0.1, 2.0, 0.0, tmp_path)
    assert len(counted) == 2
    assert np.isfinite(again.coefficients).all()


def test_grids_travel_between_processes(ball: Grid) -> None:
    points = _shell(9, 8.0, 12.0, 100)
    assert_allclose(pickle.loads(pickle.dumps(ball)).sample(points).distance, ball.sample(points).distance, rtol=0)


@pytest.mark.slow
def test_a_real_bone_at_its_middle_and_beside_it(data: Path) -> None:
    bone = files.read_surface(data / "hip/bones/femur_report.vtk", 1.0)
    grid = build(bone, 4.0, 5.0)
    head = np.array([[143.5, 243.4, -432.7]])  # hip joint centre of landmarks.csv: the middle of the femoral head
    # The head of an adult's femur has a radius of 20 to 28 mm.
    assert -28 < grid.sample(head).distance[0] < -15
    assert np.isfinite(grid.error)
