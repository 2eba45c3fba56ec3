"""Solvers. Each solver is a file or a folder, with the name that scene files use.

The file lists in ``SOLVES`` what it offers: a ``MuscleSolver``, a ``FieldSolver``, a ``BodySolver``, or several of them
(see ``common.protocol``). tests/contracts/test_every_solver.py tests the contract that every solver fulfils.
"""

import importlib
from typing import Any, Literal, overload

from fem_reference.effects import Effect
from fem_reference.foundations import modules
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join, parse
from fem_reference.problems.problem import Task
from fem_reference.scenes.case import Candidate, Case, SolverChoice
from fem_reference.solvers.common.protocol import BodySolver, FieldSolver, MuscleSolver, Solver, trades

__all__ = ["check", "choice", "find", "in_table", "names", "offers", "settings", "takes_effects", "trades"]


def names(task: Task | None = None) -> list[str]:
    """The names of the solvers that a scene file may choose: all of them, or only the solvers for a ``task``."""
    # The folder ``common`` and the modules with kernels contain code for solvers and are not solvers themselves.
    found = [name for name in modules.names(__path__) if name != "common" and not name.endswith("_kernels")]
    return [name for name in found if task is None or any(offer.task == task for offer in offers(name))]


def offers(name: str) -> tuple[Solver[Any, Any], ...]:
    """The entries of ``SOLVES`` of the solver ``name``, one for each task. Raises TypeError if ``SOLVES`` is missing or invalid."""
    found = vars(importlib.import_module(f"{__name__}.{name}")).get("SOLVES")
    if not isinstance(found, tuple) or not found or not all(isinstance(offer, Solver) for offer in found):
        want = "a tuple of MuscleSolver, FieldSolver or BodySolver (solvers/common/protocol.py)"
        raise TypeError(f"solvers/{name}: SOLVES is {found!r}, want {want}")
    return found


@overload
def find(name: str, place: str, task: Literal["solve"] = "solve") -> MuscleSolver[Any]: ...
@overload
def find(name: str, place: str, task: Literal["solve_field"]) -> FieldSolver[Any]: ...
@overload
def find(name: str, place: str, task: Literal["solve_body"]) -> BodySolver[Any]: ...
@overload
def find(name: str, place: str, task: Task) -> Solver[Any, Any]: ...
def find(name: str, place: str, task: Task = "solve") -> Solver[Any, Any]:
    """The solver ``name`` for a ``task``. Raises InputError at ``place`` if there is no such solver."""
    if name not in names():
        raise InputError(join(place, "solver"), f'"{name}"', f"one of {', '.join(names(task))}")
    for offer in offers(name):
        if offer.task == task:
            return offer
    kinds: dict[Task, type[Solver[Any, Any]]] = {kind.task: kind for kind in (MuscleSolver, FieldSolver, BodySolver)}
    got = f'"{name}", which does not solve {kinds[task].solves}'
    raise InputError(join(place, "solver"), got, f"one of {', '.join(names(task))}")


def in_table(kind: str | None = None) -> tuple[Candidate, ...]:
    """The candidates on the page table-5-1: all of them, or only those of one ``kind`` of method in the report's Table 5.1."""
    return tuple(
        Candidate(name=row.name, solver=name, **row.settings)
        for name in names("solve")
        for row in find(name, "").table
        if kind in (None, row.kind)
    )


def choice(case: Case, name: str) -> tuple[str, SolverChoice]:
    """The name of the run, and the solver with its settings, for ``name``, which is the name of a candidate or of a solver.

    The settings are those of such a candidate in the case; without one, those on the page table-5-1 (for a muscle) or the defaults.
    """
    own = [one for one in case.candidate if one.solver == name] + [one for one in case.candidate if one.name == name]
    table = [one for one in in_table() if one.solver == name and case.task == "solve"]
    for one in (*own, *table):
        return (one.name if own else name), one
    return name, SolverChoice(solver=name)


def takes_effects(name: str) -> bool:
    """True if the solver ``name`` models the effects of a scene."""
    return any(isinstance(offer, MuscleSolver) and offer.check_effects is not None for offer in offers(name))


def check(name: str, settings: Record, effects: tuple[Effect, ...], place: str, task: Task = "solve") -> None:
    """Raise InputError, with a key inside ``place``, if the solver ``name`` with these ``settings`` does not accept the effects."""
    offer = find(name, place, task)
    if isinstance(offer, MuscleSolver) and offer.check_effects is not None:
        offer.check_effects(settings, effects, place)


def settings(choice: SolverChoice, place: str, task: Task = "solve") -> Record:
    """The settings in ``choice``, parsed into the record that its solver defines.

    Raises InputError, with a key inside ``place``, if the settings are invalid.
    """
    record: type[Record] = find(choice.solver, place, task).record(choice.settings, place)
    return parse(record, choice.settings, place)
