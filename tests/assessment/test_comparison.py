"""A comparison measures every run against the reference and against rest, and judges it; over fewer frames too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import shapes

from fem_reference.assessment.comparison import compare, reached, reached_frames
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes.case import Expectation
from tests.report.comparisons import NAN, small_comparison, with_bars

REST = shapes.sphere(2, 10.0)
FIBRE = Polylines(np.array([[0.0, 0, -5], [0, 0, 5]]), np.array([0, 2]))
OUTCOME = Outcome("converged", "done")
SETUP = Setup(REST, (), (), (0, 10), None)


def run(name: str, growth: tuple[float, float], *, fibres: bool = True) -> Run:
    positions = np.stack([REST.points * factor for factor in growth])
    inside = np.stack([FIBRE.points * factor for factor in growth]) if fibres else None
    return Run(name, "test", OUTCOME, (0, 10), REST, positions, FIBRE if fibres else None, inside)


def volume_deviation(measures) -> float:
    (found,) = (one for one in measures if (one.metric, one.statistic) == ("volume", "deviation"))
    return float(found.values[1])


def expectation(of: str, truth: str) -> Expectation:
    keys = {"metric": "volume", "statistic": "deviation", "frame": 10, "within": "0.01 %", "kind": "closed form"}
    return Expectation(of=of, truth=truth, because="a test", **keys)


def scene(*expectations: Expectation) -> SimpleNamespace:
    return SimpleNamespace(expect=expectations, place="case.toml", standards=lambda _: {"reference", "itself"})


def test_candidates_are_measured_against_the_reference_and_all_against_rest() -> None:
    # Spheres that grow by 10 and 21 %: 1.1^3 = 1.331 of rest, and 1.1^3 of each other.
    result = compare(scene(), SETUP, run("reference", (1, 1.1)), (run("large", (1, 1.21), fibres=False),))
    volume = {name: volume_deviation(measures) for name, measures in result.changes.items()}
    assert volume == pytest.approx({"reference": 33.1, "large": 100 * (1.21**3 - 1)})
    assert volume_deviation(result.deviations["large"]) == pytest.approx(33.1)
    assert set(result.deviations) == {"large"}
    # An extension with linear precision makes no error in a linear field.
    assert result.extension_error.values == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("expected", "word", "of_reference"),
    [
        ([("reference", "33.1 %")], "doubtful pass", "doubtful pass"),
        ([("mine", "33.1 %")], "doubtful pass", "not judged"),
        ([("reference", "33.1 %"), ("mine", "0 %")], "fail", "doubtful pass"),
        ([("reference", "0 %")], "fail", "fail"),
        ([], "not judged", "not judged"),
    ],
)
def test_a_pass_that_rests_on_a_doubtful_reference_is_doubtful(expected, word: str, of_reference: str) -> None:
    grown = run("reference", (1, 1.1))
    unstable = replace(grown, scalars={"negative_modes": np.array([0.0, 1])})
    case, mine = scene(*(expectation(*one) for one in expected)), run("mine", (1, 1.21))
    result = compare(case, SETUP, unstable, (mine,))
    assert (result.word, result.word_of("reference")) == (word, of_reference)
    assert result.doubts == ["unstable equilibrium in 1 of 2 frames"]
    stable = compare(case, SETUP, grown, (mine,))
    assert (stable.word, stable.doubts) == (word.removeprefix("doubtful "), [])
    assert stable.word_of("reference") == of_reference.removeprefix("doubtful ")
    ended = compare(case, SETUP, replace(grown, outcome=Outcome("timed out", "")), (mine,))
    assert (ended.word, ended.word_of("reference")) == (word, "fail")


def test_expectations_meet_the_runs_that_they_are_of() -> None:
    expected = (expectation("reference", "33.1 %"), expectation("candidates", "33.1 %"), expectation("absent", "0 %"))
    candidates = (run("right", (1, 1.21)), run("wrong", (1, 1.1)))
    result = compare(scene(*expected), SETUP, run("reference", (1, 1.1)), candidates)
    assert [(one.expectation.of, one.word) for one in result.verdicts] == [
        ("reference", "pass"),
        ("right", "pass"),
        ("wrong", "fail"),
    ]
    assert result.word == "fail"
    assert compare(scene(), SETUP, run("reference", (1, 1.1)), candidates).word == "not judged"


def test_expectations_of_the_reference_and_of_candidates_have_bars_of_their_own() -> None:
    expected = (expectation("reference", "33.1 %"), expectation("candidates", "33.1 %"))
    bars = tuple(
        ErrorBar(of, "volume", "deviation", "%", np.array([0.0, value]), {})
        for of, value in (("change", 0.009), ("deviation", 0.011))
    )
    known = ErrorBars((0, 10), (4.0, 8.0), 1.5, bars)
    result = compare(scene(*expected), SETUP, run("reference", (1, 1.1)), (run("right", (1, 1.21)),), known)
    # Both are what is expected, and 0.01 % are allowed.
    assert [(one.word, one.error_bar) for one in result.verdicts] == [("pass", 0.009), ("inconclusive", 0.011)]
    assert result.error_bars is known
    bare = ErrorBars((0, 10), (4.0, 8.0), 1.5, ())
    result = compare(scene(*expected), SETUP, run("reference", (1, 1.1)), (run("right", (1, 1.21)),), bare)
    assert [(one.word, one.error_bar) for one in result.verdicts] == [("pass", None), ("pass", None)]


def test_a_reference_carries_the_fibres() -> None:
    with pytest.raises(InputError, match="reference: fibres: got a run without an interior"):
        compare(scene(), SETUP, run("reference", (1, 1.1), fibres=False), ())


@pytest.fixture
def whole(tmp_path, monkeypatch):
    return with_bars(small_comparison(tmp_path, monkeypatch))


def failed(whole, *lost: int):
    positions = np.array(whole.reference.positions)
    positions[list(lost)] = NAN
    return replace(whole, reference=replace(whole.reference, positions=positions, outcome=Outcome("diverged", "lost")))


def test_frames_that_were_not_reached_are_left_out_everywhere(whole) -> None:
    cut = reached(failed(whole, 1, 4))
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
    assert reached(whole) is whole
    nowhere = failed(whole, *range(5))
    assert reached(nowhere) is nowhere
    assert len(reached_frames(nowhere.reference)) == 0
