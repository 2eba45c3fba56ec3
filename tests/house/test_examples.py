"""The examples: short, and each ends in the number that it should."""

import importlib.util
import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fem_reference as fr
from fem_reference.foundations.subprocesses import environment
from fem_reference.runs.store import Outcome
from fem_reference.solvers.fenicsx import processes

EXAMPLES = Path(__file__).parents[2] / "examples"
LINES = 60
# The last line of a script: the last number that it prints, how near it must be, and why it is what it is.
END = re.compile(r"^# Ends in (\S+) within (\S+): .+\.$", re.MULTILINE)
SCRIPTS = sorted(path for path in EXAMPLES.glob("*.py") if path.stem != "test_my_solver")


def test_every_script_is_short_and_has_a_number() -> None:
    for path in SCRIPTS:
        assert END.search(path.read_text(encoding="utf-8").splitlines()[-1]), path.name
    for path in EXAMPLES.rglob("*.py"):
        assert len(path.read_text(encoding="utf-8").splitlines()) <= LINES, path.name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where all of them run, so that they share what is stored."""
    return tmp_path_factory.mktemp("examples")


def output(folder: Path, *words: str) -> str:
    """What a Python process prints."""
    # Unlike ours, a user's Python finds what stands beside a script.
    done = subprocess.run([sys.executable, *words], cwd=folder, env=environment(), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_it_ends_in_its_number(folder: Path, script: Path, monkeypatch, capsys) -> None:
    text = script.read_text(encoding="utf-8")
    if "os.environ" in text:  # it sets what is read when the package is imported: in a process of its own
        printed = output(folder, str(script))
    else:
        monkeypatch.chdir(folder)
        monkeypatch.syspath_prepend(EXAMPLES)
        runpy.run_path(str(script), run_name="__main__")
        printed = capsys.readouterr().out
    number = re.findall(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", printed.splitlines()[-1])[-1]
    end = END.search(text)
    assert end is not None
    assert float(number) == pytest.approx(float(end[1]), abs=float(end[2]))


# The last number of the last cell, and if ./fem test executes it.
NOTEBOOKS = {
    "cost": (pytest.approx(0.14, abs=0.07), False),  # pinned: by meshes that gmsh makes
    "fast_solvers": (pytest.approx(0.90, abs=0.05), False),  # pinned
    "muscle_force": (
        pytest.approx(16, rel=1e-4),
        False,
    ),  # the shear modulus is the only stress: forces are proportional to it
    "own_law": (pytest.approx(1, abs=5e-4), False),  # closed form, but for a bulk modulus of 10^4 shear moduli
    "own_solver": (pytest.approx(4.24, abs=0.0848), False),  # as own_solver.py
    "rod": (pytest.approx(2, abs=1e-3), True),  # linear elements
}


def test_every_notebook_has_a_number_and_is_stored_without_output() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == set(NOTEBOOKS)
    for path in EXAMPLES.glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") for cell in cells), path.name


@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if daily else pytest.mark.nightly) for name, (_, daily) in NOTEBOOKS.items()]
)
def test_a_notebook_ends_in_its_number(folder: Path, name: str) -> None:
    if not all(importlib.util.find_spec(package) for package in ("nbclient", "ipykernel")):
        pytest.skip("nbclient and ipykernel are not installed (extra dev)")
    for file in ("own_scene.py", "own_solver.py", f"{name}.ipynb"):
        shutil.copy(EXAMPLES / file, folder)
    printed = output(folder, str(Path(__file__).parents[1] / "run_notebook.py"), f"{name}.ipynb")
    assert float(printed.split()[-1]) == NOTEBOOKS[name][0]


@pytest.mark.nightly  # by day tests/cli/test_check.py asks the command
@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
def test_the_regression_check_passes_in_pytest(folder: Path) -> None:
    for name in ("own_scene.py", "own_solver.py", "test_my_solver.py"):
        shutil.copy(EXAMPLES / name, folder)
    assert "2 passed" in output(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_my_solver.py")


def test_learned_baselines_find_what_they_can_represent(monkeypatch) -> None:
    """The kernel spans all polynomials of degree 2, so one is found but for its least ridge; the network explains most of it."""
    monkeypatch.syspath_prepend(EXAMPLES / "data_set")
    found = runpy.run_path(str(EXAMPLES / "data_set" / "learn.py"))
    rng = np.random.default_rng(1)
    x, at = rng.normal(size=(60, 3)) / 2, rng.normal(size=(20, 3)) / 2

    def truth(x: np.ndarray) -> np.ndarray:
        return np.stack([x[:, 0] - 2 * x[:, 1], x[:, 0] * x[:, 2] + 1], axis=1)

    for name, within in (("kernel", 1e-4), ("network", 0.2)):
        away = found[name](x, truth(x), at) - truth(at)
        assert np.sqrt((away**2).mean()) < within * truth(at).std(), name


def test_errors_of_shipped_solvers_on_a_data_set_are_of_the_frames_to_test_with(monkeypatch, tmp_path) -> None:
    """A solver that is off by its frame number in mm, and one muscle that it does not solve."""
    monkeypatch.syspath_prepend(EXAMPLES / "data_set")
    shipped = runpy.run_path(str(EXAMPLES / "data_set" / "baselines.py"))["shipped"]
    test = {"muscle_1": [1, 3], "muscle_2": [1], "hip": [2]}
    both = {"train": {name: [0] for name in test}, "test": test}
    (tmp_path / "dataset.json").write_text(json.dumps({"splits": {"pose": both, "shape": both}}))
    for name in test:
        (tmp_path / "scenes" / name).mkdir(parents=True)
        np.savez(tmp_path / "scenes" / name / "frames.npz", positions=np.zeros((4, 5, 3)))
    away = np.zeros((4, 5, 3)) + np.arange(4)[:, None, None] * [0, 0, 1]

    def solve(name: str, _: str) -> SimpleNamespace:
        status = "converged" if name == "muscle_1" else "diverged"
        return SimpleNamespace(positions=away, outcome=Outcome(status, "", {"seconds_processor": 2.0}))

    monkeypatch.setattr(fr, "load_case", lambda folder: folder.name)
    monkeypatch.setattr(fr, "solve", solve)
    row = {"solver": "pbd", "learned": False, "error": 2.0, "muscles": 1, "seconds": 2.0, "lost": ["muscle_2"]}
    assert [*shipped(tmp_path, "pbd")] == [{"split": split} | row for split in ("pose", "shape")]
