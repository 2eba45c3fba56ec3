"""Worker processes: how they end, by themselves, at a time limit, or when interrupted."""

import pickle
import shutil
import signal
import sys
import time
from pathlib import Path

import pytest

from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers.fenicsx import processes
from fem_reference.solvers.fenicsx.processes import MARK, Process

pytestmark = pytest.mark.slow


def outcome_of(words: list[str], time_limit: float | None = None) -> Outcome:
    """The end of a process: as it reports, or as it is found."""
    started = Process(words)
    try:
        return started.solve(Path("job.pickle"), time_limit, lambda _: None)
    finally:
        started.end()


def reported(tmp_path: Path, report: Frame | Outcome) -> str:
    """The line by which a process reports."""
    path = tmp_path / "report.pickle"
    path.write_bytes(pickle.dumps(report))
    return f"{MARK}{path}"


def two_ranks(program) -> list[str]:
    """The command line of a program on two ranks, as the wheel's MPI is started."""
    beside = Path(sys.executable).with_name("mpiexec")
    mpiexec = str(beside) if beside.exists() else shutil.which("mpiexec")
    return [mpiexec, "-n", "2", sys.executable, "-m", "mpi4py", str(program)]


@pytest.mark.usefixtures("all_cores")
def test_an_error_on_one_rank_ends_all(tmp_path) -> None:
    # The first rank finds no job and stops; the other would wait for it for ever.
    code = "from mpi4py import MPI; comm = MPI.COMM_WORLD; 1 / comm.rank; comm.Barrier()"
    (tmp_path / "half.py").write_text(code)
    outcome = outcome_of(two_ranks(tmp_path / "half.py"), 30)
    assert outcome.status == "crashed"
    assert "ended with exit status" in outcome.message  # and why, unless mpiexec ended before it had passed that on


def test_a_process_that_dies_is_a_status() -> None:
    command = [sys.executable, "-c", "import sys; sys.exit('no memory')"]
    outcome = outcome_of(command)
    assert outcome.status == "crashed"
    assert "exit status 1 (no memory); no frame was reached" in outcome.message


def test_a_time_limit_is_a_status() -> None:
    command = [sys.executable, "-c", "while True: pass"]
    outcome = outcome_of(command, 0.5)
    assert outcome.status == "timed out"
    assert "stopped after 0.5 s of processor time, the time limit" in outcome.message


@pytest.mark.usefixtures("all_cores")
def test_a_time_limit_is_of_each_process(tmp_path) -> None:
    (tmp_path / "busy.py").write_text("from mpi4py import MPI\nwhile MPI.COMM_WORLD.rank < 9: pass")
    outcome = outcome_of(two_ranks(tmp_path / "busy.py"), 1)
    assert outcome.status == "timed out"


def test_a_machine_that_is_busy_is_no_time_limit(tmp_path, monkeypatch) -> None:
    """A process that waits for three times its limit, as one does that gets no processor, goes on; at last it says nothing."""
    line = reported(tmp_path, Outcome("converged", "done"))
    waits = f"import time; time.sleep(1.5); print({line!r}, flush=True)"
    outcome = outcome_of([sys.executable, "-c", waits], 0.5)
    assert outcome.status == "converged"
    monkeypatch.setattr(processes, "CLOCK", 0.5)
    outcome = outcome_of([sys.executable, "-c", waits.replace("1.5", "60")], 0.5)
    assert outcome.status == "stalled"
    assert "the machine was busy, or a process waited; this allows no conclusion about the solution" in outcome.message


@pytest.mark.usefixtures("all_cores")
def test_an_interrupt_right_after_the_start_ends_all_ranks(tmp_path) -> None:
    (tmp_path / "sleep.py").write_text("import time; time.sleep(60)")
    begin = time.perf_counter()
    started = Process(two_ranks(tmp_path / "sleep.py"))
    started.end()  # mpiexec has no processes yet, and ignores what comes before them
    assert started.process.returncode != 0
    assert time.perf_counter() - begin < 20


@pytest.fixture
def deaf(tmp_path, monkeypatch):
    """A process that does not listen to signals, once it has reported a frame."""
    monkeypatch.setattr(processes, "PATIENCE", 0.3)
    ignore = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
    line = reported(tmp_path, Frame(1))
    started = Process([sys.executable, "-c", f"{ignore}; print({line!r}, flush=True)\nwhile True: pass"])
    yield started
    code = started.process.poll()
    started.process.kill()  # it would run on for ever after a test that fails
    assert code == -signal.SIGKILL


def test_an_interrupt_kills_a_process_that_does_not_listen(deaf) -> None:
    def interrupt(_: Frame) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        deaf.solve(Path("job.pickle"), None, interrupt)
    deaf.end()


def test_a_time_limit_kills_a_process_that_does_not_listen(deaf) -> None:
    frames: list[Frame] = []
    ended = deaf.solve(Path("job.pickle"), 0.2, frames.append)
    deaf.end()
    assert [frame.number for frame in frames] == [1]
    assert (ended.status, ended.message) == (
        "timed out",
        "stopped after 0.2 s of processor time, the time limit; frames up to 1 are kept",
    )
