"""One process solves body after body, outlives a failure, and ends with its session."""

import importlib.util
import os
from dataclasses import replace

import pytest

from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest, Turn
from fem_reference.solvers import fenicsx
from tests.solvers.fenicsx.test_body import FLESH, box, session, settings, turned  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow


def test_a_session_checks_the_element(session) -> None:  # noqa: F811
    with pytest.raises(InputError, match="want one for tetrahedron cells"):
        session.solve(Body(box("P1"), FLESH, (), (0.0, 1.0)), settings("Q1/P0"))


def test_a_session_outlives_its_process(session) -> None:  # noqa: F811
    body = turned(box("Q1/P0"), Turn((0.0, 0.0, 1.0), 0.3))
    before = session.solve(body, settings("Q1/P0")).last
    session.process.process.kill()
    dead = session.solve(body, settings("Q1/P0"))
    assert (dead.outcome.status, dead.states) == ("crashed", ())
    assert "the FEniCSx process ended with exit status -9" in dead.outcome.message
    with pytest.raises(ArithmeticError, match="crashed: the FEniCSx process ended"):
        _ = dead.last
    assert session.solve(body, settings("Q1/P0")).last.points == pytest.approx(before.points, abs=1e-12)


def test_a_process_that_fails_says_why(session) -> None:  # noqa: F811
    body = turned(box("Q1/P0"), Rest())
    here = os.getpid()  # elsewhere it divides by zero
    wrong = Prescribed("x0", "x0", (0,), lambda points, _: 0 * points * (1 // int(os.getpid() == here)))
    lost = session.solve(replace(body, prescribed=(wrong,)), settings("Q1/P0"))
    assert lost.outcome.status == "crashed"
    assert "ZeroDivisionError" in lost.outcome.message
    assert session.solve(body, settings("Q1/P0")).outcome.status == "converged"


def test_a_closed_session_raises(session) -> None:  # noqa: F811, ARG001 - it skips where there is no FEniCSx
    with fenicsx.session() as short:
        pass
    with pytest.raises(RuntimeError, match="the session is closed"):
        short.solve(turned(box("Q1/P0"), Rest()), settings("Q1/P0"))


def test_without_fenicsx_there_is_no_session(monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(MissingSoftware, match="FEniCSx is not installed"), fenicsx.session():
        pass


def test_a_time_limit_ends_one_body_and_not_the_session(session) -> None:  # noqa: F811, ARG001 - it skips without FEniCSx
    body = turned(box("Q1/P0"), Rest())
    with fenicsx.session() as fresh:
        # To start the process alone takes longer.
        late = fresh.solve(body, settings("Q1/P0", time_limit="0.05 s"))
        assert (late.outcome.status, late.states) == ("timed out", ())
        assert "0 states are kept" in late.outcome.message
        with pytest.raises(ArithmeticError, match="timed out: stopped after"):
            _ = late.last
        assert fresh.solve(body, settings("Q1/P0", time_limit="60 s")).outcome.status == "converged"
        process = fresh.process
        assert fresh.solve(body, settings("Q1/P0")).outcome.status == "converged"
        assert fresh.process is process
