"""The page of a study: its sentences, its tables at the same cost or error, and a drawing whose axes the reader chooses."""

import html
import json
import math
import re
from dataclasses import replace

import pytest

from fem_reference import report
from fem_reference.assessment.cost_study import CaseStudy, Study
from fem_reference.assessment.fronts import LOAD, Point, match
from fem_reference.assessment.recommendation import recommend
from fem_reference.report import study_page
from tests.assessment.test_recommendation import RMS, TIME, features, own_study

UNITS = {"surface_deviation.rms": "mm", "fibre_length.rms_percent": "%", "volume.deviation": "%"}


def points(solver: str, order: float, best: float, case: str = "hip") -> list[Point]:
    """Points of a solver whose error falls with the time to the power ``order``, down to ``best``."""
    found = []
    for i, seconds in enumerate((1, 2, 4, 8)):
        errors = dict.fromkeys(UNITS, best * (8 / seconds) ** order)
        costs = {"seconds_per_frame": 0.01 * seconds, "peak_memory_mb": 100.0 * seconds, "unknowns": 500.0}
        about = (
            case,
            solver,
            solver,
            "sweeps" if i else "",
            str(seconds) if i else "",
            {"solver": solver, "sweeps": seconds},
        )
        found.append(Point(*about, "converged", "", errors, costs))
    return found


def study(case: str = "hip", *more: Point) -> CaseStudy:
    made = (*points("fenicsx", 1.0, 0.1, case), *points("pbd", 0.5, 4.0, case), *more)
    bars = {"surface_deviation.rms": 0.2}
    return CaseStudy(case, f"The {case}", "its reference", made, UNITS, bars, (), 1000, 100.0)


def test_the_price_of_half_the_error_is_said_in_a_sentence() -> None:
    said = study_page.sentences(study())
    # Errors that fall as the square root of the time take four times the time to halve, those of first order twice.
    assert said[0].startswith("Halving the error of fenicsx costs 2.00 times the time")
    assert said[1].startswith("Halving the error of pbd costs 4.00 times the time")
    assert said[1].endswith("(4 settings, from 11.3 mm to 4 mm with sweeps = 8, 80 ms a frame).")
    assert said[2] == "Only the reference gets below 4 mm, the best of pbd."


def test_what_a_case_has_not_has_no_front() -> None:
    """Moment arms, where the solvers have them; one point alone, the others without a force, is no front."""
    case = study()
    assert study_page.shown(case) == list(UNITS)
    arms = replace(case, points=tuple(replace(one, errors=one.errors | {"moment_arm.rms": 3.0}) for one in case.points))
    assert study_page.shown(arms) == [*UNITS, "moment_arm.rms"]
    first, *others = case.points
    forced = replace(first, errors=first.errors | {"joint_moment.moment": 5.0})
    assert study_page.shown(replace(case, points=(forced, *others))) == list(UNITS)


def test_half_an_error_that_no_setting_reached_would_cost() -> None:
    case = study()
    some = replace(case, points=tuple(one for one in case.points if one.solver == "pbd" and one.value in ("4", "8")))
    assert study_page.sentences(some)[0].startswith("Halving the error of pbd would cost 4.00 times the time")


def test_the_nearest_of_the_other_solvers_is_named() -> None:
    said = study_page.sentences(study("hip", *points("arap", 0.5, 6.0)))
    assert said[-1] == "Only the reference gets below 4 mm, the best of pbd."


def test_each_drawing_has_the_front_of_its_own_statistic() -> None:
    # The faster setting is the nearer one by the surface, and not by the fibres: two points are on the front of these alone.
    def made(name: str, surface: float, fibres: float, seconds: float) -> Point:
        errors = {"surface_deviation.rms": surface, "fibre_length.rms_percent": fibres, "volume.deviation": 1.0}
        return Point("hip", "pbd", "pbd", "n", name, {}, "converged", "", errors, {"seconds_per_frame": seconds})

    case = replace(study(), points=(made("fast", 1.0, 5.0, 1.0), made("slow", 2.0, 1.0, 2.0)), bars={})
    lengths = {
        curve.title: max(
            path.count("L") for path in re.findall(r'<path d="([^"]*)"[^>]*stroke-width: 1.2', curve.markup)
        )
        for curve in (study_page.front(case, error) for error in study_page.shown(case))
        if "stroke-width: 1.2" in curve.markup
    }
    assert lengths == {"Surface deviation, rms": 0, "Fibre length, rms percent": 1, "Volume, deviation": 0}


def test_what_is_within_the_bar_from_the_fastest_setting_on_is_said_to_be_so() -> None:
    said = study_page.sentences(replace(study(), bars={"surface_deviation.rms": 1.0}))
    assert (
        said[0]
        == "The error of fenicsx is within the bar of the truth, 1 mm, at 10 ms a frame or more (fenicsx, as it is)."
    )


def test_a_solver_that_time_does_not_help_is_said_to_be_so() -> None:
    flat = [
        Point(
            "hip",
            "arap",
            "arap",
            "n",
            str(i),
            {},
            "converged",
            "",
            {"surface_deviation.rms": 5 - 0.1 * i},
            {"seconds_per_frame": i},
        )
        for i in (1, 2, 3)
    ]
    assert any(
        sentence.startswith("More time hardly improves arap") for sentence in study_page.sentences(study("hip", *flat))
    )


@pytest.mark.slow
def test_the_page_shows_what_was_left_out_and_why(tmp_path) -> None:
    failed = Point("hip", "xpbd", "xpbd", "sweeps", "<b>1</b>", {}, "diverged", "frame 3: & lost")
    path = report.write(
        study_page.page(Study((study("hip", failed),), {"far": "data is missing"}, {"machine": "here"})),
        tmp_path,
        "study",
    )
    text = path.read_text(encoding="utf-8")
    assert "diverged: frame 3: &amp; lost" in text
    assert "<b>1</b>" not in text
    assert "data is missing" in text
    assert not re.search(r'(?:src|href)="https?:', text)


def test_an_error_below_the_truths_bar_counts_as_the_bar_and_so_does_the_truth() -> None:
    about = ("hip", "fenicsx", "reference", "", "", {"solver": "fenicsx"}, "converged", "")
    truth = Point(*about, {}, {"seconds_per_frame": 0.2, "unknowns": 900.0})
    case = study("hip", truth)
    assert case.counted[3].errors["surface_deviation.rms"] == 0.2  # 0.1 mm was measured
    assert case.counted[-1].errors == {"surface_deviation.rms": 0.2}
    tables = {same: rows for same, _, rows in study_page.matched(case)}
    assert all(row.at >= 0.2 for row in tables["surface_deviation.rms"])
    # At the bar the cheapest is taken, and not the one that happens to be nearest.
    assert tables["unknowns"][-1].best["fenicsx"].costs["seconds_per_frame"] == 0.04
    shown = [point for point, _ in study_page.shown_points(case)]
    assert shown[3].errors["surface_deviation.rms"] == 0.1
    assert shown[-1].errors == {"surface_deviation.rms": 0.2}


def test_a_study_in_which_nothing_reached_its_end_has_a_page(tmp_path) -> None:
    failed = Point("hip", "xpbd", "xpbd", "sweeps", "1", {}, "diverged", "frame 3")
    case = CaseStudy("hip", "The hip", "its reference", (failed,), UNITS, {}, (), 1000, 100.0)
    assert "diverged: frame 3" in report.write(study_page.page(Study((case,))), tmp_path, "study").read_text(
        encoding="utf-8"
    )


def test_tables_compare_at_the_same_cost_and_never_at_the_same_settings() -> None:
    tables = {same: rows for same, _, rows in study_page.matched(study())}
    assert set(tables) == {"seconds_per_frame", "peak_memory_mb", "unknowns", "surface_deviation.rms"}
    for row in tables["seconds_per_frame"]:
        assert all(point.costs["seconds_per_frame"] <= row.at for point in row.best.values())


@pytest.mark.slow
def test_columns_of_all_tables_have_one_order_and_the_best_of_a_row_is_marked(tmp_path) -> None:
    text = report.write(study_page.page(Study((study(),))), tmp_path, "study").read_text(encoding="utf-8")
    heads = re.findall(r"at most</small></th>(.*?)</tr>", text)
    assert len(heads) == 4
    assert all(re.findall("<th>(.*?)</th>", head) == ["fenicsx", "pbd"] for head in heads)
    rows = re.findall(
        r"<tr><th>[^\n]*\n(?:\n?<td[^\n]*\n?)+</tr>", text[text.index("The same") : text.index("<details>")]
    )
    assert rows
    assert all(row.count('class="best"') == 1 for row in rows)


@pytest.mark.slow
def test_numbers_of_the_page_are_valid_json_with_every_point(tmp_path) -> None:
    report.write(study_page.page(Study((study(),), {}, {"machine": "here"})), tmp_path, "study")
    found = json.loads(
        (tmp_path / "study.json").read_text(encoding="utf-8"), parse_constant=lambda name: pytest.fail(name)
    )
    assert len(found["points"]) == 8
    text = (tmp_path / "study.html").read_text(encoding="utf-8")
    data = json.loads(re.search(r'id="study">(.*?)</script>', text, re.DOTALL)[1])
    assert len(data["cases"][0]["points"]) == 8


@pytest.mark.slow
def test_settings_are_tried_on_cases_that_they_were_not_chosen_on(tmp_path) -> None:
    whole = Study(tuple(study(case) for case in ("hip", "knee", "jaw")), {}, {"machine": "here"})
    text = report.write(study_page.page(whole), tmp_path, "study").read_text(encoding="utf-8")
    assert "Do good settings carry over to other cases?" in text
    plain = re.sub(r"<[^>]+>|&#8239;", "", text)
    assert "among the settings measured on every case: 0% in the median, 0% at most" in plain
    assert math.isclose(max(one.loss for one in study_page.transfers(whole.cases, "surface_deviation.rms")), 0.0)


@pytest.mark.parametrize("own_bar", [0.0, 0.5, 2.0])
def test_at_most_means_the_same_on_the_page_of_the_study(own_bar: float) -> None:
    known = features(50)
    case = own_study(known, bar=own_bar)
    rows = {same: rows for same, _, rows in study_page.matched(case)}
    levels = [row.at for row in rows[RMS]]
    assert levels
    for row in rows[RMS]:
        cheapest = next(iter(row.best.values()))
        assert recommend(known, "bar", [case], RMS, {"error": row.at}).best.point.label == cheapest.label
    for error in (0.4, 0.6, 2.9, 3.1, 4.9, 5.1, 6.9, 7.1, 9.9, 12.1):
        found = recommend(known, "bar", [case], RMS, {"error": error}).best
        best = list(match(case.certain, RMS, TIME, same=RMS, at=error).best.values())
        assert (None if found is None else found.point.label) == (best[0].label if best else None), error
    for row in rows[TIME]:
        assert (
            recommend(known, "bar", [case], RMS, {"time": row.at}).best.point.label
            == next(iter(row.best.values())).label
        )


def test_the_page_says_that_the_bar_is_in_its_table() -> None:
    case = own_study(features(50), bar=2.0)
    case = replace(case, units=case.units | dict.fromkeys(study_page.shown(case), "mm"))
    text = study_page.page(Study((case,))).html()
    table = text[text.index("The same surface deviation, rms: time of a frame") :]
    plain = html.unescape(re.sub(r"<[^>]+>", "", table)).replace("\N{NARROW NO-BREAK SPACE}", " ")
    assert "with the error bar of the truth, 2 mm, at most" in plain
    # At most 10 mm: 5 mm were measured in 3 ms; at most 2 mm: the truth.
    assert "0.00300 ssweeps = 3, 5 mm measured" in plain
    assert "reference, as it is, the truth itself" in plain


@pytest.mark.slow
def test_times_of_a_machine_that_was_busy_are_marked() -> None:
    case = study()
    timed = (replace(one, costs=one.costs | {LOAD: 0.25 if one.value == "4" else 0.05}) for one in case.points)
    busy = Study((replace(case, points=tuple(timed)),))
    warning = "2 of 8 times were measured while other processes kept 25 % of the machine busy"
    assert warning in study_page.page(busy).html()
    assert warning in study_page.text(busy)
    assert warning not in study_page.text(Study((case,)))


@pytest.mark.slow
def test_it_says_first_what_to_take_and_so_does_recommend() -> None:
    """Errors of fenicsx fall from 0.8 mm by first order, those of pbd from 11.3 mm by half an order; the bar is 0.2 mm."""
    case = study()
    lines = study_page.answer_texts(study_page.answered(case), "mm")
    assert lines == [
        "Within 1 mm: fenicsx, as it is, 1 mm, 10 ms a frame",
        "Within 5 mm: fenicsx, as it is, 1 mm, 10 ms a frame",
        "At 60 frames a second: fenicsx, as it is, 1 mm, 10 ms a frame",
        "At the knee of the front: fenicsx (sweeps = 4), 0.400 mm, 40 ms a frame",
    ]
    page = study_page.page(Study((case,)))
    shown = page.html()
    header = shown[shown.index("<header>") : shown.index("</header>")]
    for line in lines:
        assert f"<li>{line}.</li>" in header
        assert line in study_page.text(Study((case,)))
    assert [text for _, _, text in page.headlines] == lines
    others = replace(case, points=tuple(one for one in case.points if one.solver == "pbd"))
    assert study_page.answer_texts(study_page.answered(others), "mm")[0] == (
        "Within 1 mm: no setting; the nearest is pbd (sweeps = 8), 4.20 mm, 80 ms a frame"
    )
    assert "<li>" not in study_page.page(Study((replace(case, points=()),))).html().split("</header>")[0]


@pytest.mark.slow
def test_of_several_cases_each_answers_in_its_own_section() -> None:
    shown = study_page.page(Study((study(), study("knee")))).html()
    assert "<li>Within" not in shown[: shown.index("</header>")]
    assert shown.count("<li>Within 5 mm: ") == 2


def test_a_solver_that_meets_no_request_has_a_row_too() -> None:
    """One setting, 9 mm and 10 s a frame: not within 5 mm, not at 60 frames a second, and no knee."""
    known = own_study(features(50))
    lost = Point("bar", "lost", "lost", "", "", {"solver": "lost"}, "converged", "", {RMS: 9.0}, {TIME: 10.0})
    text = study_page.page(Study((replace(known, points=(*known.points, lost)),))).html()
    row = text[text.index("<tr><th>lost</th>") :].partition("</tr>")[0]
    assert re.findall(r"<td>(.*?)</td>", row) == ["\N{EN DASH}"] * 4
