"""Solvers as scene files name them: found by their files, and for the tasks that they offer."""

import pytest

from fem_reference import solvers
from fem_reference.foundations.errors import InputError


def test_kernels_and_what_is_shared_are_no_solvers() -> None:
    found = solvers.names()
    assert {"fenicsx", "scikit_fem", "pbd", "recorded"} <= set(found)
    assert not {name for name in found if name.endswith("_kernels") or name == "common"}


def test_each_task_has_solvers_of_its_own() -> None:
    assert "listing" in solvers.names("solve_field")
    assert "listing" not in solvers.names("solve")
    with pytest.raises(InputError, match=r'candidate\.solver: got "listing", which does not solve muscles'):
        solvers.find("listing", "candidate")


def test_only_some_simulate_the_effects_of_a_case() -> None:
    assert solvers.takes_effects("fenicsx")
    assert not solvers.takes_effects("pbd")
