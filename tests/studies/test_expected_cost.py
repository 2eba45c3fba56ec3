"""The time that a reference is expected to take: as measured, in proportion to frames, more than that to unknowns."""

import pytest

import fem_reference as fr
from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx import resources
from fem_reference.studies import expected_cost


def body(count: int, frames: tuple[float, ...] = (0.0, 1.0)) -> Body:
    """A cube of ``count`` cells along each edge, each cut into tetrahedra."""
    cells = fr.box((count,) * 3, (10.0, 10.0, 10.0), "tetrahedron")
    return fr.Body(cells, (fr.make_effect("neo_hooke", mu=0.01),), (), frames=frames)


def test_one_frame_of_what_was_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four iterations of 0.13 s with 5456 unknowns."""
    monkeypatch.setattr(resources, "unknowns", lambda *_: 5456)
    assert expected_cost.seconds(body(1), "P2/P1") == pytest.approx(0.52)


def test_each_frame_after_the_first_takes_as_long() -> None:
    one = expected_cost.seconds(body(2), "P2/P1")
    assert expected_cost.seconds(body(2, (0.0, 1.0, 2.0, 5.0)), "P2/P1") == pytest.approx(3 * one)


def test_more_unknowns_take_more_than_in_proportion() -> None:
    """And less than with their square, on smaller cells and in richer elements alike."""
    for (few, element), (many, other) in (((2, "P2/P1"), (4, "P2/P1")), ((3, "P1/P1"), (3, "P2/P1"))):
        small, large = body(few), body(many)
        ratio = resources.unknowns(large.mesh, other) / resources.unknowns(small.mesh, element)
        longer = expected_cost.seconds(large, other) / expected_cost.seconds(small, element)
        assert ratio < longer < ratio**2
