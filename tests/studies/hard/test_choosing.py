"""Solvers of hard cases, each with settings of its own."""

import pytest

from fem_reference import solvers
from fem_reference.studies.hard import choosing


def test_the_reference_comes_first_and_every_solver_of_muscles_is_there() -> None:
    found = choosing.choices()
    assert list(found)[:2] == [choosing.REFERENCE, choosing.SECOND]
    assert set(solvers.names("solve")) - {"recorded"} <= set(found)
    assert "recorded" not in found


@pytest.mark.parametrize(
    ("solver", "task", "asked"),
    [("pbd", "solve", "solve"), ("scikit_fem", "solve", "solve_body"), ("scikit_fem", "solve_field", "solve_field")],
)
def test_each_is_asked_for_what_it_solves(solver: str, task: str, asked: str) -> None:
    assert choosing.task_of(solver, task) == asked
    assert solvers.find(solver, "here", asked).task == asked
