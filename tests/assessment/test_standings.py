"""Rows of standings: what is stale or failed, what is compared, the order in a group, and what changed."""

import json
import math

import pytest

from fem_reference.assessment.standings import ERROR, PROTOCOL, SHARE, Standing, Standings, changes, load
from fem_reference.foundations.errors import InputError

KEYS = {"truth": "t1", "run": "r1", "frames": "f", "date": "2026-01-01", "machine": "m", "protocol": PROTOCOL}


def row(name: str, error: float | None = 1.0, case: str = "hip", group: str = "PBD", **more) -> Standing:
    worst = {} if error is None else {ERROR: error, SHARE: 10 * error}
    said = {"version": "1", "status": "converged", "message": "done", "worst": worst, "bars": {}, "split": {}}
    return Standing(**{"case": case, "group": group, "name": name} | said | KEYS | more)


TRUTH = row("reference", None, group="FEM", bars={ERROR: 0.2})


def test_a_row_is_stale_where_reference_solver_or_protocol_changed() -> None:
    assert row("a").is_of("t1", "r1")
    assert not any((row("a").is_of("t2", "r1"), row("a").is_of("t1", "r2"), row("a", protocol=0).is_of("t1", "r1")))


def test_only_asks_for_rows_in_these_states() -> None:
    good, stale = row("a"), row("a", stale=True)
    lost, unsound = row("a", status="crashed"), row("a", unsound="exploded: far")
    assert [one.asked(()) for one in (good, stale, lost, unsound)] == [True] * 4
    assert [one.asked({"failed"}) for one in (good, stale, lost, unsound)] == [False, False, True, True]
    assert [one.asked({"stale"}) for one in (good, stale, lost, unsound)] == [False, True, False, False]


def test_what_failed_is_last_in_its_group_however_small_its_error() -> None:
    rows = (TRUTH, row("lucky", 0.01, unsound="collapsed: flat"), row("far", 3.0), row("near", 1.0))
    found = Standings(rows=(*rows, row("vbd", 0.1, group="VBD")), missing={})
    assert [one.name for one in found.of("hip")] == ["reference", "near", "far", "lucky", "vbd"]


def test_over_cases_medians_of_what_is_sound_count() -> None:
    rows = [row("a", error, case, seconds_per_frame=error) for case, error in (("x", 1.0), ("y", 3.0), ("z", 8.0))]
    rows += [row("b", 0.1, "x"), row("b", 0.1, "y", status="diverged"), TRUTH]
    overall = {one.name: one for one in Standings(rows=tuple(rows), missing={}).overall()}
    assert (overall["a"].share, overall["a"].seconds, overall["a"].lost) == (30.0, 3.0, ())
    assert (overall["b"].count, overall["b"].share, overall["b"].lost) == (2, 1.0, ("y",))
    assert math.isnan(overall["reference"].share)
    assert [one.name for one in Standings(rows=tuple(rows), missing={}).overall()][:2] == ["a", "b"]


def test_kept_rows_are_stale_by_protocol_or_a_missing_case_and_count_nowhere() -> None:
    assert [row("a", protocol=p).kept(gone).stale for p, gone in ((PROTOCOL, False), (0, False), (PROTOCOL, True))] == [
        False,
        True,
        True,
    ]
    assert row("a", stale=True).kept(missing=False).stale
    rows = (row("a", 1.0, "x"), row("a", 9.0, "y", stale=True), row("b", stale=True))
    assert [(one.name, one.count, one.share) for one in Standings(rows=rows, missing={}).overall()] == [("a", 1, 10.0)]


def test_changes_beyond_the_error_bar_are_said() -> None:
    before = [TRUTH, row("a"), row("b"), row("c"), row("gone"), row("d")]
    after = [TRUTH, row("a", 1.1), row("b", 1.5), row("c", unsound="stuck: 3 vertices"), row("new"), row("d", None)]
    assert changes(before, after) == (
        "hip, b: 1 mm, now 1.5 mm",  # a changed by less than the bar of 0.2 mm
        "hip, c: converged, now stuck",
        "hip, gone: gone",
        "hip, new: new",
    )
    assert changes([], after) == ()


def test_rows_are_read_again_and_another_file_is_refused(tmp_path) -> None:
    found, path = Standings(rows=(TRUTH, row("a", None)), missing={}), tmp_path / "standings.json"
    assert load(path) == ()
    path.write_text(found.model_dump_json())
    assert load(path) == found.rows
    for other in ("[]", "{}", json.dumps({"rows": [{"case": "x"}], "missing": {}})):
        path.write_text(other)
        with pytest.raises(InputError, match=r"standings\.json"):
            load(path)
