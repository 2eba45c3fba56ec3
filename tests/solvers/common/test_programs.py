"""Programs as subprocesses: what they used, and how they ended. Their frames are tested with the solver ``command``."""

import sys
import time

import pytest

from fem_reference.solvers.common import programs


def run(text: str, tmp_path, limit: float = 60.0) -> programs.Ended:
    return programs.run([sys.executable, "-c", text], tmp_path, limit)


@pytest.mark.slow
def test_time_is_by_the_clock_and_of_the_processor_with_its_own_processes(tmp_path) -> None:
    """A second of waiting is no work; half a second of work of a process that it waits for is."""
    work = "import time; b = time.process_time()\nwhile time.process_time() - b < 0.5: pass"
    ended = run(
        f"import subprocess, sys, time; time.sleep(0.5); subprocess.run([sys.executable, '-c', {work!r}])", tmp_path
    )
    assert ended.code == 0
    assert ended.seconds > 1.0 > ended.processor > 0.5
    assert ended.limit is None


@pytest.mark.slow
def test_work_of_its_ended_processes_counts_for_the_limit(tmp_path) -> None:
    """One after the other, each far below it."""
    work = "import time; b = time.process_time()\nwhile time.process_time() - b < 0.1: pass"
    ended = run(
        f"import subprocess, sys\nfor _ in range(90): subprocess.run([sys.executable, '-c', {work!r}])", tmp_path, 0.6
    )
    assert ended.limit is not None
    assert ended.limit[0] == "timed out"


def test_what_it_prints_last_and_how_it_ends(tmp_path) -> None:
    ended = run("print('x' * 10**6); print('the end', flush=True); import os; os.abort()", tmp_path)
    assert (ended.said, ended.code) == ("the end", -6)
    assert run("", tmp_path).said == ""


def test_its_memory_is_its_own(tmp_path) -> None:
    """50 MB are asked for, and written into."""
    held = run("held = b'x' * 50_000_000; import time; time.sleep(0.3)", tmp_path).memory
    assert 50 < held < 100


def test_it_reads_nothing_and_runs_where_it_is_told(tmp_path) -> None:
    assert run("import sys; print(repr(sys.stdin.read()))", tmp_path).said == "''"
    assert run("import os; print(os.getcwd())", tmp_path).said == str(tmp_path)


def test_the_limit_of_somebody_else_ends_it(tmp_path, monkeypatch) -> None:
    """Such as the alarm of hard cases, raised while it is waited for."""
    begin = time.monotonic()

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(programs.os, "wait4", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run("import time; time.sleep(60)", tmp_path)
    assert time.monotonic() - begin < 30  # it has ended, or the wait for it would not


def test_a_program_is_found_where_it_runs_or_on_the_path(tmp_path) -> None:
    (tmp_path / "mine").write_text("#!/bin/sh\n")
    assert programs.found("./mine", tmp_path) is None  # it may not be executed
    (tmp_path / "mine").chmod(0o755)
    assert programs.found("./mine", tmp_path) == tmp_path / "./mine"
    assert programs.found("mine", tmp_path) is None
    assert programs.found("sh", tmp_path) is not None
