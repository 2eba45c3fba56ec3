"""Tets in eight parts: they nest, fill the same, keep their regions, are graded at rims and follow the surface."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import (
    Surface,
    TetMesh,
    boundary,
    enclosed_volume,
    tet_qualities,
    tet_volumes,
    triangle_areas,
)
from fem_reference.geometry.embedding import embed
from fem_reference.geometry.nested import GRADED, refined


def bar(cells: int = 2) -> TetMesh:
    return shapes.box((cells, cells, 2 * cells), (10.0, 10.0, 20.0))


def _across(mesh: TetMesh, name: str) -> np.ndarray:
    """The sum of the normals of a region, each as long as its area."""
    a, b, c = np.swapaxes(mesh.points[mesh.facets[name]], 0, 1)
    return np.cross(b - a, c - a).sum(axis=0) / 2


@pytest.mark.parametrize("rims", [(), ("bottom",), ("bottom", "top")])
def test_parts_fill_what_they_are_parts_of(rims) -> None:
    mesh = bar()
    fine = refined(mesh, None, rims)
    assert len(fine.tets) == 8 * len(mesh.tets)
    volumes = tet_volumes(fine.points, fine.tets)
    assert (volumes > 0).all()
    # Eight after eight are in the tet that they are parts of, to rounding.
    assert_allclose(volumes.reshape(-1, 8).sum(axis=1), tet_volumes(mesh.points, mesh.tets), rtol=1e-12)
    middles = fine.points[fine.tets].mean(axis=1)
    assert np.array_equal(embed(mesh, middles).tets, np.repeat(np.arange(len(mesh.tets)), 8))
    faces, _ = boundary(fine.tets)
    assert_allclose(triangle_areas(fine.points, faces).sum(), 2 * 100 + 4 * 200, rtol=1e-12)


def test_regions_are_made_of_the_parts_of_their_facets() -> None:
    fine = refined(bar(), None, ("bottom",))
    skin = {tuple(sorted(face)) for face in boundary(fine.tets)[0].tolist()}
    for name, height in (("bottom", 0.0), ("top", 20.0)):
        faces = fine.facets[name]
        assert {tuple(sorted(face)) for face in faces.tolist()} <= skin
        assert_allclose(fine.points[faces][:, :, 2], height, atol=1e-12)
        assert_allclose(triangle_areas(fine.points, faces).sum(), 100, rtol=1e-12)
        assert_allclose(_across(fine, name), _across(bar(), name), rtol=1e-12, atol=1e-12)  # turned as they were


def test_at_a_rim_the_nearest_points_are_at_a_quarter() -> None:
    mesh = shapes.box((1, 1, 1), (8.0, 8.0, 8.0))
    fine = refined(mesh, None, ("bottom",))
    # All four points below are on the rim, those above are not: edges upwards are cut at a quarter, others in the middle.
    heights = np.unique(np.round(fine.points[:, 2], 9))
    assert_allclose(heights, [0, 8 * GRADED, 8])
    assert set(np.unique(np.round(fine.points[:, 0], 9))) >= {0, 4, 8}


def test_new_points_of_the_boundary_are_on_the_surface() -> None:
    ball = shapes.sphere(4, 10.0)
    octahedron = np.vstack([np.zeros(3), 10 * np.eye(3), -10 * np.eye(3)])
    signs = [(1, 2, 3), (4, 3, 2), (5, 3, 1), (6, 1, 2), (4, 5, 3), (5, 6, 1), (6, 4, 2), (4, 6, 5)]
    tets = np.array([[0, a, b, c] for a, b, c in signs])
    tets[tet_volumes(octahedron, tets) < 0] = tets[tet_volumes(octahedron, tets) < 0][:, [0, 2, 1, 3]]
    mesh = TetMesh(octahedron, tets, {}, "hand")
    fine = refined(mesh, ball)
    faces, _ = boundary(fine.tets)
    # All on the surface, and from there outwards by one distance, so that the volume is the ball's.
    off = np.linalg.norm(fine.points[np.unique(faces)], axis=1) - 10
    assert off.min() > 0
    assert np.ptp(off) < 0.1  # of the ball's own facets, 0.02, and of normals
    assert tet_volumes(fine.points, fine.tets).sum() == pytest.approx(
        enclosed_volume(ball.points, ball.triangles), rel=0.01
    )
    assert (tet_volumes(fine.points, fine.tets) > 0).all()


def test_tets_stay_sound_where_the_surface_is_far() -> None:
    mesh = bar(1)
    far = Surface(*((lambda skin: (skin.points * [1, 1, 3], skin.triangles))(shapes.skin(mesh))), "far")
    fine = refined(mesh, far)
    assert (tet_volumes(fine.points, fine.tets) > 0).all()
    assert tet_qualities(fine.points, fine.tets).min() > 0.1
