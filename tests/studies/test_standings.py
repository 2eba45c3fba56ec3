"""Standings made: ours, a program and a submission on a case; rows that hold are kept, stale ones marked, submissions checked."""

import hashlib
import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.assessment.standings import ERROR
from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate
from fem_reference.solvers import fenicsx, pbd
from fem_reference.studies import law_split, standings, table_5_1

pytestmark = pytest.mark.slow

PROGRAM = """
import pathlib, shutil, sys
scene, out = map(pathlib.Path, sys.argv[3:])
for frame in (0, 5, 10, 15, 20):
    shutil.copy(scene / "muscle.ply", out / f"frame_{frame:04d}.ply")
"""


def shift(problem, _, sink) -> Outcome:
    """In place of the reference: everything moves up, by a hundredth of the frame number [mm]."""
    for number in problem.frames:
        up = np.array([0, 0, number / 100])
        sink(Frame(number, problem.surface.points + up, problem.fibres.points + up))
    return Outcome("converged", "done", {"seconds_solve": 8.0})


@pytest.fixture
def place(tmp_path, monkeypatch) -> Path:
    """A folder with the small case, the program ``still``, and frames of it 1 mm off in the last."""
    stand_ins.solve_by(monkeypatch, fenicsx, shift)
    stand_ins.unchecked(monkeypatch)
    monkeypatch.setattr(table_5_1.solvers, "in_table", lambda _kind=None: ())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(Path(sys.executable).parent), prepend=":")
    small.write(tmp_path / "bar")
    Path("still").mkdir()
    Path("still/still.py").write_text(PROGRAM)
    Path("still/candidate.toml").write_text('name = "still"\nversion = "7"\ngroup = "Theirs"\n[settings]\nspeed = 1\n')
    submit(tmp_path / "mine")
    return tmp_path


def submit(folder: Path, **about: str) -> None:
    folder.mkdir(exist_ok=True)
    body, hashes = small.body(), {}
    for frame in (0, 5, 10, 15, 20):
        path = folder / f"frame_{frame:04d}.ply"
        files.write_surface(path, body, body.points + [0, 0, frame / 100 + (frame == 20)])
        hashes[path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    said = {"name": "mine", "version": "2", "case": "bar", "unit": "mm"} | about
    lines = [f'{key} = "{value}"' for key, value in said.items() if value]
    lines += ["[sha256]", *(f'"{name}" = "{value}"' for name, value in hashes.items())]
    (folder / "candidate.toml").write_text("\n".join(lines))


def stand(*words: str) -> dict:
    assert cli.main(["standings", "./bar", *words, "--quiet"]) in (cli.DONE, cli.SOLVER_FAILED)
    return json.loads(Path("reports/standings.json").read_text())


@pytest.mark.usefixtures("place")
def test_everybody_stands_with_provenance_and_what_holds_is_kept(monkeypatch) -> None:
    first = stand("--program", "still", "--submission", "mine")
    rows = {row["name"]: row for row in first["rows"]}
    assert [(row["group"], row["name"], row["version"]) for row in first["rows"]][1:] == [
        ("Theirs", "still", "7"),
        ("Yours", "mine", "2"),
    ]
    assert rows["mine"]["worst"][ERROR] == pytest.approx(1, abs=1e-6)
    assert rows["mine"]["status"] == "converged"
    assert rows["mine"]["unsound"] == ""
    assert rows["mine"]["machine"] == "as stated by its authors" != rows["still"]["machine"]
    assert rows["still"]["least_time"] == rows["still"]["seconds_per_frame"] > 0  # it is 0.2 mm off
    assert rows["mine"]["least_error"] is rows["mine"]["least_time"] is None  # its time is not of this machine
    assert rows["still"]["from_rest"] is None  # nor is the reference back at rest
    assert rows["still"]["unsound"].startswith("stuck: ") is False  # the reference moves by 0.2 mm alone
    assert all(row["date"] and row["machine"] and len(row["frames"]) == 64 for row in first["rows"])
    assert first["missing"] == {}
    assert first["changes"] == []
    page = Path("reports/standings.html").read_text()
    assert "Theirs" in page
    assert "still" in page

    def never(*_):
        raise AssertionError("it is run again")

    with monkeypatch.context() as patch:
        patch.setattr(standings._Measured, "run", never)
        assert stand("--program", "still", "--submission", "mine", "--only", "failed,stale")["rows"] == first["rows"]
    Path("still/still.py").write_text(PROGRAM + "# another version\n")
    kept = stand("--program", "still", "--submission", "mine", "--only", "failed")
    assert [row["stale"] for row in kept["rows"]] == [False, True, False]
    assert "stale" in Path("reports/standings.html").read_text()
    anew = stand("--program", "still", "--submission", "mine", "--only", "stale")
    assert [row["stale"] for row in anew["rows"]] == [False] * 3
    assert anew["rows"][1]["run"] != first["rows"][1]["run"]


def test_a_submission_is_never_the_reference_whatever_it_says(place) -> None:
    submit(place / "mine", group="FEM")
    rows = stand("--submission", "mine")["rows"]
    assert [(row["group"], row["name"], ERROR in row["worst"]) for row in rows] == [
        ("FEM", "reference", False),
        ("FEM", "mine", True),
    ]
    submit(place / "mine", name="reference")
    found = stand("--submission", "mine")
    assert [row["name"] for row in found["rows"]] == ["reference"]
    assert "the name of one of our solvers" in found["missing"]["bar, reference"]


def test_a_submission_that_is_not_as_it_was_submitted_is_refused(place, capsys) -> None:
    def refused(want: str) -> None:
        assert cli.main(["standings", "./bar", "--submission", "mine"]) == cli.BAD_INPUT
        assert want in capsys.readouterr().err

    for key in ("case", "version", "name"):
        submit(place / "mine", **{key: ""})
        refused(f"candidate.toml: {key}: got nothing, want this key in a submission")
    submit(place / "mine")
    (place / "mine" / "more.ply").write_text("x")
    refused("sha256: got no more.ply, want every file next to it")
    (place / "mine" / "more.ply").unlink()
    body = small.body()
    files.write_surface(place / "mine" / "frame_0020.ply", body, body.points)
    for only in ((), ("--only", "failed")):
        found = stand("--submission", "mine", *only)
        assert [row["name"] for row in found["rows"]] == ["reference"]
        assert "sha256.frame_0020.ply" in found["missing"]["bar, mine"]


def test_a_submission_is_of_one_case_as_it_was_published(place, capsys) -> None:
    for words in (("--quick",), ("--set", "reference.newton_iterations=7")):
        assert cli.main(["standings", "./bar", "--submission", "mine", *words]) == cli.BAD_INPUT
        assert "--submission: got this option with --quick or --set" in capsys.readouterr().err
    key = casefile.read_muscle("./bar", {"reference.newton_iterations": 7}).key
    submit(place / "mine", scene=key)
    assert ERROR in stand("--submission", "mine", "--set", "reference.newton_iterations=7")["rows"][1]["worst"]
    submit(place / "mine", scene="of another one")
    assert f'got "of another one", want "{key}"' in stand("--submission", "mine")["missing"]["bar, mine"]
    submit(place / "mine", case="baar", seconds_per_frame="")
    found = stand("--submission", "mine")
    assert found["missing"] == {"baar, mine": "not one of the cases solved here: bar"}
    submit(place / "mine", name="still")
    assert cli.main(["standings", "./bar", "--program", "still", "--submission", "mine"]) == cli.BAD_INPUT
    assert "still: got two solvers of this name on a case" in capsys.readouterr().err


def test_the_time_of_a_submission_is_not_ranked(place) -> None:
    submit(place / "mine")
    about = place / "mine" / "candidate.toml"
    about.write_text("seconds_per_frame = 0.001\n" + about.read_text())
    mine = stand("--submission", "mine")["rows"][-1]
    assert (mine["seconds_per_frame"], mine["least_error"], mine["least_time"]) == (0.001, None, None)


@pytest.mark.usefixtures("place")
def test_a_program_states_its_group_and_law() -> None:
    found = standings.program(Path("still"))
    assert (found.group, found.version, found.law, found.candidate.settings["speed"]) == ("Theirs", "7", None, 1)
    law = standings.program(Path(__file__).parents[2] / "candidates" / "mujoco_flex")
    assert (law.group, law.law, law.takes) == ("Implicit FEM", "st_venant_kirchhoff", ())
    assert casefile.read("hip_flexion").name in standings.CASES


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            'law = "hooke"',
            'still/candidate.toml: law: got "hooke", want corotated, squared_invariants, st_venant_kirchhoff',
        ),
        ('law = "contact"', 'law: got "contact", want corotated'),
        ('law = "stable_neo_hooke"', "candidate.toml: settings.poisson: got nothing, want the Poisson's ratio"),
    ],
)
def test_a_law_that_cannot_be_split_is_refused_before_anything_is_solved(law, message, capsys) -> None:
    about = Path("still/candidate.toml")
    about.write_text(f"{law}\n{about.read_text()}")
    assert cli.main(["standings", "./bar", "--program", "still"]) == cli.BAD_INPUT
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("poisson", [0.5, 0.0, -0.1, float("nan"), "0.45", True])
def test_a_poisson_ratio_has_no_value_beyond_its_range(poisson) -> None:
    with pytest.raises(InputError, match=r"settings\.poisson"):
        law_split.check_law("stable_neo_hooke", poisson, "candidate.toml")


@pytest.mark.usefixtures("place")
def test_a_reference_that_fails_leaves_the_rows_before_stale(monkeypatch) -> None:
    stand("--program", "still")

    def stop(problem, _, sink) -> Outcome:
        sink(Frame(0, problem.surface.points, problem.fibres.points))
        return Outcome("diverged", "at frame 5")

    stand_ins.solve_by(monkeypatch, fenicsx, stop)
    found = stand("--program", "still", "--set", "reference.newton_iterations=7")
    assert "a reference with status diverged: at frame 5" in found["missing"]["bar"]
    assert [row["stale"] for row in found["rows"]] == [True, True]


@pytest.mark.usefixtures("place")
def test_bad_states_are_named(capsys) -> None:
    assert cli.main(["standings", "./bar", "--only", "old"]) == cli.BAD_INPUT
    assert '--only: got "old", want one or more of failed,stale' in capsys.readouterr().err


@pytest.mark.usefixtures("place")
def test_a_solver_over_the_time_limit_is_named_and_not_ranked(monkeypatch) -> None:
    def slow(setup, _, sink) -> Outcome:
        begin = time.process_time()
        for number in setup.frames:
            sink(Frame(number, setup.surface.points))
            while time.process_time() < begin + 0.4:
                pass
        return Outcome("converged", "done")

    stand_ins.solve_by(monkeypatch, pbd, slow)
    ours = Candidate(name="ours", solver="pbd", **pbd.SOLVES[0].example)
    monkeypatch.setattr(table_5_1.solvers, "in_table", lambda kind=None: (ours,) if kind == "PBD" else ())
    Path("still/still.py").write_text(PROGRAM + "while True: pass\n")
    rows = {row["name"]: row for row in stand("--program", "still", "--time-limit", "0.3 s")["rows"]}
    assert rows["reference"]["time_limit"] is None
    assert (rows["reference"]["status"], rows["ours"]["status"], rows["still"]["status"]) == (
        "converged",
        *2 * ["timed out"],
    )
    assert rows["ours"]["least_error"] is rows["still"]["least_error"] is None
    assert "processor time" in rows["ours"]["message"]
    page = Path("reports/standings.html").read_text()
    assert page.count("not within 0.3 s: ") == 2
    assert "Each solver may take 0.3 s of processor time" in page


@pytest.mark.usefixtures("place")
def test_a_stored_run_that_took_more_than_the_limit_of_now_is_late_too() -> None:
    before = {row["name"]: row for row in stand("--program", "still", "--time-limit", "100 s")["rows"]}
    assert (before["still"]["status"], before["still"]["least_error"]) == ("converged", pytest.approx(0.2))
    after = {row["name"]: row for row in stand("--program", "still", "--time-limit", "1 ms", "--only", "stale")["rows"]}
    assert after["still"]["run"] == before["still"]["run"]  # Python starts in more than 1 ms
    assert (after["still"]["status"], after["still"]["least_error"]) == ("timed out", None)
