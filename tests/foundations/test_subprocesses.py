"""Subprocesses import this copy of the package and nothing from the folder that they are started in."""

import math
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import fem_reference
from fem_reference.foundations import subprocesses
from fem_reference.foundations.subprocesses import MachineTime, command, environment


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


def test_the_load_is_what_others_do(monkeypatch) -> None:
    """Of 10 s on 2 cores, 12 s were busy, 8 s of them by this process: 4 of 20 s by others."""
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    for now, load in (
        (MachineTime(10.0, 8.0, 12.0), 0.2),
        (MachineTime(10.0, 8.5, 8.0), 0.0),  # rounded, or ended meanwhile
        (MachineTime(10.0, 0.0, 30.0), 1.0),
        (MachineTime(10.0, 8.0, math.nan), None),
        (MachineTime(0.0, 0.0, 0.0), None),
    ):
        monkeypatch.setattr(MachineTime, "now", classmethod(lambda _, now=now: now))
        assert MachineTime(0.0, 0.0, 0.0).load() == load
    monkeypatch.setattr(MachineTime, "now", classmethod(lambda _: MachineTime(10.0, 8.0, 12.0)))
    said = {"processor time": "8.0 s", "load by other processes": "20 % of the machine"}
    assert subprocesses.spent_since(MachineTime(0.0, 0.0, 0.0)) == said


def test_a_clock_counts_work_of_processes_that_have_ended() -> None:
    before = MachineTime.now()
    code = "import time\nend = time.process_time() + 0.3\nwhile time.process_time() < end: pass"
    subprocess.run(command("-c", code), check=True)
    after = MachineTime.now()
    assert after.ours - before.ours >= 0.25  # in steps of 10 ms
    assert after.all - before.all >= 0.25
    assert 0 <= before.load() <= 1


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
