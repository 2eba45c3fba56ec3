"""Runs for ParaView: the reference with its states, taken as is where it has them, and solved again only if that is asked for."""

from pathlib import Path

import pytest
import small
from stand_ins import solve_by

import fem_reference as fr
from fem_reference import cli
from fem_reference.export import paraview
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench
from tests.runs.stored import SECONDS, store_run


@pytest.fixture
def solved(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Writes the small scene's reference into a store, with states or without; nothing may be solved again meanwhile."""
    folder = small.write(tmp_path / "bar")
    text = (folder / "case.toml").read_text()
    (folder / "case.toml").write_text(
        text.replace("0.4 rad", "0 rad")
    )  # nothing moves, so that a body at rest is its solution
    scene = casefile.read_muscle(folder)

    def refuse(*_: object) -> None:
        raise AssertionError("it is solved again")

    solve_by(monkeypatch, fenicsx, refuse)

    def write(*, kept: tuple[int, ...]) -> list[str]:
        bench = Bench(scene, tmp_path / "out" / "runs")
        place = bench.folder(scene.reference, "reference")
        store_run(place, bench, scene.numbers, kept)
        return [
            "export",
            str(folder),
            "--to",
            str(tmp_path / "paraview"),
            "--out",
            str(tmp_path / "out"),
            "--format",
            "paraview",
        ]

    return write


@pytest.mark.slow
def test_a_run_without_states_is_not_solved_again_unless_asked(solved, capsys, tmp_path: Path) -> None:
    words = solved(kept=())
    assert cli.main(words) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert "a reference that was solved without storing the states" in said
    assert "want --solve, which solves it again (last time this took 22 min)" in said
    assert not (tmp_path / "paraview").exists()
    assert cli.main([*words, "--solve"]) == cli.BROKEN  # it begins to, which the fixture forbids
    assert "it is solved again" in capsys.readouterr().err


def test_states_of_some_frames_are_not_taken_for_those_of_all(solved, capsys) -> None:
    assert cli.main(solved(kept=(0, 5))) == cli.BAD_INPUT
    assert "without storing the states" in capsys.readouterr().err


@pytest.mark.slow
def test_a_run_with_states_is_taken_as_it_is(solved, tmp_path: Path) -> None:
    assert cli.main(solved(kept=(0, 5, 10, 15, 20))) == cli.DONE
    assert (tmp_path / "paraview" / paraview.INDEX).is_file()


@pytest.mark.slow
def test_asking_for_states_changes_no_key_and_solves_only_what_has_none(solved, tmp_path: Path) -> None:
    solved(kept=())
    case = fr.load_case(tmp_path / "bar", {"reference.store_state": True})
    plain = fr.load_case(tmp_path / "bar")
    assert fr.solve(plain, store=tmp_path / "out" / "runs").outcome.cost["seconds"] == SECONDS
    said = list[str]()
    with pytest.raises(AssertionError, match="it is solved again"):
        fr.solve(case, store=tmp_path / "out" / "runs", progress=said.append)
    assert any("solved before, but its states were not stored; solving again" in line for line in said)
    solved(kept=(0, 5, 10, 15, 20))
    for one in (case, plain, fr.load_case(tmp_path / "bar", {"reference.store_state": False})):
        assert fr.solve(one, store=tmp_path / "out" / "runs").outcome.status == "converged"
