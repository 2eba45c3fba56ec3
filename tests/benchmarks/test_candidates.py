"""An iteration of a fast solver: its processor time, its absence where the solver fails, and the ratio to the report's program."""

import math

import pytest
import stand_ins

from benchmarks import bodies, candidates
from fem_reference import solvers
from fem_reference.assessment.solver_table import report_speeds
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.solvers import pbd


def test_an_iteration_costs_what_more_of_them_take_longer(monkeypatch) -> None:
    """5 s to begin and 0.25 s an iteration, disturbed in all but the first repeat."""
    calls = list[int]()

    def spent(_solver, _settings, _setup, iterations: int) -> float:
        calls.append(iterations)
        return 5 + 0.25 * iterations + 3 * (len(calls) > 2)

    monkeypatch.setattr(candidates, "spent", spent)
    assert candidates.per_iteration("pbd", None, None, (1, 5), 2) == pytest.approx(0.25, rel=1e-12)
    assert calls == [1, 5, 1, 5]


def test_a_solver_that_fails_or_takes_nothing_has_no_time(monkeypatch) -> None:
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: Outcome("diverged", "lost"))
    chosen = candidates.SOLVERS["pbd"]
    settings = solvers.settings(chosen, "pbd")
    assert math.isnan(candidates.spent("pbd", settings, bodies.ellipsoid(1), 2))
    assert math.isnan(candidates.per_iteration("pbd", settings, bodies.ellipsoid(1), (1, 5), 2))
    monkeypatch.setattr(candidates, "spent", lambda *_: 1.0)
    assert math.isnan(candidates.per_iteration("pbd", settings, bodies.ellipsoid(1), (1, 5), 2))


def test_a_case_whose_data_is_not_here_is_skipped(monkeypatch) -> None:
    monkeypatch.delenv(DATA_SETTING, raising=False)
    with pytest.raises(NotImplementedError):  # asv's word for it
        candidates.Iteration().setup("gluteus_maximus", "pbd")


def test_the_report_says_how_fast_its_program_is(monkeypatch) -> None:
    made = candidates.Iteration()
    monkeypatch.setattr(made, "track_seconds", lambda *_: 0.01)
    ratio = made.track_times_as_fast_as_the_report("gluteus_maximus", "pbd")
    assert ratio == pytest.approx(100 / report_speeds()["gluteus_maximus"].per_second)
    timed, _ = made.track_times_as_fast_as_the_report.params
    assert timed == ["gluteus_maximus", "box_squeeze_report"]


@pytest.mark.slow
def test_a_solver_is_timed_on_a_shipped_case(monkeypatch) -> None:
    """By a clock on which an iteration takes 0.25 s; where the solver fails, the time is no number."""
    solve = candidates.spent
    monkeypatch.setattr(candidates, "spent", lambda *given: 0 * solve(*given) + 5 + 0.25 * given[-1])
    monkeypatch.setattr(candidates, "ITERATIONS", 12)
    made = candidates.Iteration()
    made.setup("box_squeeze", "pbd")
    assert made.track_seconds("box_squeeze", "pbd") == pytest.approx(0.25, rel=1e-12)
