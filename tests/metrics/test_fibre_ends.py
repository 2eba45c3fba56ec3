"""Ends of fibres off their bones: known displacements, with the run's own fibres and with those that its surface carries."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.assessment.judge import judge
from fem_reference.foundations.motion import apply
from fem_reference.metrics import Measure, MeasurementContext, at_rest, context_of, measure
from fem_reference.metrics.fibre_length import lengths_at
from fem_reference.runs.store import Outcome, Run
from tests.problems.test_fibre_ends import BAR, BOTTOM, TOP, TURN, lines, setup

FIBRES = lines(([2, 2, 0], [2, 2, 50]), ([7, 5, 0], [7, 5, 50]))
SETUP = setup(("bottom", 0, BOTTOM), ("top", 2, TOP))


def moved(points: np.ndarray) -> np.ndarray:
    """The points turned with the upper bone."""
    return apply(TURN.pose(10), points)


RUN = Run(
    name="run",
    solver="recorded",
    outcome=Outcome("converged", ""),
    numbers=(0, 10),
    surface=BAR,
    positions=np.stack([BAR.points, moved(BAR.points)]),
    fibres=FIBRES,
    fibre_positions=np.stack([FIBRES.points, moved(FIBRES.points)]),
)
CONTEXT = context_of(SETUP, RUN)


def ends(run: Run, context: MeasurementContext = CONTEXT) -> tuple[Measure, ...]:
    return measure(run, RUN, context, ["fibre_ends"])


@pytest.mark.parametrize("interior", [True, False])
def test_a_body_that_turns_with_one_bone_leaves_the_other(interior: bool) -> None:
    """By a quarter turn about the line y = 0, z = 50, from which the lower ends are sqrt(y^2 + 50^2) away: a chord of sqrt(2) of
    that. Upper ends are where their bone takes them.
    """
    run = RUN if interior else replace(RUN, fibres=None, fibre_positions=None)
    mean, worst = ends(run)
    chords = np.sqrt(2 * (np.array([2.0, 5.0]) ** 2 + 50**2))
    assert_allclose(mean.values, [0, chords.sum() / 4], atol=1e-9)
    assert_allclose(worst.values, [0, chords.max()], atol=1e-9)
    assert (mean.unit, worst.unit, worst.where[1]) == ("mm", "mm", "first end of fibre 1, which belongs to bottom")


def test_ends_that_go_with_their_bones_are_at_them_whatever_happens_between() -> None:
    points = moved(FIBRES.points)
    points[[0, 3]] = FIBRES.points[[0, 3]]
    for one in ends(replace(RUN, fibre_positions=np.stack([FIBRES.points, points]))):
        assert np.abs(one.values).max() < 1e-9


def test_an_end_beside_its_bone_is_off_by_what_it_lacks() -> None:
    """2 mm of one end of four."""
    points = moved(FIBRES.points)
    points[[0, 3]] = FIBRES.points[[0, 3]]
    points[5] += [0, 1.2, 1.6]
    mean, worst = ends(replace(RUN, fibre_positions=np.stack([FIBRES.points, points])))
    assert_allclose((mean.values[1], worst.values[1]), (0.5, 2), rtol=1e-9)
    assert worst.where[1] == "last end of fibre 1, which belongs to top"


def test_a_run_whose_fibres_begin_elsewhere_is_measured_from_there() -> None:
    off = np.array([0.3, 0, 0])
    run = replace(RUN, fibres=replace(FIBRES, points=FIBRES.points + off), fibre_positions=RUN.fibre_positions + off)
    assert_allclose(ends(run)[1].values, ends(RUN)[1].values, atol=1e-9)
    # A candidate with other fibres of its own has those that its surface carries.
    other = lines(([2, 2, 0], [2, 2, 50]))
    strange = replace(RUN, fibres=other, fibre_positions=np.stack([other.points + 5.0] * 2))
    assert_allclose(ends(strange)[1].values, ends(RUN)[1].values, atol=1e-9)


@pytest.mark.parametrize("interior", [True, False])
def test_a_fibre_with_a_tendon_is_as_long_as_both(interior: bool) -> None:
    """The second fibre of two, 40 mm, ends 10 mm below the top; its tendon goes from there to (7, 5, 70), which turns by a right
    angle to (7, -20, 55), while the body stays: from 30 to sqrt(25^2 + 15^2) mm.
    """
    given = lines(([2, 2, 0], [2, 2, 50]), ([7, 5, 0], [7, 5, 40]))
    tied = replace(SETUP, attached=(SETUP.attached[0], replace(SETUP.attached[1], tendon=np.array([7.0, 5, 70]))))
    still = replace(
        RUN, positions=np.stack([BAR.points] * 2), fibres=given, fibre_positions=np.stack([given.points] * 2)
    )
    known = context_of(tied, still)
    assert known.ends is not None
    pull = np.sqrt(25**2 + 15**2) - 30
    run = still if interior else replace(still, fibres=None, fibre_positions=None)
    from_rest = {one.statistic: one.values for one in measure(run, at_rest(run), known, ["fibre_length"])}
    assert_allclose(from_rest["mean"], [0, pull / 2], atol=1e-9)
    assert_allclose(from_rest["max_percent"], [0, 100 * abs(pull) / 70], atol=1e-9)
    assert_allclose(lengths_at(given.points, 0, known), [50, 70], rtol=1e-12)
    # Against a run with the same bones nothing is different.
    for one in measure(run, still, known, ["fibre_length"]):
        assert_allclose(one.values, 0, atol=1e-9)


def test_a_muscle_without_attachments_has_none() -> None:
    assert ends(RUN, context_of(setup(), RUN)) == ()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_a_number_never_passes(bad: float) -> None:
    points = np.array(RUN.fibre_positions)
    points[1, 0] = bad
    for one in ends(replace(RUN, fibre_positions=points)):
        assert judge(float(one.values[1]), 0.0, 1e6) == "fail"
        assert one.worst.frame == 10
