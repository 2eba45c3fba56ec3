"""The verb ``check`` on a small case: exit statuses, files, what is bad input, and the example of the page."""

import json
import logging
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pages
import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx, pbd

pytestmark = pytest.mark.slow

# What the page shows, in the repository of a user.
EXAMPLE = pages.snippet("docs/your_own_solver.md", "write_frames")


def swell(problem, _settings, sink) -> Outcome:
    """In place of the reference: all points move away from the origin, by more the larger the tetrahedra are."""
    facts = problem.mesh_facts
    length = (facts["volume_mm3"] / facts["tets"]) ** (1 / 3)
    for number in problem.frames:
        factor = 1 + number * (1e-3 + 1e-5 * length)
        sink(Frame(number, problem.surface.points * factor, problem.fibres.points * factor))
    return Outcome("converged", "done", {"seconds": 1.0})


def swell_surface(setup, _settings, sink) -> Outcome:
    """In place of a solver of surfaces."""
    for number in setup.frames:
        sink(Frame(number, setup.surface.points * (1 + number * 1e-3)))
    return Outcome("converged", "done", {"seconds": 1.0})


def fail(setup, _settings, sink) -> Outcome:
    sink(Frame(0, setup.surface.points))
    return Outcome("diverged", "no equilibrium")


class Work:
    """The small case in ``root`` with the frames of a candidate, and the place of its baseline."""

    def __init__(self, root: Path) -> None:
        self.root, self.case, self.frames = root, root / "bar", root / "mine"
        self.baseline = root / "baselines" / "mine.json"
        scene = casefile.read_muscle(self.case)
        self.rest, self.numbers = muscle.setup(scene).surface, scene.frames.numbers

    def write(self, moved: int | None = None) -> None:
        """The candidate's frames, the one numbered ``moved`` 2 mm aside."""
        for number in self.numbers:
            points = self.rest.points * (1 + 2e-3 * number) + ([0, 2, 0] if number == moved else [0, 0, 0])
            files.write_surface(self.frames / f"frame_{number:04d}.vtp", self.rest, points)

    def check(self, *words: str, candidate: str = "") -> int:
        given = ["--candidate", candidate or str(self.frames), "--baseline", str(self.baseline)]
        return cli.main(["check", str(self.case), *given, "--out", str(self.root / "reports"), "--quiet", *words])


@pytest.fixture
def solved(monkeypatch) -> None:
    """The reference is made by ``swell``."""
    stand_ins.solve_by(monkeypatch, fenicsx, swell)
    stand_ins.unchecked(monkeypatch)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """The folder of a case with a baseline, its reference solved and its error bars known."""
    with pytest.MonkeyPatch.context() as patch:
        stand_ins.solve_by(patch, fenicsx, swell)
        stand_ins.unchecked(patch)
        root = tmp_path_factory.mktemp("made")
        small.write(root / "bar")
        (root / "mine").mkdir()
        work = Work(root)
        work.write()
        assert work.check("--error-bar", "--update") == cli.DONE
    return root


@pytest.fixture
def work(made, tmp_path) -> Work:
    """A copy of it."""
    return Work(shutil.copytree(made, tmp_path / "work"))


def test_passes_on_the_same_run_and_fails_when_a_frame_is_moved(work, capsys) -> None:
    junit, markdown, printed = (work.root / "new" / name for name in ("check.xml", "check.md", "check.json"))
    words = ("--junit", str(junit), "--markdown", str(markdown), "--json", str(printed))
    assert work.check(*words) == cli.DONE
    assert "verdict: pass" in capsys.readouterr().out
    assert ElementTree.parse(junit).getroot().get("failures") == "0"
    work.write(moved=10)
    assert work.check(*words) == cli.VERDICT_FAIL
    assert "fail: positions.moved unchanged at frame 10: 2" in capsys.readouterr().out
    assert json.loads(printed.read_text())["verdict"] == "fail"
    assert int(ElementTree.parse(junit).getroot().get("failures")) > 0
    assert markdown.read_text().startswith("### fail: mine on bar")


def test_where_nothing_can_be_said_it_is_reported_and_fails_nothing(work, capsys) -> None:
    table = json.loads(work.baseline.read_text())
    rms = table["measures"]["surface_deviation.rms"]
    rms["within"] = max(rms["values"])  # somewhere in the bar of this reference, which is more than nothing
    work.baseline.write_text(json.dumps(table))
    assert work.check() == cli.DONE
    printed = capsys.readouterr().out
    assert "by less than the error bar of the reference, " in printed
    assert "verdict: inconclusive" in printed


def test_an_update_takes_current_values(work) -> None:
    work.write(moved=10)
    before = work.baseline.read_text()
    assert work.check("--update") == cli.VERDICT_FAIL  # further from the reference than was allowed
    assert work.baseline.read_text() != before
    work.write()
    assert work.check("--update") == cli.DONE
    assert work.baseline.read_text() == before


@pytest.mark.usefixtures("solved")
def test_a_candidate_of_the_case_is_checked_by_its_name(work, monkeypatch) -> None:
    stand_ins.solve_by(monkeypatch, pbd, swell_surface)
    work.baseline = work.root / "pbd.json"
    assert work.check("--update", candidate="pbd") == cli.DONE
    assert work.check(candidate="pbd") == cli.DONE
    assert json.loads(work.baseline.read_text())["candidate"] == "pbd"


@pytest.mark.usefixtures("solved")
@pytest.mark.parametrize("solver", [fenicsx, pbd])
def test_a_solver_that_fails_is_status_three_and_writes_no_baseline(work, monkeypatch, capsys, solver) -> None:
    stand_ins.solve_by(monkeypatch, solver, fail)
    for stored in (work.root / "reports" / "runs").glob(f"{solver.__name__.split('.')[-1]}-*"):
        shutil.rmtree(stored)
    work.baseline = work.root / "pbd.json"
    printed = work.root / "printed.json"
    junit, markdown = work.root / "check.xml", work.root / "check.md"
    markdown.write_text("what the last check said")
    also = ("--junit", str(junit), "--markdown", str(markdown))
    assert work.check("--update", "--json", str(printed), *also, candidate="pbd") == cli.SOLVER_FAILED
    suite = ElementTree.parse(junit).getroot()
    assert (suite.get("errors"), suite.find(".//error").get("message")[-14:]) == ("1", "no equilibrium")
    assert markdown.read_text().startswith("### failed: pbd on bar")
    assert "diverged, no equilibrium\nverdict: failed" in capsys.readouterr().out
    assert json.loads(printed.read_text())["verdict"] == "failed"
    assert not work.baseline.exists()


def test_bad_input_is_reported_before_anything_is_solved(work, capsys) -> None:
    shutil.rmtree(work.root / "reports")
    work.baseline.write_text("{")
    for words in ((), ("--update",)):
        assert work.check(*words) == cli.BAD_INPUT
        assert "mine.json: got" in capsys.readouterr().err
    work.baseline.unlink()
    assert work.check() == cli.BAD_INPUT
    assert "got no file, want the baseline of a candidate (--update writes it)" in capsys.readouterr().err
    for option in ("--junit", "--markdown"):
        assert work.check(option, str(work.root)) == cli.BAD_INPUT
        assert f"{option}: got" in capsys.readouterr().err
    work.case = Path("rod")
    assert work.check() == cli.BAD_INPUT
    assert 'CASE: got "rod", a scalar case, want the case of a muscle' in capsys.readouterr().err
    assert not (work.root / "reports").exists()


def test_another_scene_is_not_this_baseline(work, capsys) -> None:
    assert work.check("--set", "muscle.tet_size=7 mm") == cli.BAD_INPUT
    assert (
        "want the key of this scene (it has changed since then; --update stores the current measures)"
        in capsys.readouterr().err
    )


def test_the_example_of_the_readme_passes_and_fails(work, monkeypatch) -> None:
    """In a repository of its own, with the case of this test in place of the one that the example names."""
    tests = work.root / "repository" / "tests"
    tests.mkdir(parents=True)
    monkeypatch.chdir(tests.parent)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    shutil.copytree(work.root / "reports", "reports")
    table = json.loads(work.baseline.read_text()) | {"candidate": "my_solver"}
    (tests / "hip_flexion.json").write_text(json.dumps(table))
    solver = SimpleNamespace(write_frames=lambda _case, folder: shutil.copytree(work.frames, folder))
    monkeypatch.setitem(sys.modules, "my_solver", solver)
    names = {"__file__": str(tests / "test_muscle.py")}
    exec(EXAMPLE.replace('"check", "hip_flexion"', f'"check", {str(work.case)!r}'), names)
    names["test_hip_flexion_is_as_good_as_it_was"](work.root / "first")
    work.write(moved=10)
    with pytest.raises(AssertionError, match=r"fail: positions\.moved unchanged at frame 10"):
        names["test_hip_flexion_is_as_good_as_it_was"](work.root / "second")
    assert Path("check.md").read_text().startswith("### fail: my_solver on bar")
    assert ElementTree.parse("check.xml").getroot().get("failures") != "0"


def test_from_another_folder_it_says_that_nothing_is_stored_there(made: Path, tmp_path, monkeypatch, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    stand_ins.solve_by(monkeypatch, fenicsx, swell)
    stand_ins.unchecked(monkeypatch)
    words = [
        "check",
        str(made / "bar"),
        "--candidate",
        str(made / "mine"),
        "--baseline",
        str(made / "baselines" / "mine.json"),
    ]
    for folder, solves in ((made, False), (tmp_path, True), (tmp_path, False)):
        caplog.clear()
        monkeypatch.chdir(folder)
        assert cli.main([*words, *(["--update"] if solves else [])]) == cli.DONE
        said = f"reference: no stored run in {tmp_path / 'reports' / 'runs'}; solving, about "
        assert (said in caplog.text) == solves
        assert ("reference: solved before, taken from" in caplog.text) != solves
