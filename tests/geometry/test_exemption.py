"""Where contact is not asked: by the distance from what is attached, the same however fine the surface, and on its own side."""

import logging

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, TetMesh
from fem_reference.geometry.exemption import Exemption, free_skin
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import spacing
from fem_reference.problems.contact import check_exempt

SIZE = (10.0, 10.0, 40.0)
REACH = np.linalg.norm(SIZE) / 80  # 0.53 mm
LEVELS = [(2, 2, 3), (4, 4, 6), (8, 8, 12), (3, 5, 16)]


def exemption(surface: Surface, *attached: np.ndarray) -> Exemption:
    return Exemption.of(surface, [(f"bone {i}", attached_shares(surface, one)) for i, one in enumerate(attached)])


def bar(cells: tuple[int, int, int]) -> tuple[Surface, TetMesh, Exemption]:
    """A bar that is attached at both ends."""
    mesh = shapes.box(cells, SIZE)
    surface = shapes.skin(mesh)
    z = surface.points[:, 2]
    return surface, mesh, exemption(surface, np.flatnonzero(z == 0), np.flatnonzero(z == SIZE[2]))


@pytest.mark.parametrize("cells", LEVELS)
def test_a_coarse_surface_is_exempt_where_a_fine_one_is(cells) -> None:
    # Random points of the sides: those within the reach of an end, however high the triangles are that they are in.
    surface, _, exempt = bar(cells)
    assert_allclose(exempt.reach, REACH, rtol=1e-12)
    rng = np.random.default_rng(1)
    triangles = rng.integers(len(surface.triangles), size=5000)
    points = np.einsum("kc,kci->ki", rng.dirichlet(np.ones(3), 5000), surface.points[surface.triangles[triangles]])
    height = np.minimum(points[:, 2], SIZE[2] - points[:, 2])
    away, by = exempt.away(triangles, points)
    assert_allclose(away, height, atol=1e-9)  # rounding of 40 mm
    assert (by == (points[:, 2] > 20)).all()


@pytest.mark.slow
@pytest.mark.parametrize("cells", LEVELS[::3])
def test_its_area_is_that_of_the_rims(cells) -> None:
    # Two strips of 40 mm by the reach, of 1600 mm2. Points of the skin stand for areas of 0.5 mm across, as wide as the strips: two
    # fifths of them may fall on the other side.
    surface, mesh, exempt = bar(cells)
    skin = free_skin(exempt, mesh, spacing(surface))
    strips = 2 * 40 * REACH
    assert_allclose(1600 - skin.areas.sum(), strips, rtol=0.4)
    assert_allclose(exempt.lost * 1600, strips, rtol=0.4)
    assert skin.points[:, 2].min() > REACH
    fine = free_skin(exempt, mesh, spacing(surface) / 4)
    assert_allclose(1600 - fine.areas.sum(), strips, rtol=0.1)


@pytest.mark.slow
def test_on_a_round_body_it_converges_as_the_surface_is_refined() -> None:
    # A cap of a ball is attached up to 60 degrees. With the reach that is a cap up to 60 degrees + reach / radius, but for straight
    # distances beside arcs, by (reach / radius)^2 / 24. Triangles end the attachment half an edge off on average.
    radius, angle = 20.0, np.radians(60)
    errors, edges = [], []
    for level in (2, 3, 4, 5):
        ball = shapes.sphere(level, radius)
        exempt = exemption(ball, np.flatnonzero(ball.points[:, 2] >= radius * np.cos(angle)))
        felt = free_skin(exempt, TetMesh(ball.points[:4], np.array([[0, 1, 2, 3]])), spacing(ball))
        wanted = 2 * np.pi * radius**2 * (1 + np.cos(angle + exempt.reach / radius))
        errors.append(abs(felt.areas.sum() / wanted - 1))
        edges.append(np.linalg.norm(np.subtract(*ball.points[ball.triangles[0, :2]])))
    strip = 2 * np.pi * radius * np.sin(angle) / wanted
    assert (np.array(errors) < strip * np.array(edges) / 2 + (np.array(edges) / radius) ** 2 / 4).all()
    assert errors[3] < errors[1] / 2 < errors[0] / 2
    assert errors[3] < 0.02


def test_the_other_side_of_a_thin_layer_is_not_exempt() -> None:
    # A layer of 0.4 mm attached below, whose reach is 0.71 mm: straight through it is nearer than that.
    layer = shapes.skin(shapes.box((10, 10, 1), (40.0, 40.0, 0.4)))
    exempt = exemption(layer, np.flatnonzero(layer.points[:, 2] == 0))
    top = layer.points[:, 2] == 0.4
    inner = top & (np.abs(layer.points[:, :2] - 20) < 19).all(axis=1)
    assert exempt.reach > 0.7
    assert not exempt.vertices[inner].any()
    assert exempt.vertices[~top].all()
    skin = free_skin(exempt, shapes.box((2, 2, 1), (40.0, 40.0, 0.4)), exempt.reach)
    assert_allclose(skin.areas[skin.points[:, 2] > 0.4 - 1e-9].sum(), 1600, rtol=1e-9)
    assert_allclose(skin.areas.sum(), 1600, rtol=1e-9)  # its sides of 0.4 mm are exempt


def test_vertices_and_corners_agree_with_what_is_attached() -> None:
    surface, _, exempt = bar((4, 4, 6))
    z = surface.points[:, 2]
    assert np.array_equal(exempt.vertices, (z == 0) | (z == SIZE[2]))
    corners = exempt.corners
    places = corners.carried @ surface.points
    assert_allclose(places[corners.vertices], surface.points, rtol=1e-15)
    assert_allclose(places[corners.at], exempt.pieces.of(surface.points[surface.triangles]), atol=1e-12)
    assert len(np.unique(places.round(9), axis=0)) == len(places)
    assert_allclose(corners.away, np.minimum(places[:, 2], 40 - places[:, 2]), atol=1e-3)
    assert (corners.away[np.isin(places[:, 2], (0, 40))] == 0).all()


@pytest.mark.slow
def test_places_where_it_is_felt_are_between_vertices_too() -> None:
    surface, _, exempt = bar((1, 1, 1))  # all vertices are attached
    assert exempt.vertices.all()
    places = exempt.places(500) @ surface.points
    assert 500 <= len(places) < 1000
    assert places[:, 2].min() > REACH
    assert np.ptp(places[:, 2]) > 35


def test_nothing_attached_and_nothing_but(caplog) -> None:
    surface, mesh, _ = bar((2, 2, 3))
    assert Exemption.of(surface).lost == 0
    assert_allclose(free_skin(Exemption.of(surface), mesh, 1.0).areas.sum(), 1800, rtol=1e-12)
    whole = exemption(surface, np.arange(len(surface.points)))
    assert whole.lost == 1
    assert len(free_skin(whole, mesh, 1.0).points) == 0
    with pytest.raises(
        InputError, match=r"case\.toml: attachment: got 100 % of the unattached surface without contact"
    ):
        check_exempt(whole, "case.toml: attachment")
    assert not caplog.text


def test_much_that_is_exempt_is_warned_of(caplog) -> None:
    # All but a belt of 3 mm, less a sixteenth at either rim: 0.53 mm there are two fifths of that, and all of one of 1.2 mm.
    caplog.set_level(logging.WARNING)
    for belt, refused in ((3.0, False), (1.2, True)):
        rims = 20 - belt / 2, 20 + belt / 2
        heights = np.concatenate([np.linspace(0, rims[0], 8), np.linspace(*rims, 9)[1:-1], np.linspace(rims[1], 40, 8)])
        mesh = shapes.box((4, 4, len(heights) - 1), SIZE)
        surface = shapes.skin(mesh)
        points = np.array(surface.points)
        points[:, 2] = heights[np.rint(points[:, 2] / 40 * (len(heights) - 1)).astype(int)]
        attached = (points[:, 2] <= rims[0]) | (points[:, 2] >= rims[1])
        exempt = exemption(surface.moved_to(points), np.flatnonzero(attached))
        if refused:
            with pytest.raises(InputError, match="at most 50 %"):
                check_exempt(exempt, "attachment")
        else:
            check_exempt(exempt, "attachment")
            assert "of the unattached surface without contact (within " in caplog.text
