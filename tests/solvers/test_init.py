"""Solvers as scene files name them, for the tasks that they offer, and with the settings of the page table-5-1."""

from pathlib import Path

import pytest
import small

from fem_reference import solvers
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile


def test_the_candidate_of_a_case_comes_first_by_solver_then_by_name(tmp_path: Path) -> None:
    case = casefile.read(small.write(tmp_path / "bar"))
    assert solvers.choice(case, "pbd") == ("pbd", case.candidate[0])
    renamed = case.model_copy(update={"candidate": (case.candidate[0].model_copy(update={"name": "mine"}),)})
    assert solvers.choice(renamed, "pbd")[0] == solvers.choice(renamed, "mine")[0] == "mine"


@pytest.mark.parametrize(
    "solver", [name for name in solvers.names("solve") if name not in ("fenicsx", "recorded", "command")]
)
def test_every_other_solver_has_settings_that_it_takes(tmp_path: Path, solver: str) -> None:
    case = casefile.read(small.write(tmp_path / "bar")).model_copy(update={"candidate": ()})
    name, found = solvers.choice(case, solver)
    assert name == solver
    solvers.settings(found, "test")
    listed = [one for one in solvers.in_table() if one.solver == solver]
    assert found.settings == (listed[0].settings if listed else {})


def test_a_row_of_a_solver_is_of_a_kind_of_the_report() -> None:
    kinds = {one.name for one in solver_kinds()}
    rows = [row for name in solvers.names("solve") for row in solvers.find(name, "test").table]
    assert {row.kind for row in rows} <= kinds
    assert len({row.name for row in rows}) == len(rows)
    assert {one.name for kind in kinds for one in solvers.in_table(kind)} == {row.name for row in rows}


def test_a_name_of_a_shipped_case_and_of_a_folder_here_is_refused(tmp_path: Path, monkeypatch) -> None:
    small.write(tmp_path / "hip_flexion")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(
        InputError, match=r"which is a shipped case and a folder here, want \./hip_flexion for the folder"
    ):
        casefile.read("hip_flexion")
    assert casefile.read("./hip_flexion").title == "A bar between two plates"


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
