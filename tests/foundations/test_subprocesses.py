"""Subprocesses import this copy of the package and nothing from the folder that they are started in."""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import fem_reference
from fem_reference.foundations import subprocesses
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


def test_the_peak_is_that_since_it_was_forgotten() -> None:
    before = subprocesses.peak_memory()
    block = np.ones(2**24)  # 128 MiB
    assert subprocesses.peak_memory() > before + 50 or before > 500  # it may have been there
    del block
    subprocesses.forget_peak_memory()
    assert subprocesses.peak_memory() > 0


def test_processor_time_is_of_a_process_and_its_descendants() -> None:
    code = "import time\nend = time.process_time() + 0.2\nwhile time.process_time() < end: pass\nprint(flush=True)\ninput()"
    with subprocess.Popen(command("-c", code), stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        found = subprocesses.processor_times(os.getpid())
        assert {os.getpid(), process.pid} <= set(found)
        assert 0.15 < found[process.pid] < 60
        process.communicate(b"\n")
    time.sleep(0.05)
    assert process.pid not in subprocesses.processor_times(os.getpid())
    assert subprocesses.processor_times(2**30) == {}


def test_a_folder_is_gone_at_the_end() -> None:
    with subprocesses.scratch_folder() as mine:
        (mine / "job").write_text("x")
    assert not mine.exists()


def test_only_what_a_killed_process_left_a_while_ago_is_removed(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(subprocesses.tempfile, "gettempdir", lambda: str(tmp_path))
    now = time.time()
    with subprocesses.scratch_folder() as mine:
        os.utime(mine, (now - 100, now - 100))
        left = tmp_path / "fem_reference_scratch-left"
        left.mkdir()
        (left / ".lock").touch()
        with subprocesses.scratch_folder() as young:
            assert mine.is_dir()
            assert left.is_dir()
            assert young != mine
        os.utime(left, (now - 100, now - 100))
        with subprocesses.scratch_folder():
            assert mine.is_dir()
            assert not left.exists()
