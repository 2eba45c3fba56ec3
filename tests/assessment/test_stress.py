"""Verdicts of hard cases."""

from dataclasses import replace

import numpy as np

from fem_reference.assessment import stress
from fem_reference.assessment.stress import Bound, Cell, History


def test_judging() -> None:
    history = History("volume", "%", (0, 1, 2), np.array([0.0, 3.0, 1.0]))
    blank = Cell("case", "pbd", "ok", "", "converged")
    assert stress.judge(blank, [(Bound(quantity="volume", at_most=2.0), history)]).verdict == "degraded"
    assert stress.judge(blank, [(Bound(quantity="volume", at_most=2.0, frame="last"), history)]).verdict == "ok"
    lost = replace(history, values=np.array([0.0, np.nan, 0.0]))
    found = stress.judge(blank, [(Bound(quantity="volume", at_most=2.0), lost)])
    assert (found.verdict, found.at) == ("failed", 1)
    shown, kept = (
        stress.judge(blank, [(Bound(quantity="volume", at_most=most), history)], "there is no pressure")
        for most in (2.0, 4.0)
    )
    assert (shown.verdict, kept.verdict) == ("degraded", "failed")
    assert shown.sentence.startswith("as expected (there is no pressure): volume 3 %")
    assert kept.sentence.startswith("not as expected (there is no pressure): volume 3 %")
    assert stress.doubted(blank, "", "it is flat") is blank
    assert [stress.doubted(blank, "unstable", why).verdict for why in ("", "it is flat")] == ["degraded", "no solution"]
    assert stress.doubted(shown, "unstable", "it is flat") is shown
    ended = replace(blank, status="inverted")
    bounds = [(Bound(quantity="volume", at_most=2.0), history)]
    assert stress.unfinished(ended, "a cell", bounds, "").verdict == "failed"
    assert stress.unfinished(ended, "a cell", bounds, "it is flat").verdict == "no solution"
    assert stress.unfinished(replace(blank, status="limit point"), "", bounds, "").verdict == "no solution"
    assert stress.unfinished(replace(ended, status="timed out"), "", bounds, "it is flat").verdict == "failed"
    first = [(bounds[0][0], replace(history, numbers=(0,), values=history.values[:1]))]
    assert stress.unfinished(ended, "a cell", first, "it is flat").verdict == "failed"
