"""Surfaces and tetrahedra: closed forms of areas, volumes and qualities, and each reason why a surface is not usable."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import (
    TET_FACES,
    Polylines,
    Surface,
    TetMesh,
    boundary,
    check_closed,
    check_finite,
    enclosed_volume,
    fingerprint,
    found_in,
    tet_qualities,
    tet_volumes,
    triangle_areas,
    upright,
    vertex_areas,
)

HIP = np.array([146.0, 238.0, -431.0])  # [mm]
CORNER = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
REGULAR = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
ONE = np.array([[0, 1, 2, 3]])
TURN = Rotation.random(rng=np.random.default_rng(6))


def test_volume_and_area_of_the_unit_corner() -> None:
    assert_allclose(tet_volumes(CORNER, ONE), [1 / 6])
    assert_allclose(tet_volumes(CORNER, ONE[:, [1, 0, 2, 3]]), [-1 / 6])
    both = np.concatenate([ONE, ONE[:, [1, 0, 2, 3]]])
    assert_allclose(tet_volumes(CORNER, upright(CORNER, both)), 1 / 6)
    assert_array_equal(upright(CORNER, both)[0], ONE[0])
    assert_allclose(np.sort(triangle_areas(CORNER, TET_FACES)), [0.5, 0.5, 0.5, np.sqrt(3) / 2])


def test_the_faces_of_a_tet_point_outward() -> None:
    assert_allclose(enclosed_volume(CORNER, TET_FACES), 1 / 6)
    triangles, tets = boundary(ONE)
    assert_array_equal(np.sort(triangles, axis=0), np.sort(TET_FACES, axis=0))
    assert_array_equal(tets, 0)


def test_a_facet_is_that_with_the_same_corners_in_any_order() -> None:
    facets = np.array([[0, 1, 2], [3, 2, 1], [4, 0, 1]])
    assert_array_equal(found_in(facets, np.array([[2, 0, 1], [1, 4, 3], [1, 3, 2]])), [True, True, False])
    assert_array_equal(found_in(facets, np.zeros((0, 3), int)), False)
    assert found_in(facets[:0], facets).shape == (0,)


@pytest.mark.parametrize("turn", [Rotation.identity(), TURN])
def test_a_box_of_tets_has_its_volume_and_skin(turn: Rotation) -> None:
    mesh = shapes.box((4, 3, 2), (40.0, 30.0, 20.0))
    points = turn.apply(mesh.points) + HIP
    triangles, tets = boundary(mesh.tets)
    # 1e-10: coordinates near 500 with 16 digits against edges of 10.
    assert_allclose(tet_volumes(points, mesh.tets), 1000 / 6, rtol=1e-10)
    assert_allclose(enclosed_volume(points, triangles), 24000, rtol=1e-10)
    assert_allclose(triangle_areas(points, triangles).sum(), 2 * (1200 + 800 + 600), rtol=1e-10)
    assert len(triangles) == 2 * 2 * (12 + 8 + 6)
    assert (mesh.tets[tets][:, :, None] == triangles[:, None, :]).any(axis=1).all()


def test_the_volume_in_a_sphere_converges_with_second_order() -> None:
    errors = [4 / 3 * np.pi - enclosed_volume(ball.points, ball.triangles) for ball in map(shapes.sphere, (2, 3, 4))]
    # Chords lie below the sphere by h^2/8: halving h divides the error by 4, up to h^4 terms.
    assert_allclose(np.array(errors[:-1]) / errors[1:], 4, rtol=0.03)


def test_vertex_areas_share_out_the_whole_area() -> None:
    ball = shapes.sphere(2, 3.0)
    areas = vertex_areas(ball.points, ball.triangles)
    assert_allclose(areas.sum(), triangle_areas(ball.points, ball.triangles).sum())
    assert_allclose(vertex_areas(CORNER, TET_FACES)[0], 0.5)
    assert vertex_areas(np.concatenate([CORNER, CORNER[:1]]), TET_FACES)[4] == 0


def test_quality_of_regular_flat_and_corner_tets() -> None:
    # Mean ratio 12 (3 V)^(2/3) / sum of squared edges; the corner: 12 (1/2)^(2/3) / (3 * 1 + 3 * 2).
    assert_allclose(tet_qualities(7 * REGULAR, ONE), 1)
    assert_allclose(tet_qualities(CORNER, ONE), 12 * 0.5 ** (2 / 3) / 9)
    assert_allclose(tet_qualities(CORNER * (1, 1, 0), ONE), 0)
    assert_allclose(tet_qualities(CORNER, ONE[:, [1, 0, 2, 3]]), tet_qualities(CORNER, ONE))


def test_quality_depends_on_shape_alone() -> None:
    points = np.random.default_rng(7).normal(size=(4, 3))
    assert_allclose(tet_qualities(5 * TURN.apply(points) + 3, ONE), tet_qualities(points, ONE), rtol=1e-10)


def test_polylines_have_lengths_at_rest_and_moved() -> None:
    lines = Polylines(np.array([[0.0, 0, 0], [3, 4, 0], [3, 4, 12], [9, 9, 9], [9, 9, 10]]), np.array([0, 3, 5]))
    assert len(lines) == 2
    assert_allclose(lines.lengths(), [17, 1])
    assert_allclose(lines.lengths(2 * lines.points), [34, 2])


def test_records_keep_read_only_copies() -> None:
    points = CORNER.copy()
    surface, mesh = Surface(points, TET_FACES), TetMesh(points, ONE, {"base": TET_FACES[:1]})
    points[:] = np.nan
    assert_array_equal(surface.points, CORNER)
    assert_array_equal(mesh.points, CORNER)
    for array in (
        surface.points,
        surface.triangles,
        mesh.tets,
        mesh.facets["base"],
        surface.moved_to(CORNER + 1).points,
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert surface.moved_to(CORNER + 1).triangles is surface.triangles


def test_a_read_only_view_of_what_may_change_is_copied() -> None:
    points = CORNER.copy()
    view = points[:]
    view.setflags(write=False)
    surface = Surface(view, TET_FACES)
    points[:] = np.nan
    assert_array_equal(surface.points, CORNER)


def test_a_fingerprint_sees_values_shapes_types_and_order() -> None:
    numbers = np.arange(6)
    others = [numbers + 1, numbers.reshape(2, 3), numbers.astype(np.float64), numbers[::-1]]
    prints = {fingerprint(array) for array in (numbers, *others)}
    assert len(prints) == 5
    assert fingerprint(numbers) == fingerprint(numbers[::-1][::-1])
    assert fingerprint(numbers, numbers + 1) != fingerprint(numbers + 1, numbers)


def test_a_closed_surface_is_given_back_outward() -> None:
    inward = Surface(CORNER, TET_FACES[:, ::-1], "here")
    assert_allclose(enclosed_volume(CORNER, check_closed(inward).triangles), 1 / 6)
    outward = Surface(CORNER, TET_FACES)
    assert check_closed(outward) is outward
    assert check_closed(inward).place == "here"


def _two(first: Surface, second: Surface, same: tuple[tuple[int, int], ...] = ()) -> tuple[np.ndarray, np.ndarray]:
    """Two surfaces as one, where each pair of ``same`` is a vertex of the first and of the second that become one."""
    count = len(first.points)
    number = np.arange(count, count + len(second.points))
    for here, there in same:
        number[there] = here
    used, triangles = np.unique(np.concatenate([first.triangles, number[second.triangles]]), return_inverse=True)
    return np.concatenate([first.points, second.points])[used], triangles.reshape(-1, 3)


BAR = shapes.skin(shapes.box((2, 2, 6), (10.0, 10.0, 60.0)))
CUBE = shapes.skin(shapes.box((2, 2, 2), (4.0, 4.0, 4.0)))
APART = CUBE.moved_to(CUBE.points + (20, 30, 40))
TOP = int(np.flatnonzero((BAR.points == (10, 10, 60)).all(axis=1))[0])
ON_TOP = CUBE.moved_to(CUBE.points + (10, 10, 60))
BALL = shapes.sphere(3, 30.0)
NORTH, SOUTH = int(BALL.points[:, 2].argmax()), int(BALL.points[:, 2].argmin())


def _pinched() -> tuple[np.ndarray, np.ndarray]:
    """A ball whose poles are one vertex."""
    triangles = np.where(BALL.triangles == SOUTH, NORTH, BALL.triangles)
    used, triangles = np.unique(triangles, return_inverse=True)
    return BALL.points[used], triangles.reshape(-1, 3)


FAN = np.array([*TET_FACES, [1, 2, 4], [2, 1, 4]])
UNUSABLE = {
    "no triangles": (CORNER, np.zeros((0, 3), int)),
    r"not finite \(vertex 2\)": (np.where(np.arange(4)[:, None] == 2, np.nan, CORNER), TET_FACES),
    "vertex that does not exist, want vertices from 0 to 2": (CORNER[:3], TET_FACES),
    "a triangle with a vertex that does not exist": (CORNER, TET_FACES - 1),
    "3 edges that belong to only one triangle, the first at": (CORNER, TET_FACES[1:]),
    "edges that belong to more than two triangles": (
        np.concatenate([CORNER, CORNER[:1] + 2]),
        np.array([*FAN, [1, 4, 3], [3, 4, 1]]),
    ),
    "3 edges along which both triangles have the same direction": (
        CORNER,
        np.array([TET_FACES[0][::-1], *TET_FACES[1:]]),
    ),
    "1 points that no triangle uses": (np.concatenate([CORNER, CORNER[:1]]), TET_FACES),
    r"2 separate parts, the smallest \(96 mm2\) around \(22.0, 32.0, 42.0\) mm, want one": _two(BAR, APART),
    rf"1 vertices where parts touch, the first vertex {TOP} at \(10.0, 10.0, 60.0\) mm, want a manifold": _two(
        BAR, ON_TOP, ((TOP, 0),)
    ),
    "1 vertices where parts touch, the first vertex": _pinched(),
    "an enclosed volume of zero": (CORNER * (1, 1, 0), TET_FACES),
}


@pytest.mark.parametrize("what", UNUSABLE)
def test_what_is_not_a_closed_surface_is_named(what: str) -> None:
    with pytest.raises(InputError, match=f"bone.ply: got .*{what}"):
        check_closed(Surface(*UNUSABLE[what], "bone.ply"))


def test_a_finite_surface_need_not_be_closed() -> None:
    check_finite(Surface(CORNER, TET_FACES[1:]))
