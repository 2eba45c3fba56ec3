"""A check in words: every text has the verdict, the worst judgements and the doubts."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from balls import NUMBERS, REFERENCE, SHIFTS, bars, checked, current, edited

from fem_reference.assessment import baseline, regression
from fem_reference.assessment.regression import Check, Judgement
from fem_reference.report import regression_texts

NAN = float("nan")
FAILED = Judgement("within", "volume.deviation", "%", "fail", 20, 0.1, 3.0, 1.0, 0.0)
SILENT = Judgement("within", "fibre_length.rms", "mm", "inconclusive", 10, 0.1, 0.1, 0.1, 0.5)
PASSED = Judgement("unchanged", "a|b.rms", "mm", "pass", 0, NAN, NAN, 0.1, 0.0)
CHECK = Check("ball", "mine", (FAILED, SILENT, PASSED), ("a note",))


@pytest.fixture
def mixed(path) -> regression.Check:
    """A check with all three verdicts."""
    edited(path, lambda table: table["measures"]["fibre_length.rms"].update(within=0.1))
    return checked(path, current([*SHIFTS[:2], (15, 0, 10)], bars()))


@pytest.fixture
def path(tmp_path):
    """A baseline, made where the reference has an error bar of 0.5 of everything."""
    file = tmp_path / "new" / "ball.json"
    baseline.update(file, current(known=bars()))
    return file


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
    assert moved.find("failure").get("message") == "frame 20: 3 mm from the baseline, 0.1 mm allowed"
    assert suite.find("system-out") is None


@pytest.mark.parametrize(("shifts", "frame"), [((9, 8), "10"), ((8, 14), "20")])
def test_the_error_bar_beside_a_row_is_that_of_its_statistic_in_its_frame(path, shifts, frame) -> None:
    """No two bars are alike: they grow by statistic, and are three times as long in the last frame."""
    spread = [replace(one, values=1e-3 * (i + 1) * np.array([0.0, 1, 3])) for i, one in enumerate(bars().bars)]
    edited(path, lambda table: [one.update(within=0.01) for one in table["measures"].values() if "within" in one])
    found = checked(
        path, current([(0, 0, 0), (shifts[0], 0, 5), (shifts[1], 0, 10)], replace(bars(), bars=tuple(spread)))
    )
    own = {f"{one.metric}.{one.statistic}": (one.unit, dict(zip(NUMBERS, one.values, strict=True))) for one in spread}
    rows = [
        line.strip("| ").split(" | ") for line in regression_texts.markdown(found).splitlines() if " within | " in line
    ]
    texts = [one.text for one in ElementTree.fromstring(regression_texts.junit(found, 1)).iter("failure")]
    named = [dict(line.split(": ", 1) for line in text.splitlines()) for text in texts]
    rows += [list(one.values()) for one in named if one["question"] == "within"]
    assert frame in {row[3] for row in rows}
    assert len(rows) >= 14  # seven statistics of the surface, in both texts
    for _, _, name, at, *_, bar in rows:
        unit, values = own[name]
        assert bar == f"{values[int(at)]:.4g} {unit}", name


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
    assert "fail: positions.moved unchanged at frame 20: 3 mm from the baseline, 0.1 mm allowed" in lines
    away = [line for line in lines if "surface_deviation.max unchanged" in line]
    assert away[0].endswith("mm, further from the reference")
    assert any(
        "or further from it, run: ./fem compare ball --candidate ... --against BASELINE" in line for line in lines
    )
    unknown = (
        "inconclusive: the distance, 0 mm, differs from the allowed 0.1 mm by less than the error bar of the reference"
    )
    assert f"{unknown}, 0.5 mm (fibre_length.rms within)" in lines
    assert lines[-1] == "verdict: fail"
    many = replace(mixed, judgements=mixed.judgements[:1] * 20)
    assert regression_texts.text(many).count("fail: ") == regression_texts.MOST_ROWS
    assert "and 5 more, listed by --json and --junit" in regression_texts.text(many)


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


def test_every_form_has_the_verdict_and_each_judgement() -> None:
    assert regression_texts.facts(CHECK)["verdict"] == "fail"
    assert regression_texts.text(CHECK).splitlines()[-1] == "verdict: fail"
    assert regression_texts.markdown(CHECK).startswith("### fail: mine on ball\n")
    suite = ElementTree.fromstring(regression_texts.junit(CHECK, 1.0)).find("testsuite")
    assert [len(suite.findall(f"testcase/{kind}")) for kind in ("failure", "skipped")] == [1, 1]
    assert [case.get("name") for case in suite.findall("testcase")] == [
        "volume.deviation within",
        "fibre_length.rms within",
        "a|b.rms unchanged",
    ]


def test_a_number_that_is_not_there_is_null_and_a_bar_breaks_no_table() -> None:
    rows = json.loads(json.dumps(regression_texts.facts(CHECK), allow_nan=False))["judgements"]
    assert (rows[2]["was"], rows[0]["was"]) == (None, 0.1)
    assert "| a\\|b.rms |" in regression_texts.markdown(CHECK)
    assert "none" in regression_texts.markdown(CHECK)


@pytest.mark.parametrize("count", [regression_texts.MOST_ROWS, regression_texts.MOST_ROWS + 2])
def test_a_pull_request_shows_the_worst_and_counts_the_others(count: int) -> None:
    many = Check("ball", "mine", (FAILED,) * count, ())
    text = regression_texts.markdown(many)
    assert text.count("| fail |") == regression_texts.MOST_ROWS
    assert ("and 2 more, 2 of them fail." in text) == (count > regression_texts.MOST_ROWS)


def test_where_nothing_could_be_judged_the_reasons_stand_as_an_error() -> None:
    junit, markdown = regression_texts.lost("ball", "mine", ["no frames", "of <anything>"])
    error = ElementTree.fromstring(junit).find("testsuite/testcase/error")
    assert (error.get("message"), error.text) == ("no frames", "no frames\nof <anything>")
    assert markdown == "### failed: mine on ball\n\n- no frames\n- of <anything>\n"
