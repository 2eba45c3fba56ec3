"""Cross-sections of a field in tetrahedra: area, moments and the map to the unit square of shapes with closed forms."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import TetMesh, triangle_areas
from fem_reference.geometry.cross_sections import cross_section

Z = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("level", [17.3, 20.0])
def test_a_rectangle_has_its_area_moments_and_a_linear_map(level: float) -> None:
    """Moments of a rectangle are sides squared over 12; a level through points of the mesh is moved by 1e-4."""
    box = shapes.box((4, 3, 6), (14.0, 10.0, 60.0))
    found = cross_section(box, box.points[:, 2], level)
    assert triangle_areas(found.points, found.triangles).sum() == pytest.approx(140, rel=1e-6)
    assert_allclose(found.normal, Z, atol=1e-6)
    centre, product = found.moments
    assert_allclose(centre, [7, 5, level], atol=1e-3)
    assert_allclose(product[:2, :2], np.diag([14**2, 10**2]) / 12, atol=1e-5)
    assert_allclose(found.square(found.turns(np.array([1.0, 0, 0]))), found.points[:, :2] / [14, 10], atol=1e-5)
    turned = found.square(found.turns(np.array([0.0, 1, 0])))
    assert_allclose(turned, np.column_stack([found.points[:, 1] / 10, 1 - found.points[:, 0] / 14]), atol=1e-5)


def test_the_greatest_piece_counts_and_holes_do_not() -> None:
    """Of two bars the thicker one; a section around a hole, and one beyond the body, are none."""
    thick, thin = shapes.box((2, 2, 4), (6.0, 6.0, 20.0)), shapes.box((1, 1, 4), (2.0, 2.0, 20.0))
    both = TetMesh(
        np.concatenate([thin.points + [30, 0, 0], thick.points]),
        np.concatenate([thin.tets, thick.tets + len(thin.points)]),
    )
    found = cross_section(both, both.points[:, 2], 7.0)
    assert triangle_areas(found.points, found.triangles).sum() == pytest.approx(36, rel=1e-9)
    block = shapes.box((6, 6, 4), (6.0, 6.0, 4.0))
    middles = block.points[block.tets].mean(axis=1)
    pipe = TetMesh(block.points, block.tets[np.abs(middles[:, :2] - 3).max(axis=1) > 1])
    assert cross_section(pipe, pipe.points[:, 2], 1.7) is None
    assert cross_section(block, block.points[:, 2], 9.0) is None
