"""Runs that are cut off go on and end as those that were not; what cannot be written is one sentence, and nothing is half there."""

import errno
import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import kills
import numpy as np
import pytest
import shapes
import small
from undrawn import UNDRAWN

from fem_reference import cli, report
from fem_reference.assessment.stress import Stress
from fem_reference.export.folders import new_folder
from fem_reference.foundations import subprocesses
from fem_reference.io import files
from fem_reference.report import stress_page
from fem_reference.runs.states import write_arrays
from fem_reference.runs.store import Frame, Run
from fem_reference.runs.writer import RESTART, Writer
from fem_reference.scenes import casefile
from fem_reference.solvers.fenicsx import jobs
from fem_reference.studies.execution import Bench

SURFACE = shapes.sphere(1, 10.0)
MOVING = """
[[effect]]
name = "inertia"
density = "1000 kg/m^3"

[[effect]]
name = "viscosity"
eta = "10 Pa s"

[[effect]]
name = "contact"
stiffness = "1 MPa/mm"
smoothing = "0.5 mm"

[fibres]
"""


class CutError(Exception):
    """What ends a run in the middle."""


def cut_after(monkeypatch: pytest.MonkeyPatch, frames: int) -> None:
    """From now on, whoever stores that many frames of a run is cut off."""
    add = Writer.add

    def until(self: Writer, frame: Frame) -> None:
        add(self, frame)
        if len(self.frames) == frames:
            raise CutError

    monkeypatch.setattr(Writer, "add", until)


def solved(scene: Path, runs: Path, changes: dict[str, Any]) -> Run:
    bench = Bench(casefile.read(scene, changes=changes), runs)
    return bench.obtain("reference", bench.scene.reference, "reference")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["with old factorisations", "with inertia and contact"])
def test_a_run_that_was_cut_off_goes_on(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a load comes back and an old factorisation serves on, and where velocities and contact are remembered."""
    scene = small.write(tmp_path / "bar")
    changes: dict[str, Any] = {"reference.first_step": 2.5, "frames.every": 4}
    if kind == "with old factorisations":
        text = (scene / "case.toml").read_text(encoding="utf-8")
        (scene / "case.toml").write_text(text.replace("first_step = 5", 'first_step = 5\nlinear_solver = "lagged"'))
    if kind == "with inertia and contact":
        text = (scene / "case.toml").read_text(encoding="utf-8").replace("[fibres]", MOVING)
        (scene / "case.toml").write_text(text.replace("every = 5", 'every = 5\ninterval = "2 ms"'))
    whole = solved(scene, tmp_path / "whole", changes)
    assert whole.outcome.status == "converged", whole.outcome.message
    for frames in (2, 5):
        with monkeypatch.context() as patch:
            cut_after(patch, frames)
            with pytest.raises(CutError):
                solved(scene, tmp_path / "cut", changes)
    begun: list[int] = []
    monkeypatch.setattr(Writer, "_log_progress", lambda _self, frame: begun.append(frame.number))
    ended = solved(scene, tmp_path / "cut", changes)
    assert begun == [20]  # what was stored was not solved again
    assert kills.differences(whole, ended) == []
    for name in ("newton_iterations", "load_steps", "cut_backs"):
        assert ended.outcome.cost[name] == whole.outcome.cost[name]
    assert not (ended.folder / RESTART).exists()  # type: ignore[operator]


@pytest.mark.slow
def test_a_command_that_is_killed_ends_as_if_it_had_not_been(tmp_path: Path) -> None:
    """``tests/kills.py`` does so more often, with error bars, pages and studies too."""
    subject = kills.Subject("run", tmp_path, 5, drawn=False)
    assert subject.kill(0.1, 3)
    assert subject.compare(subject.finish()) == []


# What a process does that may write no file beyond so many bytes: as on a disk that is full.
_SMALL_DISK = f"""
{UNDRAWN}
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[1]),) * 2)
from fem_reference.cli import main
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.slow
def test_a_disk_that_is_full_is_one_sentence(tmp_path: Path) -> None:
    """And once there is room all goes well."""
    scene = small.write(tmp_path / "bar")
    line = ["run", str(scene), "--solver", "pbd", "--out", str(tmp_path / "out"), "--quiet"]

    def ended(most: int) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            subprocesses.command("-c", _SMALL_DISK, str(most), *line),
            env=subprocesses.environment(),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            check=False,
        )

    full = ended(3_000)
    assert full.returncode == cli.BAD_INPUT
    assert re.fullmatch(r"fem-reference: .*vtp: cannot be written: File too large; .* MB are free .*\n", full.stderr)
    assert [path for path in tmp_path.rglob(".*") if path.suffix != ".lock"] == []
    done = ended(10**9)
    assert done.returncode in (cli.DONE, cli.VERDICT_FAIL), done.stderr


@pytest.mark.parametrize("facts", ["[" * 100_000, "[]", '{"mesh": "b"}', "{}", "NaN", ""])
def test_a_state_with_damaged_facts_is_not_gone_on_from(facts: str, tmp_path: Path) -> None:
    whole = jobs.Kept(tmp_path, "a")
    write_arrays(whole.place(10), {"facts": np.array('{"mesh": "a"}')})
    assert jobs._is_of(whole, 10)
    write_arrays(whole.place(10), {"facts": np.array(facts)})
    assert not jobs._is_of(whole, 10)


@pytest.mark.parametrize("name", ["a.vtp", "a.vtk", "a.vtu", "a.ply"])
def test_what_was_there_stays_where_there_is_no_room(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / name
    files.write_surface(path, SURFACE, SURFACE.points)
    before = path.read_bytes()

    def full(part: Path, *_: Any) -> None:
        part.write_bytes(before[:100])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(files.formats()[path.suffix].__class__, "write", property(lambda _self: full), raising=False)
    with pytest.raises(OSError, match=rf"{name}: cannot be written: No space left on device; .* MB are free there"):
        files.write_surface(path, SURFACE, SURFACE.points)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no folder here that root cannot write into either")
@pytest.mark.parametrize("words", [["run", "--solver", "pbd", "--out"], ["export", "--to"]])
def test_a_folder_that_is_read_only_is_one_sentence(words: list[str], tmp_path: Path, capsys: Any) -> None:
    """Nobody can write below /proc, and root does not know before it tries."""
    scene = small.write(tmp_path / "bar")
    before = sorted(tmp_path.rglob("*"))
    assert cli.main([words[0], str(scene), *words[1:], "/proc/not_ours", "--quiet"]) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert re.fullmatch(r"fem-reference: \S*not_ours\S*: cannot be written: [\w ]+\n", said), said
    assert sorted(tmp_path.rglob("*")) == before


def write_both(folder: Path, word: str) -> None:
    """A page with its numbers, and an export."""
    report.write(stress_page.page(Stress((), (), (), 0.0, {"said": 1000 * word})), folder, "page")
    with new_folder(folder / "exported") as part:
        files.write_text(part / "README.md", 1000 * word)


@pytest.mark.parametrize("which", [1, 2, 3])
def test_what_is_interrupted_while_it_is_written_leaves_what_was_there(
    which: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the middle of the numbers of a page, of the page and of an export."""
    write_both(tmp_path, "old ")
    before = {path.name: path.read_bytes() for path in tmp_path.glob("page*")}
    shutil.rmtree(tmp_path / "exported")
    write, count = Path.write_text, itertools.count(1)

    def cut(path: Path, text: str, **more: Any) -> int:
        if next(count) == which:
            write(path, text[: len(text) // 2], **more)
            raise KeyboardInterrupt
        return write(path, text, **more)

    monkeypatch.setattr(Path, "write_text", cut)
    with pytest.raises(KeyboardInterrupt):
        write_both(tmp_path, "new ")
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert set(after) == set(before) == {"page.json", "page.html"}  # nothing half-written, and no export
    assert [after[name] == before[name] for name in ("page.json", "page.html")] == [which == 1, which <= 2]


# What begins to write a page, or an export, and is killed in the middle.
_KILLED = """
import os, signal, sys
from pathlib import Path
from fem_reference.export.folders import new_folder
from fem_reference.io import files

def cut(path, text, **_):
    path.write_bytes(text[:500].encode())
    os.kill(os.getpid(), signal.SIGKILL)

Path.write_text = cut
folder = Path(sys.argv[1])
if os.fork() == 0:
    files.write_text(folder / "page.html", 1000 * "new ")
os.wait()
with new_folder(folder / "exported") as part:
    files.write_text(part / "README.md", 1000 * "new ")
"""


@pytest.mark.slow
def test_what_is_killed_while_it_is_written_leaves_what_was_there(tmp_path: Path) -> None:
    """And what it had begun is removed by who writes there next."""
    files.write_text(tmp_path / "page.html", "old")
    done = subprocess.run(
        subprocesses.command("-c", _KILLED, str(tmp_path)), env=subprocesses.environment(), check=False
    )
    assert done.returncode == -signal.SIGKILL
    assert {path.name for path in tmp_path.iterdir() if path.name[0] != "."} == {"page.html"}
    assert (tmp_path / "page.html").read_text() == "old"
    for path in tmp_path.iterdir():
        os.utime(path, (time.time() - 100,) * 2)
    files.write_text(tmp_path / "page.html", "new")
    with new_folder(tmp_path / "exported") as part:
        files.write_text(part / "README.md", "new")
    assert {path.name for path in tmp_path.iterdir()} == {"page.html", "exported"}


def dead() -> int:
    """The number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


def test_what_killed_processes_left_is_removed(tmp_path: Path) -> None:
    """And not what one that lives still writes, nor what is young."""
    gone, now = dead(), time.time()
    parts = [tmp_path / f".page-{number}.html" for number in (gone, os.getppid())]
    parts.append(tmp_path / f".page-{gone}.json")
    (tmp_path / f".exported-{gone}").mkdir()
    for path in (*parts, tmp_path / f".exported-{gone}"):
        path.touch()
        os.utime(path, (now - 100, now - 100))
    files.write_text(tmp_path / "page.html", "whole")
    files.clear(tmp_path / "exported")
    assert {path.name for path in tmp_path.iterdir()} == {"page.html", parts[1].name, parts[2].name}


def test_a_worker_ends_with_whom_it_works_for() -> None:
    """Even where that is killed and cannot end it."""
    worker = (
        "import time; from fem_reference.foundations.subprocesses import end_with_starter as e; e(); time.sleep(60)"
    )
    starter = (
        "import subprocess, sys, time; from fem_reference.foundations import subprocesses as s\n"
        f"p = subprocess.Popen(s.command('-c', {worker!r}), env=s.environment()); print(p.pid, flush=True); time.sleep(60)"
    )
    process = subprocess.Popen(
        subprocesses.command("-c", starter), env=subprocesses.environment(), stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    number = int(process.stdout.readline())
    assert subprocesses.lives(number)
    process.kill()
    process.communicate()
    until = time.monotonic() + 20
    while subprocesses.lives(number) and time.monotonic() < until:
        time.sleep(0.1)
    assert not subprocesses.lives(number)
