"""Subprocesses import this copy of the package and nothing from the folder that they are started in."""

import subprocess
import sys
from pathlib import Path

import fem_reference
from fem_reference.foundations.subprocesses import command, environment


def test_a_module_beside_the_user_is_not_taken_for_ours(tmp_path) -> None:
    (tmp_path / "fem_reference").mkdir()
    (tmp_path / "fem_reference" / "__init__.py").write_text("raise SystemExit('the wrong one')")
    (tmp_path / "resource.py").write_text("raise SystemExit('the wrong one')")
    code = "import resource, fem_reference; print(fem_reference.__file__)"
    done = subprocess.run(
        command("-c", code), env=environment(), cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert Path(done.stdout.strip()) == Path(fem_reference.__file__)


def test_settings_are_added_and_paths_kept(monkeypatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/theirs")
    made = environment(OMP_NUM_THREADS="1")
    assert made["PYTHONPATH"].endswith(":/theirs")
    assert made["OMP_NUM_THREADS"] == "1"
    assert command("-m", "x")[0] == sys.executable
