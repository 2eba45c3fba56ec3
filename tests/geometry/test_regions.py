"""Regions: their shares, their borders, and their volumes on meshes, which fall together."""

import pickle

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Surface, TetMesh, boundary, tet_volumes
from fem_reference.geometry.fibres import fibre_field
from fem_reference.geometry.regions import Around, Between, Blended, Inside, Union, samples

SIZE = (10.0, 10.0, 40.0)


def _skin(mesh: TetMesh) -> Surface:
    return Surface(mesh.points, boundary(mesh.tets)[0])


def _bar(cells: int = 2) -> TetMesh:
    return shapes.box((cells, cells, 4 * cells), SIZE)


END = Surface(np.array([[-90.0, -90, 0], [190, -90, 0], [-90, 190, 0]]), np.array([[0, 1, 2]]))  # around z = 0
LINE = np.column_stack([np.full(20, 4.0), np.full(20, 5.0), np.linspace(2.1, 39, 20)])
FIELD = fibre_field(_bar(4), "bottom", "top")  # z / 40 exactly, as linear elements represent it


@pytest.mark.parametrize(
    "depth", [Around(END, 12.0), Inside(_skin(shapes.box((1, 1, 1), (10, 10, 12.0)))), Between(FIELD, 0.0, 0.3)]
)
def test_the_three_kinds_of_borders_of_a_plane_end_agree(depth):
    """The last 12 mm of a bar, to whose sides the box is not near."""
    shares = Blended(depth, 2.0)(LINE)
    t = np.clip((12 - LINE[:, 2]) / 2, 0, 1)
    assert shares == pytest.approx((1000**t - 1) / 999, abs=1e-9)
    assert pickle.loads(pickle.dumps(Blended(depth, 2.0)))(LINE) == pytest.approx(shares, abs=0)


def test_a_border_without_width_is_a_jump_and_belongs_to_its_region():
    found = Blended(Around(END, 12.0), 0.0)(np.array([[4.0, 4, 11.9], [4, 4, 12.0], [4, 4, 12.1]]))
    assert found.tolist() == [1, 1, 0]


def test_a_share_of_the_field_reaches_to_the_attachments():
    at_ends = np.array([[5.0, 5, 0], [5, 5, 40], [5, 5, 20]])
    assert Blended(Between(FIELD, 0.0, 0.2), 5.0)(at_ends) == pytest.approx([1, 0, 0])
    assert Blended(Between(FIELD, 0.8, 1.0), 5.0)(at_ends) == pytest.approx([0, 1, 0])
    assert Blended(Between(FIELD, 0.4, 0.6), 2.0)(at_ends) == pytest.approx([0, 0, 1])
    assert Blended(Between(FIELD, 0.0, 1.0), 2.0)(at_ends).tolist() == [1, 1, 1]


def test_a_union_is_all_of_its_regions_and_stays_below_one():
    near, far = Blended(Between(FIELD, 0.0, 0.4), 8.0), Blended(Between(FIELD, 0.6, 1.0), 8.0)
    inside = samples(_skin(_bar()))
    assert Union((near, far))(inside) == pytest.approx(near(inside) + far(inside), abs=1e-12)
    both = Union((near, near))(inside)
    assert both == pytest.approx(1 - (1 - near(inside)) ** 2, abs=1e-12)
    assert both.max() <= 1


def test_samples_fill_a_body_evenly():
    found = samples(_skin(_bar()))
    assert 15_000 < len(found) < 25_000
    assert found.mean(axis=0) == pytest.approx([5, 5, 20], abs=1e-9)  # of a box, by symmetry
    share = Blended(Around(END, 12.0), 2.0)(found).mean()
    assert share == pytest.approx(
        (10 + 2 * (1 / np.log(1000) - 1 / 999)) / 40, abs=3e-3
    )  # planes of the grid are 0.6 mm apart


@pytest.mark.slow
@pytest.mark.parametrize(("width", "order"), [(3.0, 1.7), (0.0, 0.5)])
def test_the_volume_of_a_region_does_not_depend_on_the_mesh(width, order):
    """By the middles of tetrahedra: an error of second order in their size where the region is smooth, of first where it
    jumps. A ball has no plane that a mesh could follow.
    """
    centre, radius = np.array([5.1, 4.9, 20.3]), 3.0

    def depth(points):
        return radius - np.linalg.norm(points - centre, axis=1)

    region, errors = Blended(depth, width), []
    r = np.linspace(0, 10, 200_001)
    t = np.clip((radius - r) / width, 0, 1) if width else (r <= radius).astype(float)
    exact = np.trapezoid(4 * np.pi * r**2 * (1000**t - 1) / 999, r)
    for cells in (5, 10, 20):
        mesh = _bar(cells)
        middles = mesh.points[mesh.tets].mean(axis=1)
        errors.append(abs(region(middles) @ tet_volumes(mesh.points, mesh.tets) / exact - 1))
    assert errors[-1] < 0.02
    assert np.log2(errors[0] / errors[-1]) / 2 > order
