"""Points on a surface that contact presses on and springs pull at: a rule, each point carried by a tet."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Surface, TetMesh, boundary, triangle_areas
from fem_reference.geometry.exemption import Exemption, free_skin
from fem_reference.geometry.skins import Pieces, attached_skin, corner_areas, cut, edge_lengths, spacing


def unit_tet() -> tuple[Surface, TetMesh]:
    mesh = TetMesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]), {}, "hand")
    return Surface(mesh.points, boundary(mesh.tets)[0], "tet"), mesh


def below(surface: Surface) -> tuple[np.ndarray, Exemption]:
    """The triangle (1,) of the face z = 0, and an exemption of all others."""
    flat = (surface.points[surface.triangles][:, :, 2] == 0).all(axis=1)
    shares = np.repeat(~flat[:, None], 3, axis=1).astype(float)
    return np.flatnonzero(flat), Exemption.of(surface, [("bone", shares)])


def test_it_stands_for_the_whole_area() -> None:
    surface, mesh = unit_tet()
    skin = free_skin(Exemption.of(surface), mesh, 2.0)
    assert len(skin.points) == 12
    assert_allclose(skin.areas.sum(), 1.5 + np.sqrt(3) / 2, rtol=1e-14)


def test_what_is_attached_is_left_out_and_squares_are_exact() -> None:
    # On the face z = 0: 1/2, 1/12 and 1/24 for 1, x^2 and x y. Its points are 0.1 and more from the other faces, the reach is 0.02.
    surface, mesh = unit_tet()
    _, exempt = below(surface)
    skin = free_skin(exempt, mesh, 2.0)
    assert_allclose(skin.points[:, 2], 0)
    assert (skin.points[:, :2] > 0.1).all()  # inside, not on its edges
    assert_allclose(skin.areas, 1 / 6)
    assert_allclose(skin.areas @ skin.points[:, 0] ** 2, 1 / 12, rtol=1e-14)
    assert_allclose(skin.areas @ (skin.points[:, 0] * skin.points[:, 1]), 1 / 24, rtol=1e-14)
    assert (skin.cells == 0).all()


def test_long_triangles_are_cut() -> None:
    surface, mesh = unit_tet()
    flat, exempt = below(surface)
    fine = free_skin(exempt, mesh, 0.4)
    ends = np.sqrt(2 * fine.areas.max())
    assert ends < 0.4
    assert_allclose(fine.areas.sum(), triangle_areas(surface.points, surface.triangles[flat]).sum(), rtol=1e-14)
    assert_allclose(fine.areas @ fine.points[:, 0] ** 2, 1 / 12, rtol=1e-14)


def test_what_springs_pull_at_has_the_area_that_is_attached() -> None:
    # On the face z = 0 with shares 1, 0, 0 of its corners, so 1 - x - y inside: a third of the area, and 1/24 of x.
    surface, mesh = unit_tet()
    below = np.flatnonzero((surface.points[surface.triangles][:, :, 2] == 0).all(axis=1))
    shares = np.zeros(surface.triangles.shape)
    shares[below] = surface.triangles[below] == 0
    for apart in (2.0, 0.4):
        skin = attached_skin(surface, shares, mesh, apart)
        assert_allclose(skin.points[:, 2], 0)
        assert_allclose(skin.areas.sum(), 1 / 6, rtol=1e-14)
        assert_allclose(skin.areas @ skin.points[:, 0], 1 / 24, rtol=1e-14)
    assert len(attached_skin(surface, np.zeros(shares.shape), mesh, 2.0).points) == 0


def test_the_spacing_goes_with_the_surface() -> None:
    surface, _ = unit_tet()
    assert_allclose(spacing(surface.moved_to(3 * surface.points + 7)), 3 * spacing(surface), rtol=1e-12)


def pieces_of(surface: Surface, apart: float) -> tuple[Pieces, np.ndarray]:
    found = cut(surface, np.arange(len(surface.triangles)), apart)
    return found, found.of(surface.points[surface.triangles])


@pytest.mark.parametrize("apart", [0.3, 1.0, 20.0])
def test_pieces_cover_their_triangles_and_none_is_long(apart: float) -> None:
    bar = shapes.skin(shapes.box((1, 1, 2), (4, 4, 20)))
    found, places = pieces_of(bar, apart)
    areas = np.bincount(found.parents, corner_areas(places))
    assert_allclose(areas, triangle_areas(bar.points, bar.triangles), rtol=1e-12)
    assert edge_lengths(places).mean(axis=1).max() <= apart
    assert edge_lengths(places).max() <= 1.5 * apart
    assert_allclose(found.corners.sum(axis=2), 1, rtol=1e-15)


def test_a_large_triangle_among_small_ones_is_cut_too() -> None:
    # A ball of 1280 triangles and one tetrahedron of edges of 30 mm beside: on average edges are short.
    ball, corner = shapes.sphere(3, 5.0), 30 * np.vstack([np.zeros(3), np.eye(3)])
    large = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) + len(ball.points)
    both = Surface(np.concatenate([ball.points, corner]), np.concatenate([ball.triangles, large]))
    assert edge_lengths(both.points[both.triangles]).mean() < 1.0
    found, places = pieces_of(both, 1.0)
    assert edge_lengths(places).max() <= 2.0
    assert (found.parents < len(ball.triangles)).sum() == len(ball.triangles)  # those stay


def test_long_thin_triangles_become_fewer_pieces_than_by_quarters() -> None:
    # 80 mm by 0.1 mm, as long as a surface has any, in edges of 1.5 mm at most: three for each half, where quarters make 4^6.
    strip = Surface(np.array([[0.0, 0, 0], [80, 0, 0], [80, 0.1, 0]]), np.array([[0, 1, 2]]))
    found, _ = pieces_of(strip, 1.0)
    assert 53 <= len(found.parents) <= 3**6


def test_what_is_linear_in_triangles_is_carried_over() -> None:
    bar = shapes.skin(shapes.box((1, 2, 1), (4, 6, 5)))
    found, places = pieces_of(bar, 0.7)
    slope = np.array([[1.0, 2.0], [-3.0, 0.5], [0.2, 0.0]])
    assert_allclose(found.of((bar.points @ slope)[bar.triangles]), places @ slope, atol=1e-12)
    assert len(cut(bar, np.zeros(0, np.int64), 1.0).parents) == 0
