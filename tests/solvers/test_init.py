"""A solver that a case has no settings for runs with those of the page table-5-1, wherever it is asked for."""

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


@pytest.mark.parametrize("solver", [name for name in solvers.names("solve") if name not in ("fenicsx", "recorded")])
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
