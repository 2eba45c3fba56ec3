"""A candidate is checked against its own past and against the reference: what is noticed, and what is not compared with it."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
import shapes

from fem_reference import metrics
from fem_reference.assessment import baseline, regression
from fem_reference.assessment.baseline import Limits
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.assessment.measured import CurrentMeasures, sample
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import Measure
from fem_reference.problems.setup import Setup
from fem_reference.report import regression_texts
from fem_reference.runs.store import Outcome, Run

# On the digits of a baseline, so that nothing is rounded.
REST = shapes.sphere(2, 30.0).moved_to(np.round(shapes.sphere(2, 30.0).points, 2))
FIBRE = Polylines(np.array([[0.0, 0, -15], [0, 0, 15]]), np.array([0, 2]))
NUMBERS = (0, 10, 20)
SETUP = Setup(REST, (), (), NUMBERS, None)
SCENE = SimpleNamespace(name="ball", key="0123456789abcdef0123", place="case.toml", numbers=NUMBERS)
BAR = 0.5


def run(name: str, shifts) -> Run:
    """A ball that is moved by ``shifts`` (f, 3) [mm]."""
    positions = REST.points + np.asarray(shifts, float)[:, None]
    inside = FIBRE.points + np.asarray(shifts, float)[:, None]
    return Run(name, "test", Outcome("converged", "done"), NUMBERS, REST, positions, FIBRE, inside)


REFERENCE = run("reference", [(0, 0, 0), (0, 0, 5), (0, 0, 10)])
# 12 mm aside of the reference at the last frame.
SHIFTS = [(0, 0, 0), (6, 0, 5), (12, 0, 10)]


def bars(value: float = BAR) -> ErrorBars:
    """The same error bar for every statistic of a deviation, but none in the first frame."""
    made = [
        ErrorBar("deviation", *name.split("."), unit, value * np.array([0.0, 1, 1]), {})
        for name, unit in metrics.units().items()
        if not metrics.of_itself(name.split(".")[0])
    ]
    return ErrorBars(NUMBERS, (4.0, 8.0), 1.5, tuple(made))


def current(shifts=SHIFTS, known: ErrorBars | None = None, **changes) -> CurrentMeasures:
    return replace(CurrentMeasures.of(SCENE, SETUP, run("mine", shifts), REFERENCE, known), **changes)


def edited(path, change) -> None:
    table = json.loads(path.read_text())
    change(table)
    path.write_text(json.dumps(table))


def checked(path, now: CurrentMeasures) -> regression.Check:
    return regression.check(baseline.read(path, SCENE, "mine"), now)


def asked(check: regression.Check, question: str, name: str) -> regression.Judgement:
    (found,) = (one for one in check.judgements if (one.question, one.name) == (question, name))
    return found


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
    assert "mm from what it was, 0.1 mm allowed" in moved.why


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
    assert "no sampled vertex moved and yet measures changed" in check.notes[0]


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
    assert why == "the reference has an error bar of 0.5 mm, and 12 mm is that near to the 12.1 mm allowed"


def test_an_edited_tolerance_below_rounding_says_nothing(path) -> None:
    edited(path, lambda table: table["positions"].update(tolerance=0.001))
    moved = asked(checked(path, current(known=bars())), "unchanged", "positions.moved")
    assert moved.word == "inconclusive"
    assert "the baseline has an error bar of 0.00866 mm" in moved.why


def test_without_error_bars_the_past_is_judged_and_the_truth_is_not(tmp_path) -> None:
    path = tmp_path / "ball.json"
    baseline.update(path, current())
    check = checked(path, current())
    assert (check.answer("unchanged"), check.answer("within"), check.word) == ("pass", "inconclusive", "inconclusive")
    assert "--error-bar measures it" in asked(check, "within", "surface_deviation.rms").why
    # What is said of the run itself is known without them.
    assert asked(check, "within", "penetration.deepest").word == "pass"
    known = current(known=bars())
    assert "--update does" in asked(checked(path, known), "within", "surface_deviation.rms").why
    baseline.update(path, known)
    assert checked(path, known).word == "pass"


def test_an_update_keeps_what_was_edited_so_that_accuracy_cannot_be_lost_in_small_steps(path) -> None:
    def edit(table) -> None:
        table["measures"]["surface_deviation.rms"] |= {"tolerance": 1.2, "within": 12.5}
        table["positions"]["tolerance"] = 5.0
        del table["measures"]["volume.deviation"]

    edited(path, edit)
    worse = current([*SHIFTS[:2], (13.1, 0, 10)], bars())
    assert asked(checked(path, worse), "unchanged", "surface_deviation.rms").word == "pass"
    made = baseline.update(path, worse)
    assert (made.measures["surface_deviation.rms"].tolerance, made.positions.tolerance) == (1.2, 5.0)
    check = checked(path, worse)
    assert check.answer("unchanged") == "pass"
    rms = asked(check, "within", "surface_deviation.rms")
    assert (rms.word, rms.allowed) == ("fail", 12.5)
    assert rms.why == "13.1 mm from the reference, 12.5 mm allowed"
    assert "not in the baseline and not judged: volume.deviation" in check.notes


def test_what_comes_nearer_to_the_reference_is_within_and_has_changed(path) -> None:
    check = checked(path, current([*SHIFTS[:2], (9, 0, 10)], bars()))
    assert (check.answer("within"), check.answer("unchanged")) == ("pass", "fail")


def measured(values) -> tuple[Measure, ...]:
    return (Measure("volume", "deviation", "%", np.array(values)),)


@pytest.mark.parametrize("none", [math.nan, math.inf])
def test_a_number_that_does_not_exist_passes_nothing(tmp_path, none) -> None:
    path, one, name = tmp_path / "ball.json", [0.0, 1.0, 1.0], "volume.deviation"
    gap = current(known=bars(), measures=measured([0.0, none, 1.0]))
    baseline.update(path, gap)
    assert json.loads(path.read_text())["measures"][name]["values"] == [0.0, None, 1.0]
    for question in ("unchanged", "within"):
        same = asked(checked(path, gap), question, name)
        assert (same.word, same.why) == ("inconclusive", "there is no number, and there was none")
    appeared = asked(checked(path, current(known=bars(), measures=measured(one))), "unchanged", name)
    assert (appeared.word, appeared.why) == ("fail", "there is a number now, and there was none")
    baseline.update(path, current(known=bars(), measures=measured(one)))
    for lost in (gap, current(known=bars(), measures=())):
        for question in ("unchanged", "within"):
            judged = asked(checked(path, lost), question, name)
            assert (judged.word, judged.why, judged.used) == ("fail", "there is no number now", math.inf)


def test_limits_of_a_new_baseline() -> None:
    one = Measure("volume", "deviation", "%", np.array([0.0, -20.0, 5.0]))
    # The bar where it is less than 2 % of 20; the greatest of value and bar.
    assert Limits.of(one, np.array([0.0, 0.1, 0.3])) == (0.3, 20.2)
    # 2 % of 20 where it is less than the bar.
    assert Limits.of(one, np.array([0.0, 0.1, 9.0])) == (0.4, 20.2)
    assert Limits.of(one, np.full(3, np.nan)) == (0.4, None)
    # Ten of the last digit where nothing deviates and everything is known.
    assert Limits.of(Measure("volume", "deviation", "%", np.zeros(3)), np.zeros(3)) == (0.001, 0.001)
    assert Limits.of(Measure("volume", "deviation", "%", np.full(3, np.nan)), np.zeros(3)) == (0.001, None)
    itself = Measure("penetration", "volume", "mm3", np.array([0.0, 100, 200]))
    assert Limits.of(itself, np.zeros(3)) == (4.0, 205.0)


def test_every_unit_has_its_digits() -> None:
    assert set(metrics.units({"surface", "lines"}).values()) <= set(baseline.PLACES)


def test_a_sample_spreads() -> None:
    line = np.stack([np.arange(101.0), np.zeros(101), np.zeros(101)], axis=1)
    # An end, the other, the middle, the quarters: each furthest from those before.
    assert sample(line, 5).tolist() == [0, 100, 50, 25, 75]
    assert sorted(sample(line[:3], 5)) == [0, 1, 2]


def test_a_change_of_one_frame_is_a_few_lines_of_the_file(path) -> None:
    before = path.read_text().splitlines()
    assert list(json.loads(path.read_text())) == sorted(json.loads(path.read_text()))
    shifts = np.array(SHIFTS, float)
    shifts[1] += [0, 2, 0]
    baseline.update(path, current(shifts, bars()))
    after = path.read_text().splitlines()
    assert len(before) == len(after)
    changed = [line for line, other in zip(after, before, strict=True) if line != other]
    # One of positions, and one of each statistic that changed.
    assert 1 < len(changed) < 10
    assert len(max(after, key=len)) < 2000


def test_a_run_of_lines_alone_is_checked_by_its_fibres(tmp_path) -> None:
    lines = replace(run("mine", SHIFTS), has_surface=False, positions=np.full((3, *REST.points.shape), np.nan))
    path, now = tmp_path / "ball.json", CurrentMeasures.of(SCENE, SETUP, lines, REFERENCE, bars())
    baseline.update(path, now)
    assert {name.split(".")[0] for name in json.loads(path.read_text())["measures"]} == {"fibre_length"}
    assert checked(path, now).word == "pass"
    assert lines.fibre_positions is not None
    aside = replace(now, candidate=replace(lines, fibre_positions=lines.fibre_positions + [0, 2, 0]))
    assert asked(checked(path, aside), "unchanged", "positions.moved").word == "fail"


def test_notes_say_what_else_is_different(path) -> None:
    edited(path, lambda table: table.update(reference="fenicsx-1", fem_reference="0.0.1"))
    other = replace(REFERENCE, positions=REFERENCE.positions + [3.0, 0, 0])
    check = regression.check(
        baseline.read(path, SCENE, "mine"), CurrentMeasures.of(SCENE, SETUP, run("mine", SHIFTS), other, bars())
    )
    assert "measured by fem_reference" in check.notes[0]
    assert check.notes[1] == "the reference is test, that of the baseline was fenicsx-1"
    assert "no sampled vertex moved and yet measures changed" in check.notes[2]


DAMAGE = {
    "half": (lambda path: path.write_text(path.read_text()[:100]), "want the baseline of a candidate"),
    "no table": (lambda path: path.write_text("[]"), "format: got no table, want 1"),
    "format": (lambda path: edited(path, lambda t: t.update(format=2)), "format: got 2, want 1"),
    "unknown key": (lambda path: edited(path, lambda t: t.update(more=2)), "baseline.more: got an unknown key"),
    "negative": (
        lambda path: edited(path, lambda t: t["positions"].update(tolerance=-1)),
        "baseline.positions.tolerance: got -1",
    ),
    "no statistic": (
        lambda path: edited(path, lambda t: t["measures"].update({"mass.sum": t["measures"]["volume.deviation"]})),
        "measures.mass.sum: got one in .*want a statistic that there is",
    ),
    "unit": (
        lambda path: edited(path, lambda t: t["measures"]["volume.deviation"].update(unit="mm")),
        'measures.volume.deviation: got one in "mm", want a statistic that there is, in %',
    ),
    "values": (
        lambda path: edited(path, lambda t: t["measures"]["volume.deviation"]["values"].pop()),
        "volume.deviation.values: got 2 values, want 3, one a frame",
    ),
    "positions": (
        lambda path: edited(path, lambda t: t["positions"]["values"][1].pop()),
        "positions.values: got another number of them, want 64 vertices in each of 3 frames",
    ),
    "case": (lambda path: edited(path, lambda t: t.update(case="cube")), 'case: got "cube", want "ball"'),
    "candidate": (lambda path: edited(path, lambda t: t.update(candidate="x")), 'candidate: got "x", want "mine"'),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_file_that_is_damaged_or_somebody_elses_is_neither_read_nor_written_over(path, what) -> None:
    damage, message = DAMAGE[what]
    damage(path)
    text = path.read_text()
    with pytest.raises(InputError, match=message):
        baseline.read(path, SCENE, "mine")
    with pytest.raises(InputError, match=message):
        baseline.check(path, SCENE, "mine")
    with pytest.raises(InputError, match=message):
        baseline.update(path, current())
    assert path.read_text() == text


def test_other_frames_are_reported(path) -> None:
    path.write_text(path.read_text().replace("[0, 10, 20]", "[0, 10, 30]"))
    with pytest.raises(InputError, match="frames: got 3 others, want the frame numbers of the scene"):
        baseline.read(path, SCENE, "mine")


def test_another_scene_wants_an_update(path, tmp_path) -> None:
    other = SimpleNamespace(name="ball", key="another", place="case.toml", numbers=NUMBERS)
    with pytest.raises(InputError, match=r"scene: got 0123456789abcdef\.\.\., while case.toml is another"):
        baseline.read(path, other, "mine")
    baseline.check(path, other, "mine")
    baseline.update(path, current(scene=other))
    assert baseline.read(path, other, "mine").scene == "another"
    with pytest.raises(InputError, match="got no file, want the baseline of a candidate"):
        baseline.read(tmp_path / "none.json", SCENE, "mine")


def test_a_vertex_that_is_not_there_is_named(path) -> None:
    edited(path, lambda table: table["positions"]["vertices"].__setitem__(0, 9999))
    with pytest.raises(InputError, match=r"baseline: positions.vertices: got 9999, want 0 to"):
        checked(path, current())


def test_a_reference_without_an_interior_is_refused() -> None:
    with pytest.raises(InputError, match="reference: fibres: got a run without an interior"):
        CurrentMeasures.of(SCENE, SETUP, run("mine", SHIFTS), replace(REFERENCE, fibres=None), None)


@pytest.fixture
def mixed(path) -> regression.Check:
    """A check with all three verdicts."""
    edited(path, lambda table: table["measures"]["fibre_length.rms"].update(within=0.1))
    return checked(path, current([*SHIFTS[:2], (15, 0, 10)], bars()))


def test_junit_has_a_case_for_each_judgement(mixed) -> None:
    suite = ElementTree.fromstring(regression_texts.junit(mixed, 1.25)).find("testsuite")
    cases = suite.findall("testcase")
    assert (suite.get("name"), suite.get("time"), suite.get("errors")) == ("ball.mine", "1.250", "0")
    assert int(suite.get("tests")) == len(cases) == len(mixed.judgements)
    assert int(suite.get("failures")) == len(suite.findall("testcase/failure")) == mixed.count("fail") > 0
    assert int(suite.get("skipped")) == len(suite.findall("testcase/skipped")) == mixed.count("inconclusive") == 1
    assert len({(case.get("classname"), case.get("name")) for case in cases}) == len(cases)
    assert cases[0].get("name").endswith(" within"), "what is worse comes before what is other"
    (moved,) = (case for case in cases if case.get("name") == "positions.moved unchanged")
    assert moved.find("failure").get("message") == "frame 20: 3 mm from what it was, 0.1 mm allowed"
    assert suite.find("system-out") is None


def test_notes_are_in_every_text(mixed) -> None:
    noted = replace(mixed, notes=("a | b",))
    assert ElementTree.fromstring(regression_texts.junit(noted, 0)).find("testsuite/system-out").text == "a | b"
    assert "- note: a \\| b" in regression_texts.markdown(noted)
    assert "note: a | b" in regression_texts.text(noted)
    assert regression_texts.facts(noted)["notes"] == ["a | b"]


def test_markdown_shows_the_worst_first_and_is_short(mixed) -> None:
    lines = regression_texts.markdown(replace(mixed, notes=("one", "two", "three", "four"))).splitlines()
    assert lines[0] == "### fail: mine on ball"
    assert len(lines) <= 30
    assert "- as near to the reference as allowed (within): fail" in "\n".join(lines)
    rows = [line.split(" | ") for line in lines if line.startswith("| ") and "verdict" not in line]
    assert len(rows) == regression_texts.MOST_ROWS
    assert ["| fail", "unchanged", "positions.moved", "20", "0 mm", "3 mm"] in [row[:6] for row in rows]
    asked = [row[1] for row in rows if row[0] == "| fail"]
    assert asked == sorted(asked, reverse=True), "within comes first"
    words = [row[0].removeprefix("| ") for row in rows]
    assert words == sorted(words, key=regression.WORST_FIRST.index)
    assert lines[-1] == f"and {len(mixed.judgements) - regression_texts.MOST_ROWS} more, none of them fails."


def test_text_names_failures_and_why_nothing_can_be_said(mixed) -> None:
    lines = regression_texts.text(mixed).splitlines()
    assert "fail: positions.moved unchanged at frame 20: 3 mm from what it was, 0.1 mm allowed" in lines
    away = [line for line in lines if "surface_deviation.max unchanged" in line]
    assert away[0].endswith("mm, further from the reference")
    assert any(line.startswith("what is nearer to the reference and what is further: compare ball") for line in lines)
    unknown = "inconclusive: the reference has an error bar of 0.5 mm, and 0 mm is that near to the 0.1 mm allowed"
    assert f"{unknown} (fibre_length.rms within)" in lines
    assert lines[-1] == "verdict: fail"
    many = replace(mixed, judgements=mixed.judgements[:1] * 20)
    assert regression_texts.text(many).count("fail: ") == regression_texts.MOST_ROWS
    assert "and 5 more like the last, which --json and --junit name" in regression_texts.text(many)


def test_facts_are_json(mixed) -> None:
    facts = regression_texts.facts(mixed)
    assert (facts["verdict"], facts["unchanged"], facts["within"]) == ("fail", "fail", "fail")
    assert {row["verdict"] for row in facts["judgements"]} == {"pass", "fail", "inconclusive"}
    json.dumps(facts, allow_nan=False)


def test_a_pass_by_a_doubtful_reference_is_doubtful_in_all_that_is_written(tmp_path) -> None:
    """And no failure: JUnit has it as a property, the tests of a pipeline stay green."""
    unstable = replace(REFERENCE, scalars={"negative_modes": np.array([0.0, 1, 1])})
    doubtful = current(known=bars(), reference=unstable)
    found = regression.check(baseline.update(tmp_path / "mine.json", doubtful), doubtful)
    why = "unstable equilibrium in 2 of 3 frames"
    assert (found.word, found.doubts) == ("doubtful pass", (why,))
    assert (regression_texts.facts(found)["verdict"], regression_texts.facts(found)["doubts"]) == (found.word, [why])
    text = regression_texts.text(found)
    assert text.endswith("verdict: doubtful pass")
    assert f"reference: doubtful, {why}" in text
    markdown = regression_texts.markdown(found)
    assert markdown.startswith("### doubtful pass: mine on ball")
    assert f"- reference: doubtful, {why}" in markdown
    root = ElementTree.fromstring(regression_texts.junit(found, 1.0))
    stated = [(one.get("name"), one.get("value")) for one in root.iter("property")]
    assert stated == [("verdict", "doubtful pass"), ("doubt", why)]
    assert root.get("failures") == "0"
