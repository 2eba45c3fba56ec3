"""Who computes: one file per solver, named as in scene files.

Contract (tests/test_solvers.py): a module has ``Settings``, a strict record of its own settings, and
``solve(problem, settings, sink) -> Outcome``, which sinks every requested frame as it is reached. Physics that fails is a status
with a sentence, never an exception; what was reached before stays.
"""

import importlib
import pkgutil
from typing import Protocol, cast

from fem_reference.errors import InputError
from fem_reference.problem import Problem
from fem_reference.records import Record, join, parse
from fem_reference.runs import Outcome, Sink
from fem_reference.scene import SolverChoice


class Solver(Protocol):
    """What a solver module provides."""

    Settings: type[Record]

    @staticmethod
    def solve(problem: Problem, settings: Record, sink: Sink) -> Outcome:
        """Sink each requested frame of ``problem`` and say how it ended."""
        ...


def names() -> list[str]:
    """The solvers there are, as scene files name them."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__) if not module.name.endswith("_kernels"))


def find(name: str, place: str) -> Solver:
    """The solver ``name``; InputError at ``place`` where there is none."""
    if name not in names():
        raise InputError(join(place, "solver"), f'"{name}"', f"one of {', '.join(names())}")
    return cast(Solver, importlib.import_module(f"{__name__}.{name}"))


def require(name: str, settings: Record, place: str) -> None:
    """MissingSoftware where the solver ``name`` needs what is not installed; a module says so in ``require(settings)``."""
    check = getattr(find(name, place), "require", None)
    if check is not None:
        check(settings)


def settings(choice: SolverChoice, place: str) -> Record:
    """The settings of a choice, checked by its solver; ``place`` is where the scene makes the choice."""
    return parse(find(choice.solver, place).Settings, choice.settings, place)
