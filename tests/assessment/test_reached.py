"""A comparison over the frames that its reference reached: those that are left are what they were."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment import reached
from fem_reference.runs.store import Outcome
from tests.report.comparisons import NAN, small_comparison, with_bars


@pytest.fixture
def whole(tmp_path, monkeypatch):
    return with_bars(small_comparison(tmp_path, monkeypatch))


def failed(whole, *lost: int):
    positions = np.array(whole.reference.positions)
    positions[list(lost)] = NAN
    return replace(whole, reference=replace(whole.reference, positions=positions, outcome=Outcome("diverged", "lost")))


def test_frames_that_were_not_reached_are_left_out_everywhere(whole) -> None:
    cut = reached.cut(failed(whole, 1, 4))
    assert {run.numbers for run in cut.runs} == {(0, 20, 30)}
    assert cut.error_bars.numbers == (0, 20, 30)
    np.testing.assert_array_equal(cut.candidates[0].positions, whole.candidates[0].positions[[0, 2, 3]])
    for name, metric, statistic in (("quick", "volume", "deviation"), ("reference", "fibre_length", "max")):
        before, after = whole[name, metric, statistic], cut[name, metric, statistic]
        np.testing.assert_array_equal(after.values, before.values[[0, 2, 3]])
        np.testing.assert_array_equal(after.error_bars, before.error_bars[[0, 2, 3]])
        assert after.numbers == (0, 20, 30)
    assert cut["quick", "fibre_length", "max"].where == tuple(
        whole["quick", "fibre_length", "max"].where[i] for i in (0, 2, 3)
    )
    np.testing.assert_array_equal(cut.extension_error.values, whole.extension_error.values[[0, 2, 3]])
    for before, after in zip(whole.error_bars.bars, cut.error_bars.bars, strict=True):
        np.testing.assert_array_equal(after.values, before.values[[0, 2, 3]])
        np.testing.assert_array_equal(after.model, before.model[[0, 2, 3]])


def test_a_reference_that_reached_all_or_nothing_is_left_as_it_is(whole) -> None:
    assert reached.cut(whole) is whole
    nowhere = failed(whole, *range(5))
    assert reached.cut(nowhere) is nowhere
    assert len(reached.frames(nowhere.reference)) == 0
