"""Overlap at the start of parts that may touch, of boxes by their corners, however fine their facets are."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

import fem_reference as fr
from fem_reference.foundations.mesh import Surface
from fem_reference.problems.body import Cells
from fem_reference.problems.overlaps import overlap, through_itself

LAW = fr.Touching("low_z1", "high_z0", 2.0, 0.1)


def moved(mesh: Cells, *by: float) -> Cells:
    return replace(mesh, points=mesh.points + by)


def depth(low: Cells, high: Cells) -> float:
    body = fr.Body(fr.joined({"low": low, "high": high}), (), (), (0.0, 1.0), touching=(LAW,))
    away = moved(body.mesh, 3.0, 0.0, 0.0)
    there = replace(body, mesh=away, start=lambda points: points - [3.0, 0.0, 0.0])
    assert overlap(there, LAW) == pytest.approx(overlap(body, LAW), abs=1e-12)
    return overlap(body, LAW)


@pytest.mark.parametrize(
    ("kind", "degree"), [("tetrahedron", 1), ("hexahedron", 1), ("tetrahedron", 2), ("hexahedron", 2)]
)
@pytest.mark.parametrize("deep", [-0.2, 0.0, 0.05, 0.15])
def test_boxes_of_fine_facets_overlap_by_what_they_are_pushed(kind, degree, deep) -> None:
    """Their middles are 0.2 mm from the sides, farther than they overlap."""
    low, high = (fr.box(counts, (0.4, 0.4, 0.5), kind, degree) for counts in ((4, 4, 2), (4, 4, 2)))
    assert depth(low, moved(high, 0.0, 0.0, 0.5 - deep)) == pytest.approx(max(deep, 0.0), abs=1e-12)


def test_a_box_within_another_overlaps() -> None:
    # No facets cross: corners at the bottom of the small one are 0.2 mm above that of the large one.
    low, high = fr.box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron"), fr.box((1, 1, 1), (0.2, 0.2, 0.2), "tetrahedron")
    assert depth(low, moved(high, 0.4, 0.4, 0.2)) == pytest.approx(0.2, abs=1e-12)


def test_sheets_that_cross_without_a_corner_inside_overlap() -> None:
    # The upper one stands on an edge: its part, the lower side, cuts the lower one's. Of it 0.3 mm are below z = 0,
    # 0.32 mm below the upper side there.
    low = fr.box((1, 1, 1), (1.0, 1.0, 0.02), "hexahedron")
    turn = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    high = fr.box((1, 1, 1), (1.0, 0.6, 0.02), "hexahedron")
    assert depth(low, replace(high, points=high.points @ turn + [0.5, 0.2, -0.3])) == pytest.approx(0.32, abs=1e-12)


def test_curved_facets_count_less_their_bulge() -> None:
    # The middles of edges at the bottom are raised by 0.05 mm: no corner says where the facets are.
    low, high = (fr.box((2, 2, 1), (0.4, 0.4, 0.5), "tetrahedron", 2) for _ in range(2))
    bent = np.array(high.points)
    bent[:, 2] += 0.05 * np.isclose(bent[:, 0] / 0.2 % 1, 0.5) * (bent[:, 2] < 0.1)
    assert depth(low, moved(replace(high, points=bent), 0.0, 0.0, 0.35)) == pytest.approx(0.15 - 0.05, abs=1e-12)


@pytest.mark.parametrize("deep", [0.15, 0.25])
def test_parts_of_one_overlap_by_what_they_are_pushed(deep) -> None:
    """As two parts do, however small the facets are; and a part by its depth in all of the skin."""
    low, high = (fr.box((4, 4, 4), (0.4, 0.4, 0.5), "tetrahedron") for _ in range(2))
    mesh = fr.joined({"low": low, "high": moved(high, 0.01, 0.02, 0.5 - deep)})
    facets = np.concatenate([mesh.facets[f"{name}_{face}"] for name in ("low", "high") for face in low.facets])
    for part in (facets, mesh.facets["high_z0"]):
        body = fr.Body(replace(mesh, facets={"part": part}), (), (), (0.0, 1.0))
        assert overlap(body, fr.Touching("part", "part", 2.0, 0.1)) == pytest.approx(deep, abs=1e-9)


def test_a_surface_is_through_itself_by_what_it_was_pushed_since_rest() -> None:
    cube = shapes.skin(shapes.box((3, 3, 3), (2.0, 2.0, 2.0)))
    count, apart = len(cube.points), cube.points + [0.3, 0.2, 2.1]
    rest = Surface(np.concatenate([cube.points, apart]), np.concatenate([cube.triangles, cube.triangles + count]))
    upper = (np.arange(2 * count) >= count)[:, None]
    for push, deep in ((0.0, 0.0), (0.3, 0.2), (0.8, 0.7)):
        now = rest.moved_to(rest.points - push * upper * [0, 0, 1.0])
        assert through_itself(now, rest)[0] == pytest.approx(deep, abs=1e-9)
        assert through_itself(now, now)[0] == 0
