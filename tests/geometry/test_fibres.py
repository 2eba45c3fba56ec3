"""Traced fibres: straight in a bar, arcs in a ring, the same lines again and on a moved mesh."""

import pickle

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, TetMesh, boundary
from fem_reference.geometry import fibres
from fem_reference.geometry.embedding import embed
from fem_reference.geometry.fibres import NearestLine, fibre_field

INNER, OUTER = 20.0, 30.0  # radii of the ring [mm]
HIP = np.array([146.0, 238.0, -431.0])  # [mm]


def _bar(cells: int = 4) -> TetMesh:
    """A bar of 20 x 20 x 60 mm along z."""
    return shapes.box((cells, cells, 3 * cells), (20.0, 20.0, 60.0))


def trace(mesh: TetMesh, start: str, end: str, count: int) -> Polylines:
    """Fibres from one region to another."""
    return fibres.trace(fibre_field(mesh, start, end), count)


def directions(mesh: TetMesh, start: str, end: str) -> np.ndarray:
    """Their directions in the middle of each tet."""
    return fibre_field(mesh, start, end)(np.arange(len(mesh.tets)), mesh.points[mesh.tets].mean(axis=1))


def _ring(fineness: int) -> TetMesh:
    """A quarter ring of square section about the y axis, from z = 0 ("bottom") to x = 0 ("top")."""
    side = OUTER - INNER
    bar = shapes.box((4 * fineness, 4 * fineness, 20 * fineness), (side, side, np.pi / 2))
    across, along, angle = bar.points.T
    radius = INNER + across
    points = np.stack([radius * np.cos(angle), along, radius * np.sin(angle)], axis=1)
    return TetMesh(points, bar.tets, bar.facets)


def _on_one_side(mesh: TetMesh, low: float, high: float) -> TetMesh:
    """The bar attached on its side y = 0 only: below z = ``low`` and above ``high``."""
    faces, _ = boundary(mesh.tets)
    side, middle = (mesh.points[faces, 1] == 0).all(axis=1), mesh.points[faces].mean(axis=1)[:, 2]
    return TetMesh(
        mesh.points, mesh.tets, {"bottom": faces[side & (middle < low)], "top": faces[side & (middle > high)]}
    )


def _radii(lines: Polylines) -> np.ndarray:
    """Distance of each point from the ring's axis, one row a line."""
    return np.linalg.norm(lines.points[:, [0, 2]], axis=1).reshape(len(lines), -1)


def test_fibres_of_a_straight_bar_are_straight_and_as_long() -> None:
    lines = trace(_bar(), "bottom", "top", 12)
    assert_array_equal(np.diff(lines.offsets), 40)
    # A linear field is exact in linear elements; what is left is the solver's round-off.
    assert_allclose(lines.lengths(), 60, rtol=1e-9)
    by_line = lines.points.reshape(12, 40, 3)
    assert_allclose(by_line[:, :, 2], np.broadcast_to(np.linspace(0, 60, 40), (12, 40)), rtol=0, atol=1e-8)
    assert_allclose(np.ptp(by_line[:, :, :2], axis=1), 0, rtol=0, atol=1e-8)


def test_lines_run_from_start_to_end() -> None:
    bar = _bar()
    lines = trace(bar, "top", "bottom", 3)
    assert_allclose(lines.points[lines.offsets[:-1], 2], 60, atol=1e-9)
    assert_allclose(lines.points[lines.offsets[1:] - 1, 2], 0, atol=1e-9)


def test_lines_are_spread_over_the_section() -> None:
    lines = trace(_bar(), "bottom", "top", 12)
    starts = lines.points[lines.offsets[:-1], :2]
    apart = np.linalg.norm(starts[:, None] - starts[None], axis=2) + 100 * np.eye(12)
    # Twelve points on a grid of 20 x 20 mm would be 20 / sqrt(12) = 5.8 mm apart; half of that is no crowd.
    assert apart.min() > 2.9
    assert (np.ptp(starts, axis=0) > 12).all()


def test_fibres_of_a_quarter_ring_are_arcs() -> None:
    """The exact field is the angle; its lines are arcs of length r pi / 2.

    The averaged gradient is of first order at the skin, so halving the elements halves the error.
    """
    errors = []
    for fineness in (1, 2):
        lines = trace(_ring(fineness), "bottom", "top", 12)
        radii = _radii(lines)
        errors.append(np.sqrt(np.mean((radii - radii.mean(axis=1, keepdims=True)) ** 2)))
        relative = lines.lengths() / (radii.mean(axis=1) * np.pi / 2) - 1
        assert np.abs(relative).max() < 0.005 / fineness
        assert radii.min() > INNER
        assert radii.max() < OUTER
    assert errors[1] < 0.65 * errors[0]


def test_lines_stay_in_the_mesh() -> None:
    ring = _ring(1)
    found = embed(ring, trace(ring, "bottom", "top", 12).points)
    assert found.outside.max() < 0.05  # the sagitta of a chord of a 4 degree facet is 0.02 mm


def test_a_line_does_not_depend_on_the_order_of_lines(monkeypatch) -> None:
    """The lines of the ring have different lengths, so some end while others are still traced."""
    spread, lines = fibres.spread, []
    for order in (1, -1):
        monkeypatch.setattr(fibres, "spread", lambda points, _, order=order: spread(points, 12)[::order])
        lines.append(trace(_ring(1), "bottom", "top", 12).points.reshape(12, 40, 3)[::order])
    assert np.ptp(np.linalg.norm(np.diff(lines[0], axis=1), axis=2).sum(axis=1)) > 5
    assert_allclose(*lines, rtol=0, atol=1e-9)  # round-off of sums in another order


def test_the_same_mesh_gives_the_same_lines() -> None:
    assert_array_equal(trace(_ring(1), "bottom", "top", 8).points, trace(_ring(1), "bottom", "top", 8).points)


@pytest.mark.parametrize("seed", range(3))
def test_turned_moved_scaled_and_renumbered_meshes_have_the_same_lines(seed: int) -> None:
    """Of a ring whose points are a little off, as lines that are equally far apart are chosen by their number."""
    ring, rng = _ring(1), np.random.default_rng(seed)
    ring = TetMesh(ring.points + rng.normal(scale=0.05, size=ring.points.shape), ring.tets, ring.facets)
    turn = Rotation.random(rng=rng)
    moved = shapes.renumbered(TetMesh(3 * turn.apply(ring.points) + HIP, ring.tets, ring.facets), seed)
    lines, found = trace(ring, "bottom", "top", 8), trace(moved, "bottom", "top", 8)
    # Round-off of the field (1e-12 relative) grows along the line.
    assert_allclose(found.points, 3 * turn.apply(lines.points) + HIP, rtol=0, atol=1e-6)


def test_lines_that_leave_the_body_are_replaced_by_others() -> None:
    """Attached on one side of a bar, lines far from it bend along the skin; those that are given all arrive."""
    lines = trace(_on_one_side(_bar(), 15, 45), "bottom", "top", 12)
    begins, ends = lines.points[lines.offsets[:-1]], lines.points[lines.offsets[1:] - 1]
    assert_allclose(np.concatenate([begins, ends])[:, 1], 0, atol=1e-12)
    assert (begins[:, 2] <= 15).all()
    assert (ends[:, 2] >= 45).all()


def test_attachments_that_touch_still_give_fibres() -> None:
    assert len(trace(_on_one_side(_bar(2), 30, 30), "bottom", "top", 2)) == 2


def test_more_fibres_than_there_is_room_for() -> None:
    with pytest.raises(
        InputError,
        match=r"fibres\.traced\.count: got 5000, want at most \d+, the number that could be traced",
    ):
        trace(_bar(2), "bottom", "top", 5000)


def test_nothing_between_the_attachments() -> None:
    bar = _bar(2)
    skin, _ = boundary(bar.tets)
    with pytest.raises(
        InputError, match=r"fibres\.traced: got nothing between the two attachments, want two attachments"
    ):
        trace(TetMesh(bar.points, bar.tets, {"all": skin}), "all", "all", 1)


def test_directions_follow_the_bar_and_the_ring() -> None:
    # Along a bar exactly; around a ring the field's gradient is linear elements' on the cells: 5 degrees at worst here.
    assert_allclose(directions(_bar(), "bottom", "top"), np.tile([0, 0, 1.0], (len(_bar().tets), 1)), atol=1e-8)
    ring = _ring(1)
    x, _, z = ring.points[ring.tets].mean(axis=1).T
    around = np.stack([-z, np.zeros_like(x), x], axis=1) / np.hypot(x, z)[:, None]
    along = directions(ring, "bottom", "top")
    assert_allclose(np.linalg.norm(along, axis=1), 1, atol=1e-12)
    assert np.einsum("ij,ij->i", along, around).min() > np.cos(np.radians(5))


def test_where_all_is_attached_by_one_bone_fibres_take_the_mean_direction() -> None:
    # The lowest layer of tets has all its corners on "bottom": the field has no slope there.
    bar = _bar()
    low = bar.points[bar.tets][:, :, 2].max(axis=1) < 6
    faces, _ = boundary(bar.tets)
    attached = TetMesh(
        bar.points,
        bar.tets,
        bar.facets | {"bottom": np.concatenate([faces, bar.tets[low][:, :3], bar.tets[low][:, 1:]])},
    )
    attached = TetMesh(
        bar.points,
        bar.tets,
        {
            "bottom": attached.facets["bottom"][(bar.points[attached.facets["bottom"]][:, :, 2] < 6).all(axis=1)],
            "top": bar.facets["top"],
        },
    )
    found = directions(attached, "bottom", "top")
    assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-9)
    assert found[low][:, 2].min() > 0.9


def test_nearest_directions_are_those_of_the_nearest_line() -> None:
    # One line along x low in the bar, one along y high in it; the ends of the first and the start of the second are no segment.
    lines = Polylines(np.array([[0.0, 10, 5], [20, 10, 5], [10, 0, 55], [10, 20, 55]]), np.array([0, 2, 4]))
    points = _bar().points[_bar().tets].mean(axis=1)
    found = NearestLine(lines)(np.arange(len(points)), points)
    heights = points[:, 2]
    assert_allclose(found[heights < 25], np.tile([1.0, 0, 0], ((heights < 25).sum(), 1)))
    assert_allclose(found[heights > 35], np.tile([0, 1.0, 0], ((heights > 35).sum(), 1)))


@pytest.mark.parametrize(
    "of", [fibre_field(_bar(2), "bottom", "top"), NearestLine(Polylines(np.eye(3), np.array([0, 3])))]
)
def test_other_processes_get_the_same_directions(of) -> None:
    points = np.array([[3.0, 4, 5], [10, 10, 30]])
    cells = np.zeros(2, int)
    before = of(cells, points)
    assert_array_equal(pickle.loads(pickle.dumps(of))(cells, points), before)
    assert_array_equal(of(cells, points), before)
