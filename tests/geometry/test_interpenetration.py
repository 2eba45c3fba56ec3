"""Depth of closed surfaces in each other: of boxes it is known, whichever comes first, and however they cross."""

import pytest
import shapes

from fem_reference.foundations.mesh import TetMesh
from fem_reference.geometry.interpenetration import penetration, skin_of


def box(size, shift):
    skin = shapes.skin(shapes.box((2, 2, 2), size))
    return skin.moved_to(skin.points + shift)


@pytest.mark.parametrize(
    ("size", "shift", "depth"),
    [
        ((1.0, 1.0, 1.0), (0.1, 0.2, 1.01), 0.0),  # above
        ((1.0, 1.0, 1.0), (0.1, 0.2, 0.9), 0.1),  # corners inside
        ((0.5, 0.5, 0.5), (0.25, 0.25, 0.2), 0.3),  # wholly inside: the middle of its upper side is 0.3 deep
        ((0.5, 3.0, 0.5), (0.2, -1.0, 0.8), 0.2),  # a beam through a side: no corner of either is in the other
    ],
)
def test_boxes(size, shift, depth) -> None:
    one, other = box((1.0, 1.0, 1.0), (0, 0, 0)), box(size, shift)
    for pair in ((one, other), (other, one)):
        found, place = penetration(*pair)
        assert found == pytest.approx(depth, abs=0.02)  # sample points are a sixth of a triangle apart
        assert place.shape == (3,)


def test_skin_of_a_mesh_is_its_boundary() -> None:
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0))
    assert isinstance(mesh, TetMesh)
    assert penetration(skin_of(mesh), box((1.0, 1.0, 1.0), (0, 0, 0.9)))[0] == pytest.approx(0.1, abs=1e-9)
