"""Solvers of tests that stand in for shipped ones."""

from dataclasses import replace
from types import ModuleType

import pytest

from fem_reference.assessment import second_check
from fem_reference.assessment.run_checks import RunCheck
from fem_reference.solvers.common.protocol import MuscleSolver, Solve


def solve_by(monkeypatch: pytest.MonkeyPatch, module: ModuleType, solve: Solve) -> None:
    """Let the solver in ``module`` solve muscles by ``solve``, whatever is installed."""
    changes = {"solve": solve, "require": lambda _: None, "go_on": None}
    offers = (replace(one, **changes) if isinstance(one, MuscleSolver) else one for one in module.SOLVES)
    monkeypatch.setattr(module, "SOLVES", tuple(offers))


def unchecked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ask no second check, which has tests of its own: what stands in for the reference leaves its bones."""
    monkeypatch.setattr(second_check, "of_muscle", lambda *_: ())


def deny_further_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the second check deny each run but the reference itself."""
    denied = (RunCheck("det F", 2.0, 1.0, "", 10),)
    monkeypatch.setattr(second_check, "of_muscle", lambda _, run, __: () if run.name == "reference" else denied)
