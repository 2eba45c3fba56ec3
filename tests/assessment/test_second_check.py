"""The second check denies runs in which something is wrong, by closed forms and planted faults; true runs pass."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import small
from crossings import coarse, resting

from fem_reference import cli, effects
from fem_reference.assessment import comparison
from fem_reference.assessment.run_checks import of_body
from fem_reference.problems import shapes as bodies
from fem_reference.problems.body import Body, Prescribed
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench
from fem_reference.verification import second_check as catalogue
from fem_reference.verification.lab import lab


@pytest.mark.slow
def test_no_verdict_rests_on_a_denied_reference(tmp_path) -> None:
    problem = coarse(tmp_path)
    case, run = casefile.read(tmp_path), resting(problem)
    fibres = np.broadcast_to(problem.fibres.points, (5, *problem.fibres.points.shape))
    run = replace(run, fibres=problem.fibres, fibre_positions=fibres)
    mine = replace(run, name="mine", solver="recorded")
    words = {}
    for status in ("converged", "denied"):
        reference = replace(run, outcome=Outcome(status, "so it ended"))
        result = comparison.compare(case, problem, reference, (mine,))
        words[status] = (result.word, *((one.expectation.of, one.word) for one in result.verdicts))
    assert words["converged"] == ("pass", ("reference", "pass"), ("mine", "pass"))
    assert words["denied"] == ("fail", ("reference", "fail"), ("mine", "inconclusive"))
    alone = case.model_copy(update={"expect": case.expect[1:]})
    assert comparison.compare(alone, problem, reference, (mine,)).word == "fail"


@pytest.mark.slow
def test_every_shipped_control_is_denied_and_the_true_run_passes() -> None:
    with lab() as own:
        assert catalogue.denials(own).value == 0
        for entry in catalogue.ENTRIES:
            assert entry.find(own, with_negative_control=True).value >= 1, entry.name


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_bones_carry_the_weight_of_a_true_run(tmp_path, monkeypatch) -> None:
    """As much as the residual allows: the weight of the same muscle at the full amount is 0.1 mN at least."""
    monkeypatch.chdir(tmp_path)
    scene = small.write(tmp_path / "bar")
    with (scene / "case.toml").open("a") as file:
        file.write('\n[[effect]]\nname = "gravity"\ndensity = "1060 kg/m3"\nacceleration = "0, 9.81, -98.1 m/s^2"\n')
        file.write("ramp = [{ frame = 0, amount = 0.0 }, { frame = 10, amount = 1.0 }]\n")
    words = ["run", str(scene), "--quiet", "--out", str(tmp_path / "out"), "--json", str(tmp_path / "facts.json")]
    assert cli.main(words) == cli.DONE
    checks = json.loads((tmp_path / "facts.json").read_text())["second_check"]["checks"]
    (carried,) = (one for one in checks if one["name"] == "forces that bones do not carry")
    assert carried["met"]
    assert carried["allowed"] < 1e-5


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_a_denied_run_is_no_truth_anywhere(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    scene, out = small.write(tmp_path / "bar"), tmp_path / "out"
    words = ["run", str(scene), "--quiet", "--out", str(out), "--json", str(tmp_path / "facts.json")]
    assert cli.main(words) == cli.DONE
    assert "second check: passed, " in capsys.readouterr().out
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert (facts["verdict"], facts["status"]) == ("pass", "converged")
    record = facts["second_check"]
    assert all(one["met"] for one in record["checks"])
    assert {"rotation of lid per load step", "residual force", "residual moment"} <= {
        one["name"] for one in record["checks"]
    }
    (folder,) = (out / "runs").glob("fenicsx-*")
    # Two frames of the stored run in each other's place; its record is of another check, so that it is asked again.
    frames = [folder / "surface" / f"frame_{number:04d}.vtp" for number in (5, 10)]
    shutil.copy(frames[0], tmp_path / "kept")
    shutil.copy(frames[1], frames[0])
    shutil.copy(tmp_path / "kept", frames[1])
    stored = json.loads((folder / "run.json").read_text())
    stored["origin"]["second_check"]["code"] = "another"
    (folder / "run.json").write_text(json.dumps(stored))
    for _ in range(2):  # as it is asked, and as it is taken from the store
        assert cli.main(words) == cli.SOLVER_FAILED
        facts = json.loads((tmp_path / "facts.json").read_text())
        assert (facts["verdict"], facts["status"]) == ("fail", "denied")
        assert "reference: denied, denied by the second check: " in capsys.readouterr().out
        assert {one["verdict"] for one in facts["verdicts"]} == {"fail"}
        assert "away from lid" in facts["message"]
    assert store.load(folder).outcome.status == "denied"
    (page,) = (path for path in out.rglob("report*.html"))
    assert "which uses positions and forces alone, denies it" in page.read_text()
    case = casefile.read(scene)
    bench = Bench(case, out / "runs")
    run = bench.obtain("reference", case.reference, "reference")
    result = comparison.compare(case, bench.setup(), run, ())
    assert result.word == "fail"


def test_a_path_that_writes_into_its_points_is_asked_like_any_other() -> None:
    mesh = bodies.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")

    def still(points, _frame):
        return np.multiply(points, 0, out=points)

    body = Body(mesh, (effects.make("neo_hooke", mu=0.01),), (Prescribed("low", "z0", (0, 1, 2), still),), (0.0,))
    solved = collected([Frame(0.0, points=mesh.points)], Outcome("converged", ""))
    assert all(one.met for one in of_body(body, solved))
