"""Solvers: one file each, named as in scene files.

Contract (tests/test_solvers.py): a solver of muscles has ``Settings``, a strict record of its own settings, and
``solve(problem, settings, sink) -> Outcome``, which sinks every requested frame as it is reached. A solver of scalar fields has
``FieldSettings`` and ``solve_field(problem, settings) -> Solution``; one of bodies of any shape has ``BodySettings`` and
``solve_body(body, settings) -> Solved``. Some are more than one. Physics that fails is a status with a
sentence, never an exception; what was reached before stays.
"""

import importlib
import pkgutil
from typing import Any, Literal

from fem_reference.effects import Effect
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join, parse
from fem_reference.scenes.case import SolverChoice

Task = Literal["solve", "solve_field", "solve_body"]
_TASKS: dict[Task, tuple[str, str]] = {
    "solve": ("Settings", "muscles"),
    "solve_field": ("FieldSettings", "scalar fields"),
    "solve_body": ("BodySettings", "finite element bodies"),
}


def names(task: Task | None = None) -> list[str]:
    """The solvers there are, as scene files name them: all, or those for a ``task``."""
    found = sorted(module.name for module in pkgutil.iter_modules(__path__) if not _is_shared(module.name))
    return [name for name in found if task is None or hasattr(_module(name), task)]


def _is_shared(module: str) -> bool:
    """Whether a ``module`` of this folder is no solver but serves some."""
    return module == "common" or module.endswith("_kernels")


def _module(name: str) -> Any:
    return importlib.import_module(f"{__name__}.{name}")


def find(name: str, place: str, task: Task = "solve") -> Any:
    """The module of the solver ``name`` for a ``task``; InputError at ``place`` where there is none."""
    if name not in names():
        raise InputError(join(place, "solver"), f'"{name}"', f"one of {', '.join(names(task))}")
    module = _module(name)
    if not hasattr(module, task):
        got = f'"{name}", which does not solve {_TASKS[task][1]}'
        raise InputError(join(place, "solver"), got, f"one of {', '.join(names(task))}")
    return module


def require(name: str, settings: Record, place: str, task: Task = "solve") -> None:
    """MissingSoftware where the solver ``name`` needs what is not installed; a module says so in ``require(settings)``."""
    check = getattr(find(name, place, task), "require", None) if task == "solve" else None
    if check is not None:
        check(settings)


def takes_effects(name: str) -> bool:
    """Whether the solver ``name`` simulates the effects of a scene; one that does says which in ``check_effects``."""
    return hasattr(_module(name), "check_effects")


def check(name: str, settings: Record, effects: tuple[Effect, ...], place: str, task: Task = "solve") -> None:
    """InputError below ``place`` where ``settings`` do not suit the ``effects``; a module says so in ``check_effects``."""
    suits = getattr(find(name, place, task), "check_effects", None) if task == "solve" else None
    if suits is not None:
        suits(settings, effects, place)


def settings(choice: SolverChoice, place: str, task: Task = "solve") -> Record:
    """The settings of a choice, checked by its solver; ``place`` is where the scene makes the choice."""
    record: type[Record] = getattr(find(choice.solver, place, task), _TASKS[task][0])
    return parse(record, choice.settings, place)
