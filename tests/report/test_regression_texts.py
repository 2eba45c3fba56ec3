"""A check in words: the same verdict as text, JSON, Markdown and JUnit."""

import json
from xml.etree import ElementTree

import pytest

from fem_reference.assessment.regression import Check, Judgement
from fem_reference.report import regression_texts

NAN = float("nan")
FAILED = Judgement("within", "volume.deviation", "%", "fail", 20, 0.1, 3.0, 1.0, 0.0)
SILENT = Judgement("within", "fibre_length.rms", "mm", "inconclusive", 10, 0.1, 0.1, 0.1, 0.5)
PASSED = Judgement("unchanged", "a|b.rms", "mm", "pass", 0, NAN, NAN, 0.1, 0.0)
CHECK = Check("ball", "mine", (FAILED, SILENT, PASSED), ("a note",))


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
    lost = regression_texts.lost("ball", "mine", ["no frames", "of <anything>"])
    error = ElementTree.fromstring(lost.junit).find("testsuite/testcase/error")
    assert (error.get("message"), error.text) == ("no frames", "no frames\nof <anything>")
    assert lost.markdown == "### failed: mine on ball\n\n- no frames\n- of <anything>\n"
