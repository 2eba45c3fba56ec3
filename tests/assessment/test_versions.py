"""Two versions of one solver: what is nearer to the reference and what further, where, and the page and verb that say it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.assessment import versions
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.assessment.versions import Change, Versions
from fem_reference.foundations.errors import InputError
from fem_reference.report import against_page
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx, pbd
from tests.report import comparisons, test_headline

NAN = float("nan")


@pytest.fixture
def comparison(tmp_path, monkeypatch) -> Comparison:
    """The small comparison of the tests of pages."""
    return comparisons.small_comparison(tmp_path, monkeypatch)


def change(was, now, bars=(NAN, NAN), unit="mm") -> Change:
    return Change("surface_deviation.rms", unit, (0, 10), *(np.array(one, float) for one in (was, now, bars)))


@pytest.mark.parametrize(
    ("was", "now", "bars", "word", "by"),
    [
        ((0, 2), (0, 3), (NAN, NAN), "worse", 1),
        ((1, 2), (0.5, 3), (NAN, NAN), "mixed", 1),
        ((1, 2), (0.95, 3), (NAN, NAN), "worse", 1),  # a twentieth of it does not count
        ((1, 2), (0.5, 3), (0.6, 0.6), "worse", 1),
        ((0, 3), (0, -2), (NAN, NAN), "better", -1),  # on the other side and nearer
        ((0, 2), (0, 3), (0.1, 1.5), "within the error bar", 1),
        ((0, 2), (0, 3), (0.1, 0.5), "worse", 1),
        ((0, 2), (0, 2.00005), (NAN, NAN), "as it was", 0.00005),
        ((0, 2), (0, NAN), (1, 9), "worse", np.inf),
        ((0, NAN), (0, 2), (1, 9), "better", -np.inf),
        ((NAN, NAN), (NAN, NAN), (1, 1), "no number", NAN),
    ],
)
def test_nearer_is_better_and_what_is_less_than_the_bar_is_neither(was, now, bars, word, by) -> None:
    found = change(was, now, bars)
    assert found.word == word
    assert found.by == pytest.approx(by, nan_ok=True, abs=1e-12)
    if word not in ("no number", "as it was"):
        assert found.frame == 10


def test_the_frame_that_counts_is_the_one_that_changed_most_and_a_change_is_said_in_bars() -> None:
    found = change((4, 1), (1, 2), (0.5, 0.5))
    assert (found.frame, found.by, found.in_bars, found.greatest) == (0, -3, -6, (4, 2))
    said = "surface deviation, rms is 3 mm nearer in frame 0: 4 before, 1 mm now, 6 times the error bar, "
    said += "and 1 mm further in frame 10"
    assert against_page.sentence(found) == said
    assert "no longer has a number in frame 10" in against_page.sentence(change((0, 2), (0, NAN)))


def of(comparison, shift: float, bars: ErrorBars | None = None) -> CurrentMeasures:
    """The candidate ``quick`` of the small comparison, ``shift`` times as far away."""
    truth = comparison.reference.positions
    run = replace(comparison.candidates[0], positions=truth + shift * (comparison.candidates[0].positions - truth))
    measures = comparisons.measured(run, truth)
    return CurrentMeasures(comparison.scene, run, comparison.reference, measures, bars)


def pair(comparison, bars: ErrorBars | None = None) -> Versions:
    return versions.of_runs(of(comparison, 0.5, bars), of(comparison, 1.0), "the old one")


def test_two_runs_are_compared_statistic_by_statistic_and_vertex_by_vertex(comparison) -> None:
    found = pair(comparison)
    assert {one.word for one in found.changes} == {"better"}
    # It was 1 mm a step away along z and is half of that: 2 mm at the last of four steps.
    assert found.place == (4, 0, pytest.approx(2.0))
    rms = next(one for one in found.changes if one.name == "surface_deviation.rms")
    assert (rms.frame, rms.by) == (40, pytest.approx(-2.0))
    assert versions.of_runs(of(comparison, 1.0), of(comparison, 1.0), "itself").place is None
    wrong = of(comparison, 1.0)
    fewer = replace(wrong.candidate, positions=wrong.candidate.positions[:, 1:])
    with pytest.raises(InputError, match=r"--against: got 65 vertices, want 66"):
        versions.of_runs(wrong, replace(wrong, candidate=fewer), "cut")


def shift(by: float):
    def solve(setup, _settings, sink) -> Outcome:
        for number in setup.frames:
            sink(Frame(number, setup.surface.points + np.array([by * number, 0, 0])))
        return Outcome("converged", "done", {"seconds": 1.0})

    return solve


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_the_verb_compares_with_a_baseline_and_with_a_stored_run(tmp_path: Path, monkeypatch, capsys) -> None:
    stand_ins.solve_by(monkeypatch, fenicsx, test_headline.still)
    stand_ins.unchecked(monkeypatch)
    stand_ins.solve_by(monkeypatch, pbd, shift(0.1))
    case, out, past = small.write(tmp_path / "bar"), tmp_path / "out", tmp_path / "past.json"
    common = [str(case), "--out", str(out), "--quiet"]
    cli.main(["check", *common, "--candidate", "pbd", "--baseline", str(past), "--update"])
    (old,) = (out / "runs").glob("pbd-*")
    stand_ins.solve_by(monkeypatch, pbd, shift(0.2))
    more = ["--set", "candidate[0].sub_iterations=4"]  # so that it is solved again
    for against in (past, old):
        capsys.readouterr()
        facts = tmp_path / "facts.json"
        words = ["compare", *common, *more, "--solver", "pbd", "--against", str(against), "--json", str(facts)]
        assert cli.main(words) == cli.DONE
        printed = capsys.readouterr().out
        # It was 2 mm away at frame 20 and is 4.
        assert "worse: surface deviation, rms is 2 mm further in frame 20: 2 before, 4 mm now" in printed
        assert "moved most: 2" in printed
        name = f"bar-candidate0.sub_iterations=4-pbd-against_{against.stem if against is past else against.name}"
        assert f"page: {out / name / 'against.html'}" in printed
        assert json.loads(facts.read_text())["counts"]["worse"] > 3
    html = next(out.glob(f"*against_{old.name}/against.html")).read_text()
    assert "Differences in provenance" in html
    for words, want in (
        (["--against", str(past), "--candidate", "pbd", "--solver", "xpbd"], "--against: got 2 candidates"),
        (["--against", str(tmp_path / "nowhere"), "--solver", "pbd"], "nowhere"),
        (["--solver", "pbdd"], '--solver: got "pbdd", want one of'),
    ):
        assert cli.main(["compare", *common, *words]) == cli.BAD_INPUT
        assert want in capsys.readouterr().err
