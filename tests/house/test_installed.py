"""The built wheel: it carries cases, meshes and truths, and works where no checkout is near."""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def installed(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def test_the_source_distribution_has_what_its_documentation_shows(tmp_path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (archive,) = tmp_path.glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        names = {name.partition("/")[2] for name in opened.getnames()}
    shown = {
        (path.parent / link).resolve().relative_to(ROOT).as_posix()
        for path in (ROOT / "README.md", *(ROOT / "docs").glob("*.md"))
        for link in re.findall(r"!\[[^\]]*\]\(([^):]+)\)", path.read_text(encoding="utf-8"))
    }
    assert "reports/hip_flexion.png" in shown
    assert shown <= names
    assert {path.relative_to(ROOT).as_posix() for path in (ROOT / "docs" / "measured").iterdir()} <= names


def call(installed: Path, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    # -I keeps the checkout, which is installed as editable, from being found by its place.
    code = f"import sys; sys.path.insert(0, {str(installed)!r}); from fem_reference import cli; sys.exit(cli.main(sys.argv[1:]))"
    return subprocess.run(
        [sys.executable, "-I", "-c", code, *words], cwd=folder, capture_output=True, text=True, check=False
    )


def test_carries_everything_that_is_shipped(installed) -> None:
    for top in ("cases", "meshes", "validation"):
        for path in (ROOT / top).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert (installed / "fem_reference" / path.relative_to(ROOT)).read_bytes() == path.read_bytes()


def test_works_outside_the_checkout(installed, tmp_path) -> None:
    done = call(installed, tmp_path, "show", "hip_flexion", "--json", "facts.json")
    assert done.returncode == 0, done.stderr
    assert "Idealised gluteus" in done.stdout
    assert (tmp_path / "facts.json").exists()


def test_solves_outside_the_checkout(installed, tmp_path) -> None:
    done = call(installed, tmp_path, "run", "hip_flexion", "--solver", "pbd", "--out", "here")
    assert done.returncode == 0, done.stderr
    assert list((tmp_path / "here" / "runs").glob("pbd-*/run.json"))


def test_finds_its_truths_outside_the_checkout(installed, tmp_path) -> None:
    done = call(installed, tmp_path, "verify", "nobody")
    assert done.returncode == 2, done.stderr
    assert 'got "nobody", want an entry' in done.stderr


def test_pip_is_told_which_python_is_wanted(installed) -> None:
    (metadata,) = installed.glob("fem_reference-*.dist-info/METADATA")
    # Of this pip makes "requires a different Python: 3.11.7 not in '>=3.12'".
    assert "\nRequires-Python: >=3.12\n" in metadata.read_text()


def test_another_python_is_named_with_the_one_that_is_wanted() -> None:
    older = "import sys; sys.version_info = (3, 11, 7, 'final', 0); sys.version = '3.11.7 (main)'; import fem_reference"
    done = subprocess.run([sys.executable, "-c", older], cwd=ROOT, capture_output=True, text=True, check=False)
    said = f"ImportError: this is Python 3.11.7 ({sys.executable}); fem_reference needs Python 3.12 or newer: python3.12 -m venv"
    assert said in done.stderr


def test_a_package_that_is_missing_is_no_mistake_of_ours() -> None:
    without = "import sys; sys.modules['numpy'] = None; from fem_reference import cli; sys.exit(cli.main(['list']))"
    done = subprocess.run([sys.executable, "-c", without], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 70
    assert f"the Python package numpy is not installed for {sys.executable}: use its pip to install" in done.stderr
    assert "an error in fem-reference itself" not in done.stderr
