"""Rims of attachments become edges of a coarse surface: their area and outline at every size, on a good closed surface."""

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.mesh import Floats, Ints, Surface, check_closed, enclosed_volume, triangle_areas
from fem_reference.geometry.coarsening import coarsen
from fem_reference.geometry.distance import distances
from fem_reference.geometry.intersections import self_intersections
from fem_reference.geometry.rims import with_rims
from fem_reference.geometry.sectors import attached_area, attached_shares

BOX = shapes.skin(shapes.box((32, 24, 32), (80.0, 60.0, 80.0)))
BALL = shapes.sphere(4, 30.0)
SIZES = (8.0, 10.0, 12.5)


def _rimmed(fine: Surface, attached: dict[str, Ints], size: float) -> tuple[Surface, Ints, dict[str, float]]:
    """A coarse surface with rims, its labels and the areas wanted; what every such surface is like is asserted."""
    shares = {name: attached_shares(fine, vertices) for name, vertices in attached.items()}
    count = int(triangle_areas(fine.points, fine.triangles).sum() / (size**2 * np.sqrt(3) / 4))
    surface, labels = with_rims(coarsen(fine, count), fine, shares, size)
    assert_array_equal(check_closed(surface).triangles, surface.triangles)
    assert len(self_intersections(surface)) == 0
    # Each of four shifts leaves about a hundredth of what the rims' own shifts change.
    volume = enclosed_volume(fine.points, fine.triangles)
    assert_allclose(enclosed_volume(surface.points, surface.triangles), volume, rtol=1e-6)
    sides = surface.points[surface.triangles] - surface.points[np.roll(surface.triangles, 1, axis=1)]
    areas = triangle_areas(surface.points, surface.triangles)
    assert (4 * np.sqrt(3) * areas / np.sum(sides**2, axis=(1, 2))).min() > 0.1
    assert len(surface.triangles) < 1.4 * count
    return surface, labels, {name: attached_area(fine, share) for name, share in shares.items()}


def _area(surface: Surface, labels: Ints, label: int) -> float:
    return float(triangle_areas(surface.points, surface.triangles[labels == label]).sum())


def _rim(surface: Surface, labels: Ints, label: int) -> Floats:
    """The points between triangles with the label and others."""
    inside, outside = (np.unique(surface.triangles[chosen]) for chosen in (labels == label, labels != label))
    return np.asarray(surface.points[np.intersect1d(inside, outside)])


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_a_square_on_a_face_keeps_its_area_and_outline(size: float) -> None:
    x, y, z = BOX.points.T
    square = np.flatnonzero((z == 80) & (np.abs(x - 40) <= 20) & (np.abs(y - 30) <= 20))
    surface, labels, wanted = _rimmed(BOX, {"square": square}, size)
    # Vertices to 20 mm from the middle take half a cell of 2.5 mm more: 42.5 mm, a side, less half a cell at two corners.
    assert_allclose(wanted["square"], 42.5**2, rtol=2e-3)
    assert_allclose(_area(surface, labels, 1), wanted["square"], rtol=1e-3)
    rim = _rim(surface, labels, 1)
    off = np.abs(rim[:, :2] - [40, 30]).max(axis=1) - 21.25
    # What rims may be smoothed by: half a size, at corners; a fifth of it on average.
    assert np.abs(off).max() < size / 2
    assert np.abs(off).mean() < size / 5


@pytest.mark.parametrize("size", SIZES)
def test_a_disc_on_a_sphere_keeps_its_area_and_outline(size: float) -> None:
    disc = np.flatnonzero(BALL.points @ np.array([0.48, 0.6, 0.64]) > 30 * np.cos(0.6))
    surface, labels, wanted = _rimmed(BALL, {"disc": disc}, size)
    assert_allclose(_area(surface, labels, 1), wanted["disc"], rtol=1e-3)
    # The cap of this area has a height of area / (2 pi r).
    height = wanted["disc"] / (2 * np.pi * 30)
    rim = _rim(surface, labels, 1)
    across = np.linalg.norm(np.cross(rim, [0.48, 0.6, 0.64]), axis=1)
    radius = np.sqrt(height * (60 - height))
    # The rim of the vertices themselves is ragged by half of an edge, 1 mm; chords of h are h^2 / (8 radius) inside.
    assert np.abs(across - radius).max() < 1.0 + size**2 / (8 * radius)


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_the_rim_of_a_face_is_its_sharp_edges(size: float) -> None:
    surface, labels, wanted = _rimmed(BOX, {"end": np.flatnonzero(BOX.points[:, 2] == 0)}, size)
    assert_allclose(wanted["end"], 80 * 60)
    assert_allclose(_area(surface, labels, 1), 80 * 60, rtol=1e-3)
    attached = surface.points[np.unique(surface.triangles[labels == 1])]
    # How much the inversion in coarsening bends a plane over one triangle, and what makes good the area and the volume.
    assert np.abs(attached[:, 2]).max() < 0.15
    rim = _rim(surface, labels, 1)
    assert np.abs(np.minimum(np.abs(np.abs(rim[:, 0] - 40) - 40), np.abs(np.abs(rim[:, 1] - 30) - 30))).max() < 0.15


@pytest.mark.slow
def test_two_attachments_side_by_side_share_their_rim() -> None:
    x, y, z = BOX.points.T
    on_top = (z == 80) & (np.abs(x - 40) <= 25) & (np.abs(y - 30) <= 20)
    attached = {"left": np.flatnonzero(on_top & (x < 40)), "right": np.flatnonzero(on_top & (x >= 40))}
    surface, labels, wanted = _rimmed(BOX, attached, 10.0)
    for label, name in enumerate(attached, start=1):
        assert_allclose(_area(surface, labels, label), wanted[name], rtol=1e-2)
    left, right = (np.unique(surface.triangles[labels == label]) for label in (1, 2))
    assert len(np.intersect1d(left, right)) >= 4  # 40 mm in sides of 10 mm


def test_islands_and_pinholes_below_a_facet_are_dropped_and_the_area_is_kept() -> None:
    x, y, z = BOX.points.T
    square = (z == 80) & (np.abs(x - 40) <= 20) & (np.abs(y - 30) <= 20)
    pinhole, island = (((x == at) & (y == 30) & (z == 80)) for at in (40, 75))
    surface, labels, wanted = _rimmed(BOX, {"ragged": np.flatnonzero(square & ~pinhole | island)}, 12.5)
    assert_allclose(_area(surface, labels, 1), wanted["ragged"], rtol=1e-3)
    near = distances(np.array([[40.0, 30, 80], [75, 30, 80]]), surface).triangle
    assert labels[near].tolist() == [1, 0]


def test_the_same_surface_gives_the_same_rims() -> None:
    disc = np.flatnonzero(BALL.points[:, 2] > 25)
    one, other = (_rimmed(BALL, {"disc": disc}, 10.0) for _ in range(2))
    assert_array_equal(one[0].points, other[0].points)
    assert_array_equal(one[1], other[1])


def test_an_area_far_below_a_triangle_has_no_facet() -> None:
    dot = np.flatnonzero((BOX.points == (40, 30, 80)).all(axis=1))
    _, labels, wanted = _rimmed(BOX, {"dot": dot}, 30.0)
    assert_allclose(wanted["dot"], 2.5**2)
    assert not labels.any()


def test_an_island_of_a_fraction_of_a_triangle_is_kept() -> None:
    x, y, z = BOX.points.T
    square = (z == 80) & (np.abs(x - 25) <= 15) & (np.abs(y - 30) <= 15)
    # 7.5 mm wide, less than a triangle of 12.5 mm.
    island = (z == 80) & (np.abs(x - 65) <= 2.5) & (np.abs(y - 30) <= 2.5)
    surface, labels, wanted = _rimmed(BOX, {"both": np.flatnonzero(square | island)}, 12.5)
    assert_allclose(_area(surface, labels, 1), wanted["both"], rtol=1e-3)
    assert labels[distances(np.array([[25.0, 30, 80], [65, 30, 80]]), surface).triangle].tolist() == [1, 1]


def test_a_strip_narrower_than_a_triangle_is_kept() -> None:
    x, y, z = BOX.points.T
    strip = np.flatnonzero((z == 80) & (np.abs(x - 40) <= 25) & (np.abs(y - 30) <= 2.5))
    surface, labels, wanted = _rimmed(BOX, {"strip": strip}, 12.5)
    assert_allclose(_area(surface, labels, 1), wanted["strip"], rtol=1e-2)
    attached = distances(BOX.points[strip], Surface(surface.points, surface.triangles[labels == 1])).distance
    assert np.mean(attached < 12.5 / 4) > 0.9


def test_flat_triangles_at_a_rim_leave_it_where_it_is() -> None:
    """As of both ends of a bar that triangles of more than its width are to fill; warnings are errors here."""
    bar, ends = small.body(), (0.0, 40.0)
    attached = {str(z): np.flatnonzero(np.abs(bar.points[:, 2] - z) < 1.5) for z in ends}
    shares = {name: attached_shares(bar, vertices) for name, vertices in attached.items()}
    surface, labels = with_rims(coarsen(bar, 26), bar, shares, 13.0)
    assert_array_equal(check_closed(surface).triangles, surface.triangles)
    for label, z in enumerate(ends, start=1):
        assert np.ptp(_rim(surface, labels, label), axis=0)[:2] == pytest.approx([10, 10], rel=0.05)
        assert_allclose(surface.points[surface.triangles[labels == label]][..., 2], z, atol=0.3)
