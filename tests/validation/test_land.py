"""The benchmark of Land et al. 2015: identities of its geometry and of the fibres in its wall."""

import numpy as np
import pytest

from validation import land
from validation.land import Floats


@pytest.fixture
def inside() -> tuple[Floats, Floats, Floats]:
    """Angles u, v and depths of 200 points all over the wall."""
    random = np.random.default_rng(3)
    depth = random.uniform(0, 1, 200)
    u = -np.pi + random.uniform(0.02, 1, 200) * (land.base_angle(depth) + np.pi)
    return u, random.uniform(-np.pi, np.pi, 200), depth


def surface_normals(points: Floats, depth: Floats) -> Floats:
    """Gradients of the ellipsoid's equation, by hand."""
    short, long = 7 + 3 * depth, 17 + 3 * depth
    normal = points / np.stack([short, short, long], axis=1) ** 2
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


@pytest.mark.parametrize(("depth", "short", "long"), [(0.0, 7.0, 17.0), (1.0, 10.0, 20.0)])
def test_the_wall_ends_at_two_ellipsoids(depth: float, short: float, long: float) -> None:
    u, v = np.linspace(-np.pi, land.base_angle(np.array(depth)), 30), np.linspace(-np.pi, np.pi, 30)
    x, y, z = land.wall(u, v, np.full(30, depth)).T
    np.testing.assert_allclose((x**2 + y**2) / short**2 + z**2 / long**2, 1, atol=1e-14)
    assert z[0] == pytest.approx(-long, abs=1e-14)
    assert z[-1] == pytest.approx(5, abs=1e-13)
    assert z.max() == z[-1]


def test_depth_is_found_again(inside: tuple[Floats, Floats, Floats]) -> None:
    u, v, depth = inside
    np.testing.assert_allclose(land.depth(land.wall(u, v, depth)), depth, atol=1e-13)


def test_depth_on_the_axis_and_beside_the_wall() -> None:
    """On the axis t = (|z| - 17) / 3; a hundredth of a millimetre inside and outside the wall counts on."""
    points = np.array([[0, 0, -17.0], [0, 0, -18.5], [0, 0, -20.03], [6.99, 0, 0], [0, 10.03, 0]])
    np.testing.assert_allclose(land.depth(points), [0, 0.5, 1.01, -0.01 / 3, 1.01], atol=1e-13)


def test_fibres_are_unit_and_lie_in_surfaces_of_one_depth(inside: tuple[Floats, Floats, Floats]) -> None:
    points = land.wall(*inside)
    found = land.fibre(points)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose((found * surface_normals(points, inside[2])).sum(axis=1), 0, atol=1e-13)


def test_fibres_follow_the_derivatives_of_the_wall(inside: tuple[Floats, Floats, Floats]) -> None:
    """The formula of the paper with derivatives by central differences of step 1e-6, whose error is some 1e-9."""
    u, v, depth = inside
    along = land.wall(u + 1e-6, v, depth) - land.wall(u - 1e-6, v, depth)
    around = land.wall(u, v + 1e-6, depth) - land.wall(u, v - 1e-6, depth)
    along, around = (line / np.linalg.norm(line, axis=1, keepdims=True) for line in (along, around))
    angle = np.radians(90 - 180 * depth)[:, None]
    np.testing.assert_allclose(
        land.fibre(land.wall(u, v, depth)), np.sin(angle) * along + np.cos(angle) * around, atol=1e-7
    )


@pytest.mark.parametrize(("depth", "up"), [(0.0, 1.0), (0.25, 0.5**0.5), (0.5, 0.0), (0.75, -(0.5**0.5)), (1.0, -1.0)])
def test_angle_through_the_wall(depth: float, up: float) -> None:
    """Where the wall is vertical (z = 0) the fibre is (0, cos a, sin a) at y = 0: up inside, along +y halfway, down outside."""
    found = land.fibre(np.array([[7 + 3 * depth, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [[0, np.sqrt(1 - up**2), up]], atol=1e-14)


def test_fibres_turn_with_the_body(inside: tuple[Floats, Floats, Floats]) -> None:
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    points = land.wall(*inside)
    np.testing.assert_allclose(land.fibre(points @ turn.T), land.fibre(points) @ turn.T, atol=1e-13)


def test_fibres_on_the_axis_are_unit() -> None:
    found = land.fibre(np.array([[0, 0, -17.0], [0, 0, -18.5], [0, 0, -20.0]]))
    np.testing.assert_allclose(found, [[1, 0, 0], [0, 1, 0], [-1, 0, 0]], atol=1e-14)


def test_volume_of_the_wall() -> None:
    """Of ellipsoids below z = 5: ``pi s^2 (z - z^3 / 3 l^2)`` from -l to 5, against the wall cut up in the parametrisation."""
    outer, inner = (np.pi * s**2 * (5 - 125 / 3 / long**2 + 2 * long / 3) for s, long in ((10, 20), (7, 17)))
    points, weights = np.polynomial.legendre.leggauss(20)
    t, share = (points + 1) / 2, weights / 2
    total = 0.0
    for depth, part in zip(t, share, strict=True):
        length = land.base_angle(np.array(depth)) + np.pi
        u = -np.pi + t * length
        short, long = land.axes(np.array(depth))
        # At fixed u the wall moves by 3 (sin u, cos u) per depth: the volume of a ring, 2 pi r |x_u x x_t|.
        area = 3 * np.abs(short * np.cos(u) ** 2 + long * np.sin(u) ** 2)
        total += part * length * (share * 2 * np.pi * short * np.abs(np.sin(u)) * area).sum()
        # The ends u of the surfaces follow the base, so that nothing of the wall is missed or counted twice.
    assert total == pytest.approx(outer - inner, rel=1e-12)


def test_published_results_stand_in_their_order() -> None:
    """The pressure moves the apex down and thins the wall; the active tension pulls it up and thickens it, as in the paper."""
    for apices, sign in ((land.PASSIVE_APICES, -1), (land.ACTIVE_APICES, 1)):
        inner, outer = apices
        assert inner > outer
        assert np.sign(inner + 17) == np.sign(outer + 20) == sign
    assert land.PASSIVE_APICES[0] - land.PASSIVE_APICES[1] < 3
    assert land.ACTIVE_APICES[0] - land.ACTIVE_APICES[1] > 3
