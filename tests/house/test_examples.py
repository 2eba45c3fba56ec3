"""The examples: short, and each ends in the number that it should."""

import importlib.util
import json
import re
import runpy
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fem_reference.foundations.subprocesses import environment
from fem_reference.solvers.fenicsx import processes

EXAMPLES = Path(__file__).parents[2] / "examples"
LINES = 60
# The last number that each prints; how near it must be; why it is what it is.
ENDS = {
    "body_from_scratch": pytest.approx(1, rel=5e-3),  # torsion in small strain
    "error_bar": pytest.approx(0.11, rel=0.5),  # an estimate from two meshes
    "own_material": pytest.approx(1, rel=5e-4),  # closed form, but for a bulk modulus of 10^4 shear moduli
    "own_scene": pytest.approx(1.75, rel=0.05),  # pinned: by a mesh that gmsh makes
    "own_solver": pytest.approx(4.24, rel=0.02),  # pinned
    "ranking": pytest.approx(0.377, rel=0.1),  # pinned
    "read_a_run": pytest.approx(8.55, rel=0.01),  # pinned; 15 degrees at a radius of 33 mm are 8.6 mm
    "rod": pytest.approx(0, abs=1e-10),  # both are exact at nodes
}

OWN_PROCESS = ("own_material",)  # it sets what is read when the package is imported


def test_every_script_is_short_and_has_a_number() -> None:
    scripts = {path.stem for path in EXAMPLES.glob("*.py")}
    assert scripts == {*ENDS, "test_my_solver"}
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
@pytest.mark.parametrize("name", sorted(ENDS))
def test_it_ends_in_its_number(folder: Path, name: str, monkeypatch, capsys) -> None:
    if name in OWN_PROCESS:
        printed = output(folder, str(EXAMPLES / f"{name}.py"))
    else:
        monkeypatch.chdir(folder)
        monkeypatch.syspath_prepend(EXAMPLES)
        runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__")
        printed = capsys.readouterr().out
    number = re.findall(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?", printed.splitlines()[-1])[-1]
    assert float(number) == ENDS[name]


# The last number of the last cell.
NOTEBOOKS = {
    "fast_solvers": pytest.approx(0.90, abs=0.05),  # pinned
    "rod": pytest.approx(2, abs=1e-3),  # linear elements
}


def test_every_notebook_has_a_number_and_is_stored_without_output() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == set(NOTEBOOKS)
    for path in EXAMPLES.glob("*.ipynb"):
        cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        assert not any(cell.get("outputs") for cell in cells), path.name


@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
@pytest.mark.parametrize("name", sorted(NOTEBOOKS))
def test_a_notebook_ends_in_its_number(folder: Path, name: str) -> None:
    if not all(importlib.util.find_spec(package) for package in ("nbclient", "ipykernel")):
        pytest.skip("nbclient and ipykernel are not installed (extra dev)")
    shutil.copy(EXAMPLES / "own_scene.py", folder)
    shutil.copy(EXAMPLES / f"{name}.ipynb", folder)
    printed = output(folder, str(Path(__file__).parents[1] / "run_notebook.py"), f"{name}.ipynb")
    assert float(printed.split()[-1]) == NOTEBOOKS[name]


@pytest.mark.slow
@pytest.mark.skipif(not processes.installed(), reason="FEniCSx is not installed")
def test_the_regression_check_passes_in_pytest(folder: Path) -> None:
    for name in ("own_scene.py", "own_solver.py", "test_my_solver.py"):
        shutil.copy(EXAMPLES / name, folder)
    assert "2 passed" in output(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_my_solver.py")
