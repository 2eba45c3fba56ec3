"""The main job on a small scene, through the command line: page, JSON, exit status, stored runs, and what bad input does."""

import json
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import small
from undrawn import UNDRAWN

from fem_reference import cli
from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.motion import RigidMotion
from fem_reference.io import files
from fem_reference.runs import store
from fem_reference.scenes import casefile

# Pictures are drawn once, for the page of the job that all tests share.
pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_pictures")]
ALONE = ("penetration", "fibre_ends")  # metrics of a run alone, whatever the reference


class Job:
    """The small scene, compared once: its folder, its outputs and its JSON."""

    def __init__(self, root: Path, pose=None) -> None:
        self.case = small.write(root / "bar", pose)
        self.out = root / "out"
        self.status, self.facts = self.call("compare", str(self.case))
        (self.reference,) = (self.out / "runs").glob("fenicsx-*")

    def call(self, *words: str):
        target = self.out / "facts.json"
        target.unlink(missing_ok=True)
        status = cli.main([*words, "--out", str(self.out), "--json", str(target), "--quiet"])
        return status, json.loads(target.read_text()) if target.exists() else None

    def frames(self, folder: Path, change=lambda _, points: points, suffix=".vtp") -> Path:
        """The reference's own surfaces as a candidate, changed."""
        run = store.load(self.reference)
        folder.mkdir()
        for number, points in zip(run.numbers, run.positions, strict=True):
            files.write_surface(folder / f"frame_{number:04d}{suffix}", run.surface, change(number, points))
        return folder


@pytest.fixture(scope="module")
def job(tmp_path_factory) -> Job:
    return Job(tmp_path_factory.mktemp("job"))


def rows(facts, candidate):
    return [row for row in facts["measures"] if row["candidate"] == candidate]


def test_ends_well_and_leaves_a_page(job) -> None:
    assert job.status == cli.DONE
    page = (job.out / "bar" / "report.html").read_text()
    assert "pbd" in page
    assert "data:image/webp" in page
    assert (job.out / "bar" / "measures.csv").exists()
    assert (job.out / "bar" / "measures.json").exists()


def test_json_has_the_documented_keys(job) -> None:
    assert {"case", "solver", "status", "verdict", "cost", "measures"} <= set(job.facts)
    assert (job.facts["case"], job.facts["solver"], job.facts["status"]) == ("bar", "fenicsx", "converged")
    assert job.facts["verdict"] == "pass"
    assert all(
        set(row) == {"candidate", "metric", "statistic", "frame", "value", "unit"} for row in job.facts["measures"]
    )
    metrics = {row["metric"] for row in rows(job.facts, "pbd")}
    surface = {"dihedral_angle", "edge_extension", "inversion", "surface_deviation", "volume"}
    assert metrics == surface | {"fibre_ends", "fibre_length", "moment_arm", "penetration"}
    assert {row["frame"] for row in rows(job.facts, "pbd")} == {0, 5, 10, 15, 20}
    assert {row["unit"] for row in rows(job.facts, "pbd")} == {"mm", "mm3", "%", "deg"}


def test_reference_keeps_its_volume_and_comes_back(job) -> None:
    reference = {(row["metric"], row["statistic"], row["frame"]): row["value"] for row in rows(job.facts, "reference")}
    assert all(abs(reference["volume", "deviation", frame]) < 0.5 for frame in (0, 5, 10, 15, 20))
    assert reference["surface_deviation", "max", 10] > 1
    assert reference["surface_deviation", "max", 20] < 1e-5


def test_a_stored_run_is_taken_again(job) -> None:
    before = (job.reference / "run.json").stat().st_mtime_ns
    status, facts = job.call("run", str(job.case))
    assert (status, facts["verdict"]) == (cli.DONE, "pass")
    assert (job.reference / "run.json").stat().st_mtime_ns == before


def test_stored_runs_are_judged_without_fenicsx_and_meshers(job) -> None:
    # A Python in which neither can be imported judges and reports from the store.
    block = (
        "import sys\n"
        "for name in ('dolfinx', 'dolfinx_solver', 'ufl', 'basix', 'petsc4py', 'mpi4py', 'gmsh', 'pytetwild'):\n"
        "    sys.modules[name] = None\n"
        f"{UNDRAWN}from fem_reference import cli\n"
        f"sys.exit(cli.main(['compare', {str(job.case)!r}, '--out', {str(job.out)!r}, '--quiet']))"
    )
    done = subprocess.run([sys.executable, "-c", block], capture_output=True, text=True, check=False)
    assert done.returncode == cli.DONE, done.stderr
    assert "verdict: pass" in done.stdout


def test_the_references_own_surface_scores_zero(job, tmp_path) -> None:
    for candidate in (job.reference, job.frames(tmp_path / "own")):
        status, facts = job.call("compare", str(job.case), "--candidate", str(candidate))
        assert status == cli.DONE
        own = [row for row in facts["measures"] if row["candidate"] != "reference" and row["metric"] not in ALONE]
        assert len(own) > 50
        # Zero but for rounding: positions are stored as float64.
        assert max(abs(row["value"]) for row in own) < 1e-9


def test_shifted_by_one_mm_scores_one_mm(job, tmp_path) -> None:
    shifted = job.frames(tmp_path / "shifted", lambda _, points: points + np.array([0.6, 0, 0.8]))
    _, facts = job.call("compare", str(job.case), "--candidate", str(shifted))
    for row in rows(facts, "shifted"):
        if row["metric"] == "surface_deviation" and row["statistic"] in ("rms", "p95", "max"):
            assert row["value"] == pytest.approx(1.0, abs=1e-9)
        if row["metric"] not in ("surface_deviation", *ALONE):
            # A translation changes no volume, length or angle; rounding of 1e5 mm3 sums.
            assert row["value"] == pytest.approx(0, abs=1e-6)
        if row["statistic"] == "hausdorff":
            assert 0.7 < row["value"] <= 1 + 1e-9


def test_moving_the_whole_scene_changes_no_measure(job, tmp_path) -> None:
    pose = RigidMotion((1, -2, 0.5), (20, 0, 5), (0.0, 1.0), (0.0, 2.1)).pose(1)
    pose[:3, 3] += [300, -200, 50]
    moved = Job(tmp_path, pose)
    assert len(moved.facts["measures"]) == len(job.facts["measures"])
    for here, there in zip(job.facts["measures"], moved.facts["measures"], strict=True):
        assert {key: here[key] for key in here if key != "value"} == {
            key: there[key] for key in there if key != "value"
        }
        # 1e-6 relative; measures that are zero up to the residual of Newton's method have no relative size.
        if (here["statistic"], here["value"]) == ("arm", None):  # without a force, at rest
            assert here["frame"] in (0, 20)
            assert there["value"] is None
        elif not here["metric"].endswith("_on_bone"):  # components turn with the scene
            assert there["value"] == pytest.approx(here["value"], rel=1e-6, abs=1e-6), here
    assert sizes_of_forces(moved) == pytest.approx(sizes_of_forces(job), rel=1e-6, abs=1e-6)


def sizes_of_forces(job: Job) -> list[float]:
    """The sizes of the forces on bones, by bone and frame."""
    sums = dict[tuple[str, int], float]()
    for row in job.facts["measures"]:
        if row["metric"] == "force_on_bone":
            key = row["statistic"][:-2], row["frame"]
            sums[key] = math.hypot(sums.get(key, 0.0), row["value"])
    assert sums
    return list(sums.values())


def test_the_negative_control_turns_the_verdict(job, tmp_path, monkeypatch) -> None:
    changed = casefile.read(job.case, with_negative_control=True)
    monkeypatch.setattr(casefile, "read", lambda _, **__: changed)
    status = cli.main(["run", str(job.case), "--out", str(tmp_path), "--quiet"])
    assert status == cli.VERDICT_FAIL


def test_a_truncated_frame_is_bad_input_that_names_the_file(job, tmp_path, capsys) -> None:
    folder = job.frames(tmp_path / "cut")
    path = folder / "frame_0010.vtp"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    out = tmp_path / "out"
    assert cli.main(["compare", str(job.case), "--candidate", str(folder), "--out", str(out)]) == cli.BAD_INPUT
    assert "frame_0010.vtp" in capsys.readouterr().err
    assert not out.exists()


def test_another_unit_in_one_frame_is_bad_input_that_names_the_file(job, tmp_path, capsys) -> None:
    folder = job.frames(tmp_path / "units", lambda number, points: points * (1e-3 if number == 10 else 1))
    assert (
        cli.main(["compare", str(job.case), "--candidate", str(folder), "--out", str(tmp_path / "out")])
        == cli.BAD_INPUT
    )
    assert "frame_0010.vtp: got a surface of 0.001 times the size at rest" in capsys.readouterr().err


def test_missing_frames_are_named(job, tmp_path, capsys) -> None:
    folder = job.frames(tmp_path / "few")
    (folder / "frame_0015.vtp").unlink()
    assert (
        cli.main(["compare", str(job.case), "--candidate", str(folder), "--out", str(tmp_path / "out")])
        == cli.BAD_INPUT
    )
    assert "15" in capsys.readouterr().err


BAD = {
    "no such case": ("none", lambda _: None, 'CASE: got "none"'),
    "missing file": (None, lambda case: (case / "bar.vtp").unlink(), "muscle.surface"),
    "wrong unit": (
        None,
        lambda case: edit(case, 'tet_size = "6 mm"', 'tet_size = "6 kPa"'),
        'muscle.tet_size: got "6 kPa", want a length',
    ),
    "unknown key": (None, lambda case: edit(case, "[frames]", "[frames]\nskip = 1"), "frames.skip: got an unknown key"),
    "nothing attached": (
        None,
        lambda case: edit(case, 'within = "1.5 mm"', 'within = "0.1 mm"'),
        "no vertex of the muscle",
    ),
    "open surface": (None, lambda case: tamper(case, drop=1), "edges that belong to only one triangle"),
    "not a number": (None, lambda case: tamper(case, value=np.nan), "not finite"),
    "no such solver": (
        None,
        lambda case: edit(case, 'solver = "fenicsx"', 'solver = "magic"'),
        'reference.solver: got "magic"',
    ),
    "no such setting": (
        None,
        lambda case: edit(case, "first_step = 5", "step = 5"),
        "reference.step: got an unknown key",
    ),
    "no such measure": (None, lambda case: edit(case, 'metric = "volume"', 'metric = "mass"'), "expect[0]: metric"),
}


def edit(case: Path, old: str, new: str) -> None:
    text = (case / "case.toml").read_text()
    assert old in text
    (case / "case.toml").write_text(text.replace(old, new))


def tamper(case: Path, *, drop: int = 0, value: float = 0.0) -> None:
    surface = files.read_surface(case / "bar.vtp", 1.0)
    points = np.array(surface.points)
    points[7, 1] += value
    triangles = surface.triangles[drop:]
    files.write_surface(case / "bar.vtp", Surface(points, triangles), points)


@pytest.mark.parametrize("what", BAD)
def test_bad_input_ends_with_one_message_and_leaves_nothing(what, job, tmp_path, capsys) -> None:
    name, damage, message = BAD[what]
    case = shutil.copytree(job.case, tmp_path / "bar")
    damage(case)
    status = cli.main(["compare", name or str(case), "--out", str(tmp_path / "out"), "--quiet"])
    printed = capsys.readouterr()
    assert status == cli.BAD_INPUT
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_unknown_candidate(job, capsys) -> None:
    assert job.call("compare", str(job.case), "--candidate", "nobody")[0] == cli.BAD_INPUT
    assert '--candidate: got "nobody", want a folder of frames, a solver, or one of pbd' in capsys.readouterr().err


def test_names_of_candidates_are_used_once(job, tmp_path, capsys) -> None:
    for name, got in (("pbd", '"pbd" twice'), ("reference", '"reference", want another name')):
        folder = job.frames(tmp_path / name)
        assert job.call("compare", str(job.case), "--candidate", "pbd", "--candidate", str(folder))[0] == cli.BAD_INPUT
        assert f"--candidate: got {got}" in capsys.readouterr().err


def test_another_solver_can_run_the_case(job) -> None:
    status, facts = job.call("run", str(job.case), "--solver", "pbd")
    assert (status, facts["solver"], facts["verdict"]) == (cli.DONE, "pbd", "not judged")


def test_a_reference_that_fails_is_status_three_with_its_frames_kept(job, tmp_path) -> None:
    case = shutil.copytree(job.case, tmp_path / "bar")
    edit(case, "first_step = 5", "first_step = 5\nsmallest_step = 2\nnewton_iterations = 6")
    edit(case, 'angle = "0.4 rad"', 'angle = "3 rad"')
    target = tmp_path / "facts.json"
    assert (
        cli.main(["compare", str(case), "--out", str(tmp_path / "out"), "--json", str(target), "--quiet"])
        == cli.SOLVER_FAILED
    )
    facts = json.loads(target.read_text())
    assert facts["status"] in ("diverged", "inverted")
    assert facts["verdict"] == "fail"
    measured = rows(facts, "pbd")
    # A slope at the first frame needs a second one.
    first = [row["value"] for row in measured if row["frame"] == 0 and row["metric"] != "moment_arm"]
    last = {row["metric"]: row["value"] for row in measured if row["frame"] == 20}
    assert None not in first
    assert None not in [last.pop(metric) for metric in ALONE]
    assert set(last.values()) == {None}
    assert (tmp_path / "out" / "bar" / "report.html").exists()


def test_a_reference_that_fails_before_its_first_frame_says_why(job, tmp_path, capsys) -> None:
    case = shutil.copytree(job.case, tmp_path / "bar")
    edit(case, "first_step = 5", 'first_step = 5\ntime_limit = "0.01 s"')
    assert cli.main(["run", str(case), "--out", str(tmp_path / "out"), "--quiet"]) == cli.SOLVER_FAILED
    assert "reference: timed out, stopped after" in capsys.readouterr().out


def test_candidates_can_be_judged_whoever_they_are(job, tmp_path, capsys) -> None:
    case = shutil.copytree(job.case, tmp_path / "bar")
    edit(case, 'of = "reference"', 'of = "candidates"')
    assert cli.main(["run", str(case), "--out", str(job.out), "--quiet"]) == cli.DONE
    assert "verdict: not judged" in capsys.readouterr().out
    large = job.frames(tmp_path / "large", lambda number, points: points * (1.01 if number else 1))
    words = ["compare", str(case), "--candidate", str(large), "--out", str(job.out), "--quiet"]
    assert cli.main(words) == cli.VERDICT_FAIL
    assert "fail: large volume deviation" in capsys.readouterr().out


def test_recorded_frames_are_read_anew_each_time(job, tmp_path, capsys) -> None:
    case = shutil.copytree(job.case, tmp_path / "bar")
    with (case / "case.toml").open("a") as text:
        text.write('\n[[candidate]]\nname = "mine"\nsolver = "recorded"\nfolder = "mine"\nunit = "mm"\n')
    folder = job.frames(case / "mine")
    words = ["run", str(case), "--solver", "recorded", "--out", str(tmp_path / "out"), "--quiet"]
    assert cli.main(words) == cli.DONE
    (folder / "frame_0010.vtp").unlink()
    assert cli.main(words) == cli.BAD_INPUT
    assert "10" in capsys.readouterr().err


def test_outputs_that_cannot_be_are_refused_at_once(job, tmp_path, capsys) -> None:
    file = tmp_path / "file"
    file.write_text("mine")
    assert cli.main(["compare", str(job.case), "--out", str(file)]) == cli.BAD_INPUT
    assert "--out: got" in capsys.readouterr().err
    assert cli.main(["compare", str(job.case), "--json", str(tmp_path)]) == cli.BAD_INPUT
    assert "--json: got" in capsys.readouterr().err
    assert file.read_text() == "mine"


def test_json_can_go_into_a_pipe() -> None:
    words = [sys.executable, "-m", "fem_reference", "list", "--json", "/dev/stdout"]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert '"cases"' in done.stdout


def test_a_folder_of_any_name_is_a_candidate(job, tmp_path) -> None:
    folder = job.frames(tmp_path / "my frames v1.2")
    _, facts = job.call("compare", str(job.case), "--candidate", str(folder))
    assert rows(facts, "my_frames_v1.2")


def test_list_and_show(job, capsys) -> None:
    status, facts = job.call("list")
    assert status == cli.DONE
    assert "hip_flexion" in facts["cases"]
    assert any("fenicsx-" in path for path in facts["runs"])
    status, facts = job.call("show", str(job.case))
    assert status == cli.DONE
    assert facts["attachments"]["origin"].endswith("attached to floor exactly")
    status, facts = job.call("show", str(job.case), "--set", "reference.first_step=4.0")
    assert facts["reference"] == "fenicsx first_step=4.0"
    assert (job.out / "bar" / "tets.vtu").exists()
    assert "effects:" in capsys.readouterr().out
