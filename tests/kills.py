"""Commands that are killed at random moments and begun again: each must end as the one that nothing befell.

``python tests/kills.py --kills 20 --seed 1``: exit status 0 where all ends are the same; 1 where not, with what differs.
"""

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import small
from undrawn import UNDRAWN

from fem_reference.foundations.subprocesses import command, environment
from fem_reference.runs import store
from fem_reference.runs.store import Run

SAME = 1e-9
COMMANDS = {
    "run": ["run"],
    "error bar": ["run", "--error-bar"],
    "page": ["compare", "--candidate", "pbd"],
    "study": ["study", "--solver", "arap"],
}
# What a command does that draws no pictures.
_COMMAND = f"{UNDRAWN}from fem_reference.cli import entry\nentry()\n"
# What is no answer: it takes another time each time.
_TIMES = ("seconds", "cost", "machine", "peak_memory", "processor", "finished", "time", "folder", "unknowns_per")


def differences(one: Run, other: Run) -> list[str]:
    """In what two runs are not the same up to ``SAME`` of their size."""
    found = []
    if (one.numbers, one.outcome.status, one.outcome.message) != (
        other.numbers,
        other.outcome.status,
        other.outcome.message,
    ):
        found.append(f"{one.numbers} {one.outcome.message} / {other.numbers} {other.outcome.message}")
        return found
    pairs = {"positions": (one.positions, other.positions), "fibres": (one.fibre_positions, other.fibre_positions)}
    pairs |= {
        name: (one.scalars.get(name), other.scalars.get(name))
        for name in {*one.scalars, *other.scalars}
        if not name.startswith("seconds")
    }
    for name, (left, right) in pairs.items():
        if (left is None) != (right is None):
            found.append(f"{name}: in one only")
        elif left is not None and right is not None:
            size = float(np.nanmax(np.abs(left), initial=1e-3))
            off = float(np.nanmax(np.abs(left - right), initial=0.0)) / size
            if off > SAME or not np.array_equal(np.isnan(left), np.isnan(right)):
                found.append(f"{name}: {off:.2g} of its size")
    return found


def _ended(out: Path, scratch: Path) -> dict[str, Any]:
    """What a command left: its runs by folder, its other numbers by file, and what it should not have left."""
    runs = {path.parent.name: store.load(path.parent) for path in sorted(out.glob("runs/*/run.json"))}
    numbers = {
        str(path.relative_to(out)): _answers(json.loads(path.read_text(encoding="utf-8")))
        for path in sorted(out.rglob("*.json"))
        if path.name != "run.json"
    }
    left = [path.relative_to(out) for path in out.rglob("*") if path.name == "restart" or path.name.startswith(".")]
    litter = [str(path) for path in left if path.suffix != ".lock"]
    pages = sorted(str(path.relative_to(out)) for path in out.rglob("*.html"))
    return {"runs": runs, "numbers": numbers, "left": litter, "pages": pages, "scratch": len(list(scratch.iterdir()))}


def _answers(value: Any) -> Any:
    """The numbers and texts of JSON but times."""
    if isinstance(value, dict):
        return {key: _answers(one) for key, one in value.items() if not any(word in key for word in _TIMES)}
    return [_answers(one) for one in value] if isinstance(value, list) else value


def _apart(one: Any, other: Any, place: str = "") -> list[str]:
    """Where two trees differ by more than ``SAME``."""
    if isinstance(one, dict) and isinstance(other, dict) and one.keys() == other.keys():
        return [line for key in one for line in _apart(one[key], other[key], f"{place}.{key}")]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [line for i, pair in enumerate(zip(one, other, strict=True)) for line in _apart(*pair, f"{place}[{i}]")]
    if isinstance(one, float) and isinstance(other, float):
        return [] if abs(one - other) <= SAME * max(abs(one), 1e-3) else [f"{place}: {one!r} / {other!r}"]
    return [] if one == other else [f"{place}: {str(one)[:80]} / {str(other)[:80]}"]


class Subject:
    """A command on the small scene, and how it ends when nothing befalls it; of its pages only the names are compared, so that they
    may be without pictures (``drawn``).
    """

    def __init__(self, name: str, place: Path, every: int, *, drawn: bool = True) -> None:
        self.words, self.every, self.drawn = COMMANDS[name], every, drawn
        self.scene = small.write(place / "bar")
        # The same each time: keys of runs may name files that lie there.
        self.out, self.scratch = place / "out", place / "tmp"
        self.scratch.mkdir()
        began = time.perf_counter()
        self.whole = self.finish()
        self.seconds, self.frames = time.perf_counter() - began, self.stored()
        shutil.rmtree(self.out)

    def start(self) -> subprocess.Popen[str]:
        """The command, in a group of processes of its own."""
        verb, *rest = self.words
        words = [verb, str(self.scene), *rest, "--out", str(self.out), "--set", f"frames.every={self.every}"]
        return subprocess.Popen(
            command(*(("-m", "fem_reference") if self.drawn else ("-c", _COMMAND)), *words),
            env=environment(OMP_NUM_THREADS="1", TMPDIR=str(self.scratch)),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def finish(self) -> dict[str, Any]:
        """How it ends; RuntimeError where it does not end well."""
        process = self.start()
        _, errors = process.communicate()
        if process.returncode not in (0, 1):
            raise RuntimeError(f"{self.words} ended with {process.returncode}: {errors[-1000:]}")
        return _ended(self.out, self.scratch)

    def kill(self, after: float, frames: int = 0) -> bool:
        """Start it, and kill it, and nobody else, so many seconds after so many more frames are stored; whether it still ran."""
        process, stored = self.start(), self.stored()
        while process.poll() is None and self.stored() < stored + frames:
            time.sleep(0.01)
        try:
            process.communicate(timeout=after)
        except subprocess.TimeoutExpired:
            os.kill(process.pid, signal.SIGKILL)
            process.communicate()
            return True
        return False

    def stored(self) -> int:
        """How many frames of its runs are stored."""
        return len(list(self.out.glob("runs/*/surface/frame_*.vtp")))

    def compare(self, end: dict[str, Any]) -> list[str]:
        """What is not as where nothing befell it."""
        found = [f"left behind: {path}" for path in end["left"]]
        for part in ("numbers", "pages"):
            found += _apart(self.whole[part], end[part], part)
        if self.whole["runs"].keys() != end["runs"].keys():
            return [*found, f"other runs: {sorted(end['runs'])} / {sorted(self.whole['runs'])}"]
        for name, run in end["runs"].items():
            found += [f"{name}: {line}" for line in differences(self.whole["runs"][name], run)]
        return found


def trial(subject: Subject, moments: random.Random) -> tuple[str, list[str]]:
    """Kill a command once or twice, let it end, and compare."""
    times = [(subject.seconds * moments.uniform(0.1, 0.95), 0)]
    times += [(moments.uniform(0, 0.3), moments.randrange(1, subject.frames))]
    chosen = moments.choice((times[:1], times[1:], times[1:], [times[1], times[1]]))
    killed = [subject.kill(*one) for one in chosen]
    found = subject.compare(subject.finish())
    shutil.rmtree(subject.out)
    said = [
        f"{after:.2f} s after {stored} frames{'' if dead else ' (it had ended)'}"
        for (after, stored), dead in zip(chosen, killed, strict=True)
    ]
    return ", then ".join(said), found


def main() -> int:
    """Try the commands in turn; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help=f"of {', '.join(COMMANDS)} (default: all)")
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--every", type=int, default=2, help="frames wanted of the 20 of the small scene")
    options = parser.parse_args()
    moments, bad = random.Random(options.seed), 0
    names = options.commands or list(COMMANDS)
    with tempfile.TemporaryDirectory(prefix="kills-") as folder:
        for i, name in enumerate(names):
            (Path(folder) / name).mkdir()
            subject = Subject(name, Path(folder) / name, options.every)
            sys.stdout.write(f"{name}: {subject.seconds:.1f} s, {len(subject.whole['runs'])} runs\n")
            for _ in range(i, options.kills, len(names)):
                times, found = trial(subject, moments)
                bad += bool(found)
                sys.stdout.write(f"  killed after {times}: {'; '.join(found[:5]) or 'the same end'}\n")
                sys.stdout.flush()
    sys.stdout.write(f"{options.kills} trials, {bad} with another end\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
