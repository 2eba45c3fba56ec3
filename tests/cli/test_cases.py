"""A solver of one's own by its command line, through every verb that takes candidates."""

import json
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx

pytestmark = pytest.mark.usefixtures("without_pictures")
OWN = Path(__file__).parents[2] / "examples" / "own_command"


def lifted(problem: MuscleProblem, _: object, sink) -> Outcome:
    """In place of the reference: everything moves up, by the frame number over 10 [mm]."""
    for number in problem.frames:
        up = np.array([0, 0, number / 10])
        sink(Frame(number, problem.surface.points + up, problem.fibres.points + up))
    return Outcome("converged", "done", {"seconds_solve": 8.0})


@pytest.fixture
def command(tmp_path, monkeypatch) -> str:
    """The command, where a scene and a folder with the solver are; the folder's name has a blank."""
    stand_ins.solve_by(monkeypatch, fenicsx, lifted)
    stand_ins.unchecked(monkeypatch)
    small.write(tmp_path / "bar")
    shutil.copytree(OWN, tmp_path / "my solver")
    monkeypatch.chdir(tmp_path)
    return f"{shlex.quote(sys.executable)} 'my solver/relax.py' --iterations {{iterations}} {{scene}} {{out}}"


@pytest.mark.slow
def test_it_is_compared_studied_recommended_and_stressed(command, capsys, monkeypatch) -> None:
    monkeypatch.setattr("fem_reference.studies.cost._POWERS", ())
    own = ["--solver-command", command, "--json", "facts.json"]
    assert cli.main(["compare", "./bar", *own]) == cli.DONE
    facts = json.loads(Path("facts.json").read_text())
    assert facts["cost"]["relax"]["seconds_processor"] > 0
    capsys.readouterr()
    assert cli.main(["study", "./bar", "--solver", "command", *own]) == cli.DONE
    assert "relax: solved before" in capsys.readouterr().err
    points = json.loads(Path("facts.json").read_text())["cases"][0]["points"]
    assert {point["solver"] for point in points} == {"relax"}
    assert [point["choice"]["iterations"] for point in points] == [30, 3, 300]
    assert all(point["costs"]["seconds_processor"] > 0 for point in points)
    assert len({json.dumps(point["errors"]) for point in points}) == 3
    assert cli.main(["recommend", "./bar", "--error", "1 m"]) == cli.DONE
    assert "relax: " in (said := capsys.readouterr().out)
    assert "iterations = " in said
    hard = ["at_rest.millimetres", "start.point", "peclet.plain"]
    assert cli.main(["stress", *hard, "--solver", "command", *own]) == cli.DONE
    cells = json.loads(Path("facts.json").read_text())["cells"]
    assert [(cell["solver"], cell["verdict"]) for cell in cells] == [
        ("relax", "ok"),
        ("relax", "not applicable"),
        ("relax", "not applicable"),
    ]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (
            ["compare", "./bar", "--solver-command", "gone {scene} {out}"],
            '--solver-command: got "gone", want a program',
        ),
        (["study", "./bar", "--solver-command", "OWN {speed}"], "candidate.toml: settings.speed: got nothing"),
        (["stress", "--solver-command", "OWN"], '--candidate: got "pbd" twice'),
        (["study", "./bar", "--solver-command", "OWN"], '--candidate: got "pbd" twice'),
        (["compare", "./bar", "--solver", "pbd", "--solver-command", "OWN"], '--candidate: got "pbd" twice'),
        (
            ["page", "error-bars", "--solver-command", "OWN"],
            "page: got --solver-command for error-bars, want this option for table-5-1 only",
        ),
        (["compare", "./bar", "--set", "candidate[0].solver=command"], "a scene file cannot run a program"),
        (["run", "./bar", "--set", "reference.solver=command"], "a scene file cannot run a program"),
        (["compare", "./bar", "--solver", "command"], "command: got nothing, want this key"),
    ],
)
def test_a_command_that_cannot_be_used_is_bad_input(command, words, problem, capsys) -> None:
    about = Path("my solver", "candidate.toml")
    if "twice" in problem:
        about.write_text(about.read_text().replace('"relax"', '"pbd"'))
    assert cli.main([word.replace("OWN", command) for word in words]) == cli.BAD_INPUT
    assert problem in capsys.readouterr().err
    assert not Path("reports").exists()


@pytest.mark.slow
def test_a_command_that_fails_is_the_failure_of_a_solver(command, capsys) -> None:
    Path("my solver", "relax.py").write_text("raise SystemExit('no way')")
    assert cli.main(["compare", "./bar", "--solver-command", command]) == cli.SOLVER_FAILED
    assert "relax: crashed, exit status 1" in (said := capsys.readouterr().out)
    assert "no way" in said
