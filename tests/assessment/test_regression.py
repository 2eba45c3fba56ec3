"""A candidate is checked against its own past and against the reference: what is noticed, and what is not compared with it."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from balls import BAR, REFERENCE, REST, SCENE, SETUP, SHIFTS, asked, bars, checked, current, edited, run

from fem_reference.assessment import baseline, regression
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import Measure


def measured(values) -> tuple[Measure, ...]:
    return (Measure("volume", "deviation", "%", np.array(values)),)


@pytest.fixture
def path(tmp_path):
    """A baseline, made where the reference has an error bar of 0.5 of everything."""
    file = tmp_path / "new" / "ball.json"
    baseline.update(file, current(known=bars()))
    return file


def test_the_same_run_passes(path) -> None:
    check = checked(path, current(known=bars()))
    assert {one.word for one in check.judgements} == {"pass"}
    assert check.word == "pass"
    assert check.notes == ()


def test_one_frame_that_is_moved_by_2_mm_fails_at_that_frame(path) -> None:
    shifts = np.array(SHIFTS, float)
    shifts[1] += [0, 2, 0]
    check = checked(path, current(shifts, bars()))
    moved = check.judgements[0]  # the worst first, and positions before all
    assert (check.word, moved.name, moved.word, moved.frame) == ("fail", "positions.moved", "fail", 10)
    # But for the rounding of positions in the file.
    assert moved.current == pytest.approx(2, abs=baseline.POSITION_ROUNDING)
    assert "2" in moved.why
    assert "mm from the baseline, 0.1 mm allowed" in moved.why


def test_a_baseline_whose_positions_are_too_far_away_to_have_squares_fails(path) -> None:
    table = json.loads(path.read_text(encoding="utf-8"))
    table["positions"]["values"][1][0][0] = 1e300
    path.write_text(json.dumps(table), encoding="utf-8")
    moved = checked(path, current(known=bars())).judgements[0]
    assert (moved.name, moved.word, moved.current) == ("positions.moved", "fail", math.inf)


def test_a_frame_that_deviates_as_much_as_before_but_elsewhere_fails(path) -> None:
    # 12 mm aside in another direction: a chord of 2 mm of the circle around the reference.
    angle = 2 * math.asin(1 / 12)
    check = checked(path, current([*SHIFTS[:2], (12 * math.cos(angle), 12 * math.sin(angle), 10)], bars()))
    assert asked(check, "unchanged", "surface_deviation.rms").word == "pass"
    assert asked(check, "unchanged", "surface_deviation.max").word == "pass"
    moved = asked(check, "unchanged", "positions.moved")
    assert (moved.word, moved.frame) == ("fail", 20)
    assert moved.current == pytest.approx(2, abs=baseline.POSITION_ROUNDING)
    assert asked(check, "within", "surface_deviation.rms").word == "pass"


def test_one_sampled_vertex_that_moves_shows_in_full(path) -> None:
    now = current(known=bars())
    vertex = baseline.read(path, SCENE, "mine").positions.vertices[1]
    positions = np.array(now.candidate.positions)
    positions[1, vertex] += [0, 0.6, -0.8]
    moved = asked(
        checked(path, replace(now, candidate=replace(now.candidate, positions=positions))),
        "unchanged",
        "positions.moved",
    )
    assert (moved.word, moved.frame) == ("fail", 10)
    assert moved.current == pytest.approx(1, abs=baseline.POSITION_ROUNDING)


def test_a_vertex_that_moves_between_the_sampled_ones_shows_in_the_statistics(path) -> None:
    now = current(known=bars())
    sampled = baseline.read(path, SCENE, "mine").positions.vertices
    vertex = next(vertex for vertex in range(len(REST.points)) if vertex not in sampled)
    positions = np.array(now.candidate.positions)
    positions[1, vertex] += 2 * REST.points[vertex] / np.linalg.norm(REST.points[vertex])
    bumped = CurrentMeasures.of(SCENE, SETUP, replace(now.candidate, positions=positions), REFERENCE, bars())
    check = checked(path, bumped)
    assert asked(check, "unchanged", "positions.moved").word == "pass"
    assert asked(check, "unchanged", "volume.deviation").word == "fail"
    assert "no sampled vertex moved, but measures changed" in check.notes[0]


def test_a_statistic_worse_by_more_than_its_tolerance_fails_at_the_frame_that_is_worst(path) -> None:
    edited(path, lambda table: table["measures"]["surface_deviation.rms"].update(tolerance=0.3))
    check = checked(path, current([SHIFTS[0], (6.2, 0, 5), (12.4, 0, 10)], bars()))
    rms = asked(check, "unchanged", "surface_deviation.rms")
    assert (rms.word, rms.frame, rms.was) == ("fail", 20, 12.0)
    assert rms.current == pytest.approx(12.4)
    assert rms.used == pytest.approx(0.4 / 0.3)
    check = checked(path, current([SHIFTS[0], (6.2, 0, 5), (12.2, 0, 10)], bars()))
    assert asked(check, "unchanged", "surface_deviation.rms").word == "pass"


def test_nothing_is_said_where_the_bar_reaches_both_sides_of_what_is_allowed(path) -> None:
    name = "surface_deviation.rms"  # 12 mm at frame 20
    for within, word in (
        (0.9, "fail"),
        (12 - 1.01 * BAR, "fail"),
        (12 - 0.99 * BAR, "inconclusive"),
        (12 + 1.01 * BAR, "pass"),
    ):
        edited(path, lambda table, within=within: table["measures"][name].update(within=within))
        check = checked(path, current(known=bars()))
        judged = asked(check, "within", name)
        assert (judged.word, check.word, check.answer("unchanged")) == (word, word, "pass")
    assert (judged.frame, judged.known) == (20, BAR)
    edited(path, lambda table: table["measures"][name].update(within=12.1))
    why = asked(checked(path, current(known=bars())), "within", name).why
    assert (
        why
        == "the distance, 12 mm, differs from the allowed 12.1 mm by less than the error bar of the reference, 0.5 mm"
    )


def test_an_edited_tolerance_below_rounding_says_nothing(path) -> None:
    edited(path, lambda table: table["positions"].update(tolerance=0.001))
    moved = asked(checked(path, current(known=bars())), "unchanged", "positions.moved")
    assert moved.word == "inconclusive"
    assert "the error bar of the baseline, 0.00866 mm" in moved.why


def test_without_error_bars_the_past_is_judged_and_the_truth_is_not(tmp_path) -> None:
    path = tmp_path / "ball.json"
    baseline.update(path, current())
    check = checked(path, current())
    assert (check.answer("unchanged"), check.answer("within"), check.word) == ("pass", "inconclusive", "inconclusive")
    assert "--error-bar measures it" in asked(check, "within", "surface_deviation.rms").why
    # What is said of the run itself is known without them.
    assert asked(check, "within", "penetration.deepest").word == "pass"
    known = current(known=bars())
    assert "--update adds it" in asked(checked(path, known), "within", "surface_deviation.rms").why
    baseline.update(path, known)
    assert checked(path, known).word == "pass"


def test_what_comes_nearer_to_the_reference_is_within_and_has_changed(path) -> None:
    check = checked(path, current([*SHIFTS[:2], (9, 0, 10)], bars()))
    assert (check.answer("within"), check.answer("unchanged")) == ("pass", "fail")


@pytest.mark.parametrize("none", [math.nan, math.inf])
def test_a_number_that_does_not_exist_passes_nothing(tmp_path, none) -> None:
    path, one, name = tmp_path / "ball.json", [0.0, 1.0, 1.0], "volume.deviation"
    gap = current(known=bars(), measures=measured([0.0, none, 1.0]))
    baseline.update(path, gap)
    assert json.loads(path.read_text())["measures"][name]["values"] == [0.0, None, 1.0]
    for question in ("unchanged", "within"):
        same = asked(checked(path, gap), question, name)
        assert (same.word, same.why) == ("inconclusive", "there is no number now, and there was none before")
    appeared = asked(checked(path, current(known=bars(), measures=measured(one))), "unchanged", name)
    assert (appeared.word, appeared.why) == ("fail", "there is a number now, and there was none before")
    baseline.update(path, current(known=bars(), measures=measured(one)))
    for lost in (gap, current(known=bars(), measures=())):
        for question in ("unchanged", "within"):
            judged = asked(checked(path, lost), question, name)
            assert (judged.word, judged.why, judged.used) == ("fail", "there is no number now", math.inf)


def test_notes_say_what_else_is_different(path) -> None:
    edited(path, lambda table: table.update(reference="fenicsx-1", fem_reference="0.0.1"))
    other = replace(REFERENCE, positions=REFERENCE.positions + [3.0, 0, 0])
    check = regression.check(
        baseline.read(path, SCENE, "mine"), CurrentMeasures.of(SCENE, SETUP, run("mine", SHIFTS), other, bars())
    )
    assert "measured by fem_reference" in check.notes[0]
    assert check.notes[1] == "the reference is test, but the reference of the baseline was fenicsx-1"
    assert "no sampled vertex moved, but measures changed" in check.notes[2]


def test_a_vertex_that_is_not_there_is_named(path) -> None:
    edited(path, lambda table: table["positions"]["vertices"].__setitem__(0, 9999))
    with pytest.raises(InputError, match=r"baseline: positions.vertices: got 9999, want 0 to"):
        checked(path, current())
