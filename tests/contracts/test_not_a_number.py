"""What is not a number is no solution: neither what is prescribed, nor the energy of a law beyond where it has one."""

import os
import sys
from dataclasses import replace

import numpy as np
import pytest

from fem_reference import effects
from fem_reference.foundations import outside
from fem_reference.problems.body import Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx import BodySettings
from tests.solvers.fenicsx.conftest import session  # noqa: F401 - a fixture
from tests.solvers.fenicsx.test_body import ALL, box, settings, turned

pytestmark = pytest.mark.slow


def test_what_is_not_a_number_is_no_solution(session) -> None:  # noqa: F811
    """Neither what is prescribed, though no residual shows it, nor the energy of a law beyond where it has one."""
    here = os.getpid()  # elsewhere nothing is prescribed, so that nobody sees it before it is solved
    nothing = Prescribed("top", "z1", ALL, lambda points, _: points * (0.0 if os.getpid() == here else np.nan))
    body = turned(box("Q1/P0"), Rest())
    for wrong in (nothing, replace(nothing, components=(2,)), replace(nothing, stiffness=1.0)):
        solved = session.solve(replace(body, prescribed=(body.prescribed[0], wrong)), settings("Q1/P0"))
        assert solved.outcome.status == "diverged"
        assert "in 0 iterations a state where a law, or a prescribed path, has no value" in solved.outcome.message
        assert np.isfinite(solved.states[-1].points).all()


GENT = '''"""Gent's limiting chain law."""

from typing import Any

from fem_reference.effects import Energy, State


class Gent(Energy):
    """``-mu limit / 2 log(1 - (I1 - 3) / limit)``."""

    mu: float
    limit: float

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return -self.mu * self.limit / 2 * state.functions.log(1 - (state.I1 - 3) / self.limit)
'''


@pytest.fixture
def gent(tmp_path, monkeypatch):
    """A law of one's own, which has a value up to its limit only and a slope beyond it too."""
    (tmp_path / "gent.py").write_text(GENT)
    monkeypatch.setenv(outside.SETTING, str(tmp_path))
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, *outside.folders()])
    yield effects.make("gent", mu=0.01, limit=2.0)
    sys.modules.pop("fem_reference.effects.gent", None)


@pytest.mark.parametrize("solver", ["fenicsx", "scikit_fem"])
def test_a_law_beyond_where_it_has_a_value_is_no_solution(solver, gent) -> None:
    """Every corner is prescribed, so that no force is out of balance; at a stretch of 2 the first invariant is 6, the limit 5."""
    stretch = Affine(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    body = replace(turned(box("Q1", (1, 1, 1)), stretch), effects=(gent,), frames=(0.0, 0.5, 1.0))
    given = {"element": "Q1", "first_step": 1.0}
    if solver == "scikit_fem":
        solved = scikit_fem.solve_body(body, scikit_fem.ScikitBodySettings(**given))
    else:
        with fenicsx.session() as own:  # whose process knows the law
            solved = own.solve(body, BodySettings(**given))
    assert solved.outcome.status == "diverged"
    assert "in which the energy is not a number" in solved.outcome.message
    assert [state.number for state in solved.states] == [0.0, 0.5]
    # At a stretch of 1.5, I1 - 3 is 1.25: mu log(8 / 3).
    assert solved.states[-1].scalars["energy"] == pytest.approx(0.01 * np.log(8 / 3), rel=1e-9)
