"""Runs of hard cases as their health is measured: by surface solvers, by bodies and of scalar fields."""

import numpy as np
import pytest
import stand_ins

from fem_reference.foundations.errors import InputError
from fem_reference.problems import of_case
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import pbd
from fem_reference.studies.hard import blocks, records
from fem_reference.studies.hard.following import follow
from fem_reference.studies.hard.repeats import StalledError

CASES = {hard.name: hard for hard in records.read_all()}


@pytest.mark.parametrize("solver", ["pbd", "scikit_fem"])
def test_at_rest_a_surface_stays_where_it_is(solver: str) -> None:
    problem = blocks.problem(CASES["at_rest.millimetres"])
    if solver == "scikit_fem":  # it takes up to 200 tetrahedra
        small = CASES["at_rest.millimetres"].block.model_copy(update={"cells": (2, 2, 3)})
        problem = blocks.problem(CASES["at_rest.millimetres"].model_copy(update={"block": small}))
    outcome, followed = follow(problem, records.choices()[solver])
    assert outcome.status == "converged"
    assert followed.numbers == problem.frames
    assert np.abs(followed.positions - problem.surface.points).max() < 1e-6
    assert (followed.nodes is None) == (solver == "pbd")


def test_a_body_of_many_tetrahedra_is_too_large_for_the_second_solver() -> None:
    block = CASES["at_rest.millimetres"].block.model_copy(update={"cells": (4, 4, 8)})
    problem = blocks.problem(CASES["at_rest.millimetres"].model_copy(update={"block": block}))
    with pytest.raises(InputError, match="got 768 tetrahedra, want at most 200"):
        follow(problem, records.choices()["scikit_fem"])


def test_a_solver_that_moves_lines_has_no_health() -> None:
    with pytest.raises(InputError, match="got a solver that moves lines, want one that moves a surface"):
        follow(blocks.problem(CASES["at_rest.millimetres"]), records.choices()["line_of_action"])


def test_a_field_has_the_range_of_its_boundary_values() -> None:
    hard = next(hard for hard in CASES.values() if hard.name.startswith("peclet"))
    case = hard.shipped.read()
    outcome, followed = follow(of_case.problem(case, of_case.setup(case)), SolverChoice(solver="scikit_fem"))
    values = [float(entry.value) for entry in case.boundary if entry.value is not None]
    assert followed.range == (min(values), max(values))
    assert followed.values.shape[0] == 1
    assert outcome.status == "converged"


def test_what_is_solved_at_no_frame_is_where_it_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: Outcome("diverged", "at once"))
    problem = blocks.problem(CASES["at_rest.millimetres"])
    followed = follow(problem, records.choices()["pbd"])[1]
    assert np.array_equal(followed.positions, problem.surface.points[None])
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: Outcome("stalled", "busy"))
    with pytest.raises(StalledError, match="busy"):
        follow(problem, records.choices()["pbd"])
