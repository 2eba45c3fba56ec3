"""One process solves body after body, outlives a failure, and ends with its session; scalar fields are solved in it too."""

import importlib.util
import os
import sys
from dataclasses import replace

import fields
import numpy as np
import pytest

from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest, Turn
from fem_reference.problems.scalar import FieldProblem, build
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import FieldSettings
from fem_reference.solvers.fenicsx.processes import installed
from fem_reference.solvers.fenicsx.session import Session
from tests.solvers.fenicsx.test_body import FLESH, box, settings, turned

pytestmark = pytest.mark.slow
fenicsx_only = pytest.mark.skipif(not installed(), reason="FEniCSx is not installed")


def test_a_session_checks_the_element(session) -> None:
    with pytest.raises(InputError, match="want an element for tetrahedron cells"):
        session.solve(Body(box("P1"), FLESH, (), (0.0, 1.0)), settings("Q1/P0"))


def test_a_session_outlives_its_process(session) -> None:
    body = turned(box("Q1/P0"), Turn((0.0, 0.0, 1.0), 0.3))
    before = session.solve(body, settings("Q1/P0")).last
    session.process.process.kill()
    dead = session.solve(body, settings("Q1/P0"))
    assert (dead.outcome.status, dead.states) == ("crashed", ())
    assert "the FEniCSx process ended with exit status -9" in dead.outcome.message
    with pytest.raises(ArithmeticError, match="crashed: the FEniCSx process ended"):
        _ = dead.last
    assert session.solve(body, settings("Q1/P0")).last.points == pytest.approx(before.points, abs=1e-12)


def test_a_process_that_fails_says_why(session) -> None:
    body = turned(box("Q1/P0"), Rest())
    here = os.getpid()  # elsewhere it divides by zero
    wrong = Prescribed("x0", "x0", (0,), lambda points, _: 0 * points * (1 // int(os.getpid() == here)))
    lost = session.solve(replace(body, prescribed=(wrong,)), settings("Q1/P0"))
    assert lost.outcome.status == "crashed"
    assert "ZeroDivisionError" in lost.outcome.message
    assert session.solve(body, settings("Q1/P0")).outcome.status == "converged"


def test_a_closed_session_raises(session) -> None:  # noqa: ARG001 - it skips without FEniCSx
    with fenicsx.session() as short:
        pass
    with pytest.raises(RuntimeError, match="the session is closed"):
        short.solve(turned(box("Q1/P0"), Rest()), settings("Q1/P0"))


def test_without_fenicsx_there_is_no_session(monkeypatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(MissingSoftware, match="FEniCSx is not installed"), fenicsx.session():
        pass


def test_a_time_limit_ends_one_body_and_not_the_session(session) -> None:  # noqa: ARG001 - it skips without FEniCSx
    body = turned(box("Q1/P0"), Rest())
    with fenicsx.session() as fresh:
        # To start the process alone takes longer.
        late = fresh.solve(body, settings("Q1/P0", time_limit="0.05 s"))
        assert (late.outcome.status, late.states) == ("timed out", ())
        assert "no frame was reached" in late.outcome.message
        with pytest.raises(ArithmeticError, match="timed out: stopped after"):
            _ = late.last
        assert fresh.solve(body, settings("Q1/P0", time_limit="60 s")).outcome.status == "converged"
        process = fresh.process
        assert fresh.solve(body, settings("Q1/P0")).outcome.status == "converged"
        assert fresh.process is process


def resonant(tmp_path) -> FieldProblem:
    """-psi'' = rate psi on three nodes of [0, 1], fixed on the left, at the rate of the mode sin(pi x / 2), which can then be
    added.

    Of linear elements of length h the mode sin(k x) has the rate 6 / h^2 (1 - cos kh) / (2 + cos kh).
    """
    cosine = np.cos(np.pi / 4)
    scene = fields.scene(
        tmp_path,
        domain={"nodes": [0.0, 0.5, 1.0]},
        effect=[
            {"name": "diffusion", "coefficient": 1.0},
            {"name": "reaction", "rate": float(-24 * (1 - cosine) / (2 + cosine))},
        ],
        boundary=[{"on": "left", "value": 1.0}],
    )
    return build(scene)


def solved_by(program: str, settings: FieldSettings, tmp_path, monkeypatch):
    """What becomes of three nodes where the process that solves runs another ``program``."""
    sessions = sys.modules[Session.__module__]  # the package has a function of this module's name
    monkeypatch.setattr(sessions, "opened", fenicsx.session)
    monkeypatch.setattr(sessions, "command_line", lambda _: [sys.executable, "-c", program])
    return fenicsx.solve_field(resonant(tmp_path), settings)


@fenicsx_only
def test_of_a_field_whose_process_dies_nothing_is_known(tmp_path, monkeypatch) -> None:
    solution = solved_by("import sys; sys.exit('no memory')", FieldSettings(), tmp_path, monkeypatch)
    assert solution.outcome.status == "crashed"
    assert "exit status 1 (no memory); no frame was reached" in solution.outcome.message
    assert solution.values[0].shape == (3,)
    assert np.isnan(solution.values).all()


@fenicsx_only
def test_of_a_field_over_its_time_limit_nothing_is_known(tmp_path, monkeypatch) -> None:
    limit = FieldSettings.model_validate({"time_limit": "0.5 s"})
    solution = solved_by("while True: pass", limit, tmp_path, monkeypatch)
    assert solution.outcome.status == "timed out"
    assert np.isnan(solution.values).all()


def test_fields_name_missing_software(tmp_path, monkeypatch) -> None:
    problem = resonant(tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    for wants in (fenicsx.require, lambda settings: fenicsx.solve_field(problem, settings)):
        with pytest.raises(MissingSoftware, match=r"pip install 'fem_reference\[fenicsx\]'"):
            wants(FieldSettings())
