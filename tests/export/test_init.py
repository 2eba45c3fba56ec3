"""An export has everything in it, is there whole or not at all, and what comes back of it is judged."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fem_reference import cli, export, report
from fem_reference.foundations.motion import apply
from fem_reference.problems import muscle
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.report import pages
from fem_reference.runs.store import Outcome, Run, seconds_per_frame
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def foreign(exported: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What somebody else's solver makes of the export."""
    folder = tmp_path_factory.mktemp("foreign") / "run 7"
    script = Path(__file__).parents[1] / "foreign_solver.py"
    subprocess.run([sys.executable, "-I", "-W", "error", script, exported, folder], check=True)
    return folder


def test_a_foreign_solver_is_judged(
    scene: MuscleCase, built: MuscleProblem, foreign: Path, tmp_path: Path, monkeypatch
) -> None:
    """Against a reference that slides by 1 mm a frame number. Bodies turned as a whole keep volume and fibre lengths."""
    slid = np.multiply.outer(np.array(built.frames, float), [0, 0, 1.0])

    def obtain(bench: Bench, name: str, choice, place: str) -> Run:
        if choice.solver == "recorded":
            return bench.read(name, choice, place)
        positions, fibres = (points + slid[:, None] for points in (built.surface.points, built.fibres.points))
        outcome = Outcome("converged", "slid", {"seconds_solve": 4.0})
        return Run(name, "fenicsx", outcome, built.frames, built.surface, positions, built.fibres, fibres)

    drawn = []
    monkeypatch.setattr(Bench, "obtain", obtain)
    monkeypatch.setattr(report, "of_comparison", drawn.append)
    monkeypatch.setattr(pages, "write", lambda _, folder, *__: folder / "report.html")
    words = ["compare", scene.place, "--candidate", str(foreign), "--out", str(tmp_path), "--quiet"]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json")]) == cli.DONE
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["cost"]["stiff"] == {"seconds_per_frame": 0.002, "threads": 1.0}
    found = {
        (row["metric"], row["statistic"], row["frame"]): row["value"]
        for row in facts["measures"]
        if row["candidate"] == "stiff"
    }
    turned = apply(built.bones[1].pose(10), built.surface.points)
    away = np.linalg.norm(turned - built.surface.points - [0, 0, 10], axis=1).max()
    assert found["surface_deviation", "max", 10] == pytest.approx(away, abs=1e-9)
    for number in built.frames:
        assert found["volume", "deviation", number] == pytest.approx(0, abs=1e-9)
        assert found["fibre_length", "mean", number] == pytest.approx(0, abs=1e-6)
    (stiff,) = drawn[0].candidates
    assert stiff.origin["candidate"] == {"name": "stiff", "version": "0.1"}
    step = stiff.numbers[1] - stiff.numbers[0]
    assert seconds_per_frame(stiff) == pytest.approx(
        0.002 * step
    )  # of the frames wanted; the file says of a frame number


def test_gluteus_maximus_goes_out_and_comes_back(data: Path, tmp_path: Path) -> None:
    """From metres in float64: rounding is below 1e-9 mm at 500 mm. 1218 vertices are on the pelvis (its case)."""
    assert (data / "hip").is_dir()
    large = casefile.read("gluteus_maximus", changes={"muscle.tet_size": "20 mm", "frames.every": 100})
    assert isinstance(large, MuscleCase)
    rest = muscle.setup(large)
    export.export(large, lambda: muscle.build(large, rest), tmp_path / "export", "open")
    script = Path(__file__).parents[1] / "foreign_solver.py"
    subprocess.run([sys.executable, "-I", script, tmp_path / "export", tmp_path / "frames"], check=True)
    assert (tmp_path / "export" / "attachments.csv").read_text().count("\norigin,") == 1218
    taken = []
    recorded.solve(rest, recorded.RecordedSettings(folder=str(tmp_path / "frames"), unit="m"), taken.append)
    for frame in taken:
        moved = apply(rest.bones[2].pose(frame.number), rest.surface.points)
        assert np.allclose(frame.surface, moved, rtol=0, atol=1e-9)


def test_the_unit_of_a_foreign_solver_is_its_own(scene: MuscleCase, foreign: Path, tmp_path: Path, capsys) -> None:
    words = ["compare", scene.place, "--candidate", str(foreign), "--unit", "mm", "--out", str(tmp_path), "--quiet"]
    assert cli.main(words) == cli.BAD_INPUT
    assert 'candidate.toml: unit: got "m", want the unit of --unit or of the case, 1 mm' in capsys.readouterr().err


def test_the_verb(scene: MuscleCase, tmp_path: Path, capsys) -> None:
    words = ["export", scene.place, "--quiet", "--to", str(tmp_path / "new" / "bar"), "--set", "muscle.tet_size=9 mm"]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json")]) == cli.DONE
    printed = json.loads((tmp_path / "facts.json").read_text())
    there = {str(path.relative_to(tmp_path / "new" / "bar")) for path in (tmp_path / "new" / "bar").rglob("*.*")}
    assert set(printed["files"]) == there
    assert cli.main(words) == cli.BAD_INPUT
    assert "which is not empty" in capsys.readouterr().err
    assert cli.main(["export", "rod", "--to", str(tmp_path / "rod")]) == cli.BAD_INPUT
    assert 'got "rod", a scalar case, want the case of a muscle' in capsys.readouterr().err
