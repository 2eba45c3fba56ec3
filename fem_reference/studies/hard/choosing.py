"""Solvers that hard cases are solved by, and the settings of each."""

from typing import Any

from fem_reference import solvers
from fem_reference.problems.problem import Task
from fem_reference.scenes.case import SolverChoice

REFERENCE, SECOND = "fenicsx", "scikit_fem"
LIMIT = 120.0  # [s] of processor time of a run
_OWN: dict[str, dict[str, Any]] = {
    REFERENCE: {"ranks": 1, "time_limit": f"{LIMIT:g} s", "residual": 1e-8},
    SECOND: {},
    "line_of_action": {},
}


def choices() -> dict[str, SolverChoice]:
    """Settings that hard cases are solved with, by solver: those of the first candidate of Table 5.1 that has it."""
    found: dict[str, SolverChoice] = {}
    for candidate in solvers.in_table():
        found.setdefault(candidate.solver, SolverChoice(solver=candidate.solver, **candidate.settings))
    for name in solvers.names():
        if name != "recorded" and (name in _OWN or name in found):
            found.setdefault(name, SolverChoice(solver=name, **_OWN.get(name, {})))
    first = [name for name in (REFERENCE, SECOND) if name in found]
    return {name: found[name] for name in (*first, *sorted(set(found) - {*first}))}


def task_of(solver: str, task: Task) -> Task:
    """The task that a solver is asked for in a case of a ``task``: the second solver has none for muscles but that of bodies."""
    return "solve_body" if task == "solve" and solver == SECOND else task
