"""The ends of fibres: distances from attached areas in closed form, and the bones that they belong to."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems.fibre_ends import FibreEnds, attached_ends, completed, ends_of, facts_of
from fem_reference.problems.setup import AttachedVertices, Bone, Setup

BAR = shapes.skin(shapes.box((2, 2, 5), (10.0, 10.0, 50.0)))
AWAY = shapes.sphere(1)
LIFT = RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 20.0))
TURN = RigidMotion((1, 0, 0), (0.0, 0.0, 50.0), (0.0, 10.0), (0.0, np.pi / 2))
BONES = (Bone("low", AWAY, None), Bone("high", AWAY, LIFT), Bone("turning", AWAY, TURN))


def setup(*attached: tuple[str, int, np.ndarray]) -> Setup:
    entries = tuple(
        AttachedVertices(name, BONES[bone], np.flatnonzero(mask), None if bone else 0.1)
        for name, bone, mask in attached
    )
    return Setup(BAR, BONES, entries, (0, 10), None)


def ends_of_setup(given: Setup, fibres: Polylines) -> FibreEnds | None:
    return attached_ends(given.attached, given.exempt, fibres)


BOTTOM, TOP = BAR.points[:, 2] == 0, BAR.points[:, 2] == 50
SIDE = (BAR.points[:, 0] == 0) & (BAR.points[:, 2] == 10)


def lines(*ends: tuple[list[float], list[float]]) -> Polylines:
    """Straight lines of three points."""
    points = [np.linspace(first, last, 3) for first, last in ends]
    return Polylines(np.concatenate(points), 3 * np.arange(len(ends) + 1))


def test_distances_are_to_the_attached_area_and_not_to_its_vertices() -> None:
    """The first line ends in the middle of a facet, 3.5 mm from its vertices; the second 3 mm below the top, 4 mm beside it."""
    found = ends_of_setup(
        setup(("bottom", 0, BOTTOM), ("top", 1, TOP)), lines(([2, 2, 0], [2, 2, 50]), ([5, 5, 1], [14, 5, 47]))
    )
    assert found is not None
    assert_allclose(found.distance, [[0, 0], [1, 5]], atol=1e-12)
    assert found.by.tolist() == [[0, 1], [0, 1]]
    assert found.named(1, 1) == "last end of fibre 1, which belongs to top"
    assert {name: one for name, one in found.facts.items() if "covered" not in name} == {
        "fibre_ends": 4.0,
        "fibre_ends_beside": 1.0,
        "fibre_end_farthest_mm": 5.0,
        "fibre_ends_not_attached": "last end of fibre 1, which belongs to top: 5.0 mm from the attached area",
    }


def test_a_line_either_way_round_belongs_to_the_same_attachments() -> None:
    found = ends_of_setup(setup(("bottom", 0, BOTTOM), ("top", 1, TOP)), lines(([2, 2, 50], [2, 2, 0])))
    assert found is not None
    assert found.by.tolist() == [[1, 0]]
    assert "fibre_end_farthest_mm" not in found.facts


def test_a_short_fibre_belongs_to_two_bones() -> None:
    """Both ends are nearer to the bottom: the upper one is 20 mm from it and 30 mm below the top, which it belongs to."""
    found = ends_of_setup(setup(("bottom", 0, BOTTOM), ("top", 1, TOP)), lines(([5, 5, 0], [5, 5, 20])))
    assert found is not None
    assert found.by.tolist() == [[0, 1]]
    assert_allclose(found.distance, [[0, 30]], atol=1e-12)


def test_on_one_bone_alone_each_end_belongs_to_the_nearest() -> None:
    found = ends_of_setup(setup(("bottom", 0, BOTTOM), ("beside", 0, TOP)), lines(([5, 5, 0], [5, 5, 20])))
    assert found is not None
    assert found.by.tolist() == [[0, 0]]
    assert_allclose(found.distance, [[0, 20]], atol=1e-12)


def test_an_end_covers_what_is_nearer_than_the_mean_spacing() -> None:
    """One line: 10 mm, the root of the area. From the middle that is all, from a corner a quarter of a disc; triangles count by
    their middles, which is off by less than a twentieth where they are 2.5 mm wide. An attachment without an end has nothing.
    """
    found = ends_of_setup(
        setup(("bottom", 0, BOTTOM), ("top", 1, TOP), ("side", 1, SIDE)), lines(([5, 5, 0], [0, 0, 50]))
    )
    assert found is not None
    assert_allclose(found.covered, [1, np.pi / 4, 0], rtol=0.05)
    assert found.facts["top_covered_percent"] == 100 * found.covered[1]


def test_single_vertices_attach_half_of_the_edges_around_them() -> None:
    """Those of the side have 5 of the 10 mm up to the next: the line ends 3 mm beside the edge, 4 mm above a vertex."""
    found = ends_of_setup(setup(("bottom", 0, BOTTOM), ("side", 1, SIDE)), lines(([5, 5, 0], [3, 5, 14])))
    assert found is not None
    assert_allclose(found.distance, [[0, 3]], atol=1e-12)


def with_tendon(point: list[float]) -> Setup:
    """The bar whose upper attachment has a tendon to a ``point`` of the bone that is lifted."""
    given = setup(("bottom", 0, BOTTOM), ("top", 1, TOP))
    top = replace(given.attached[1], tendon=np.array(point))
    return replace(given, attached=(given.attached[0], top))


def test_an_end_beside_its_attachment_goes_on_by_the_tendon_of_it() -> None:
    """From (14, 5, 47) to (14, 9, 50), 5 mm; lifted by 10 mm, and the end by 1: from (14, 5, 48) to (14, 9, 60), sqrt(160)."""
    given = lines(([2, 2, 0], [2, 2, 50]), ([5, 5, 0], [14, 5, 47]))
    found = ends_of_setup(with_tendon([14, 9, 50]), given)
    assert found is not None
    assert not found.beside.any()
    assert (found.facts["fibre_ends_beside"], found.facts["fibre_ends_continued"]) == (0, 1)
    assert_allclose(found.beyond(ends_of(given), 0), [0, 5], rtol=1e-12)
    # 50 mm without a tendon, and one of sqrt(9 x 9 + 47 x 47) mm with one of 5 mm.
    assert_allclose(facts_of(given, found)["fibre_length_mean_mm"], (50 + np.sqrt(2290) + 5) / 2, rtol=1e-12)
    moved = ends_of(given) + [0, 0, 1]
    assert_allclose(found.beyond(moved, 5), [0, np.sqrt(160)], rtol=1e-12)
    named = "last end of fibre 1, which continues to top as a tendon: 5.0 mm from the attached area"
    assert found.facts["fibre_ends_continued_by"] == named
    # 1 mm off the bone that rests, 9 mm off the bone that is lifted by 10, by a tendon or not.
    assert_allclose(found.off(moved, ends_of(given), 5), [[1, 9], [1, 9]], rtol=1e-12)
    lost = np.where(np.arange(3) == 0, np.nan, moved)
    assert np.isnan(found.off(lost, ends_of(given), 5)).all()
    assert np.isnan(found.beyond(lost, 5)).tolist() == [False, True]


def test_fibres_are_completed_to_the_closest_point_of_their_attachment() -> None:
    """At both ends, in steps of 2 mm or less; what reaches stays."""
    given = lines(([2, 2, 1], [2, 2, 49]), ([14, 5, 3], [8, 3, 40]))
    bar = setup(("bottom", 0, BOTTOM), ("top", 1, TOP))
    found = ends_of_setup(bar, given)
    assert found is not None
    assert found.beside.tolist() == [[False, False], [True, True]]
    whole = completed(given, found)
    assert_allclose(whole.points[:3], given.points[:3])
    second = whole.points[3:]
    assert_allclose(second[[0, -1]], [[10, 5, 0], [8, 3, 50]], atol=1e-12)
    assert_allclose(second[3:6], given.points[3:])
    assert np.linalg.norm(np.diff(second, axis=0), axis=1)[[0, 1, 2, 5, 6, 7, 8, 9]].max() < 2 + 1e-9
    assert_allclose(whole.lengths()[1], 5 + given.lengths()[1] + 10, rtol=1e-12)
    again = ends_of_setup(bar, whole)
    assert again is not None
    assert again.distance.max() <= 1 + 1e-9
    # With a tendon the last end goes on to the bone instead.
    tied = ends_of_setup(with_tendon([0, 0, 60]), given)
    assert tied is not None
    assert tied.beside.tolist() == [[False, False], [True, False]]


def test_without_attachments_there_is_nothing_to_reach() -> None:
    given = lines(([0, 0, 0], [0, 0, 9]))
    assert ends_of_setup(setup(), given) is None
    assert facts_of(given, None) == {"fibre_length_mean_mm": 9.0}


def test_bones_take_their_ends_along() -> None:
    given = lines(([5, 5, 0], [5, 5, 50]), ([5, 5, 0], [0, 7, 50]))
    found = ends_of_setup(setup(("bottom", 0, BOTTOM), ("top", 2, TOP)), given)
    assert found is not None
    assert_allclose(found.taken(ends_of(given), 0), ends_of(given))
    # A quarter turn about x through (0, 0, 50): +y becomes +z.
    assert_allclose(found.taken(ends_of(given), 10), [[[5, 5, 0], [5, 0, 55]], [[5, 5, 0], [0, 0, 57]]], atol=1e-12)
    raised = ends_of_setup(setup(("bottom", 0, BOTTOM), ("top", 1, TOP)), given)
    assert raised is not None
    assert_allclose(raised.taken(ends_of(given), 5)[:, 1], ends_of(given)[:, 1] + [0, 0, 10])


@pytest.mark.parametrize("wrong", [0, 1])
def test_ends_are_the_first_and_last_points(wrong: int) -> None:
    given = Polylines(np.arange(15.0).reshape(5, 3), np.array([0, 2, 5]))
    assert_allclose(ends_of(given), given.points[[[0, 1], [2, 4]]])
    assert_allclose(ends_of(given, given.points + wrong), given.points[[[0, 1], [2, 4]]] + wrong)
