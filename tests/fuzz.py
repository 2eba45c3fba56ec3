"""Damaged input by the thousand: each is accepted or refused by a sentence, in ten seconds and two gigabytes, or this says which.

``python tests/fuzz.py --inputs 10000 --seed 1``: exit status 0 where all went well; 1 where not, with the damaged files kept.
"""

import argparse
import importlib
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

import calls
import damage
import hostile
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.solvers import fenicsx

# Of one input: processor time [s] of a damaged file and of a call, the time that passes on a machine that is shared, and memory
# [bytes].
SECONDS, CALL, PATIENCE, MEMORY = 10, 60, 900, 2 * 2**30
KINDS = [*hostile.KINDS, *calls.KINDS]
# What most processes of an input would otherwise import each for itself, which takes longer than what they do.
SHARED = ("numba", "pint", "scipy.interpolate", "scipy.stats")
# Inputs are drawn, and neither timed, kept nor made smaller, by Hypothesis.
UNTIMED = settings(deadline=None, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck))


@dataclass
class Tried:
    """What came of the inputs of a kind; ``failed``: why, and the folder in which the input is kept."""

    count: Counter[str] = field(default_factory=Counter)
    failed: list[str] = field(default_factory=list)
    slowest: float = 0.0


def limited(kind: hostile.Kind, folder: Path) -> str:
    """What came of reading ``folder`` in a process with limits: accepted, refused, or why it failed."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        _read(kind, folder, writing)
    os.close(writing)
    ready, _, _ = select.select([reading], [], [], PATIENCE)
    if not ready:
        os.kill(child, signal.SIGKILL)
    said = os.read(reading, 4000).decode(errors="replace") if ready else ""
    os.close(reading)
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if not ready or seconds > SECONDS:
        return f"more than {SECONDS} s"
    if os.WIFSIGNALED(status):
        return f"ended by {signal.Signals(os.WTERMSIG(status)).name}"
    return said or f"exit status {os.waitstatus_to_exitcode(status)}"


def _read(kind: hostile.Kind, folder: Path, writing: int) -> None:
    """In the process of an input: what it says goes into the pipe."""
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS + 2, SECONDS + 2))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY,) * 2)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    try:
        kind.read(folder)
        said = "accepted"
    except hostile.REFUSED as error:
        text = str(error)
        said = "refused" if ": got " in text and ", want " in text else f"a message without place: {text}"
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)[-3:]
        places = " < ".join(f"{Path(frame.filename).name}:{frame.lineno}" for frame in reversed(frames))
        said = f"{type(error).__name__}: {str(error)[:150]} ({places})"
    if (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 > MEMORY:
        said = "more than 2 GB"
    os.write(writing, said.encode(errors="replace")[:4000])
    os._exit(0)


def fuzz(name: str, inputs: int, number: int, kept: Path) -> Tried:
    """Try so many inputs of a kind; those that failed are kept below ``kept``."""
    kind, tried = hostile.KINDS[name], Tried()
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place:
        whole, folder = Path(place) / "whole", Path(place) / "work" / "ball"
        whole.mkdir()
        kind.make(whole)
        said = limited(kind, _copied(whole, folder))
        if said != "accepted":
            tried.failed.append(f"{name}: undamaged: {said}")
            return tried
        targets = sorted(path.relative_to(whole) for path in whole.glob(kind.damaged) if path.is_file())
        strategies = {target: damage.damage((whole / target).read_bytes()) for target in targets}

        @seed(number)
        @settings(UNTIMED, max_examples=inputs)
        @given(st.sampled_from(targets).flatmap(lambda target: st.tuples(st.just(target), strategies[target])))
        def attempt(damaged: tuple[Path, bytes]) -> None:
            target, data = damaged
            _copied(whole, folder)
            (folder / target).write_bytes(data)
            began = time.perf_counter()
            came = limited(kind, folder)
            tried.slowest = max(tried.slowest, time.perf_counter() - began)
            tried.count[came if came in ("accepted", "refused") else "failed"] += 1
            if came not in ("accepted", "refused"):
                where = kept / f"{name} {len(tried.failed)}".replace(" ", "_")
                _copied(folder, where)
                tried.failed.append(f"{name}: {target}: {came} [{where}]")

        attempt()
    return tried


@contextmanager
def world() -> Iterator[calls.World]:
    """What calls are made with, and one process that solves."""
    with tempfile.TemporaryDirectory(prefix="fuzz-") as place, fenicsx.shared():
        yield calls.World(Path(place))


def fuzz_calls(name: str, inputs: int, number: int, at: calls.World) -> Tried:
    """Try so many calls of a kind, in this process; what failed is said by what was called with."""
    tried = Tried()

    @seed(number)
    @settings(UNTIMED, max_examples=inputs)
    @given(calls.KINDS[name](at))
    def attempt(call: Callable[[], object]) -> None:
        began = time.perf_counter()
        came = called(call)
        tried.slowest = max(tried.slowest, time.perf_counter() - began)
        tried.count[came if came in ("accepted", "refused", "wrong signature") else "failed"] += 1
        if came not in ("accepted", "refused", "wrong signature"):
            tried.failed.append(f"{name}: {came}: {_closure(call)}")

    attempt()
    return tried


def called(call: Callable[[], object]) -> str:
    """What came of a call: accepted, refused, or why it failed."""

    def late(number: int, *_: object) -> None:
        used = f"{CALL} s of processor time" if number == signal.SIGPROF else f"{PATIENCE} s"
        raise TimeoutError(f"more than {used}")

    for number in (signal.SIGPROF, signal.SIGALRM):
        signal.signal(number, late)
    signal.setitimer(signal.ITIMER_PROF, CALL)
    signal.alarm(PATIENCE)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the caller's own functions
            call()
    except hostile.REFUSED as error:
        text = str(error)
        return "refused" if ": got " in text and ", want " in text else f"a message without place: {text}"
    except MissingSoftware:
        return "refused"
    except Exception as error:
        frames = traceback.extract_tb(error.__traceback__)[-3:]
        if isinstance(error, TypeError) and len(traceback.extract_tb(error.__traceback__)) <= 2 + (
            "argument" not in str(error)
        ):
            return "wrong signature"
        places = " < ".join(f"{Path(frame.filename).name}:{frame.lineno}" for frame in reversed(frames))
        return f"{type(error).__name__}: {str(error)[:150]} ({places})"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.alarm(0)
    return "accepted"


def _closure(call: Callable[[], object]) -> str:
    """What a call is made with."""
    inside = call.__closure__ or ()
    return "; ".join(repr(cell.cell_contents)[:200] for cell in inside)


def _copied(source: Path, target: Path) -> Path:
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(source, target)
    return target


def shares(name: str, names: Sequence[str]) -> int:
    """The number of equal shares of all inputs, of which a kind gets one: calls from Python are half of them, files the other."""
    alike = [one for one in names if (one in calls.KINDS) is (name in calls.KINDS)]
    return len(names) if len(alike) == len(names) else 2 * len(alike)


def every(names: Sequence[str], options: argparse.Namespace) -> Iterator[tuple[str, Tried]]:
    """What came of each kind: of files, which are read in processes that fork, before calls."""
    counts = {name: -(-options.inputs // shares(name, names)) for name in names}
    of_calls = [name for name in names if name in calls.KINDS]
    if len(of_calls) < len(names):
        for module in SHARED:
            importlib.import_module(module)
    for name in names:
        if name in hostile.KINDS:
            yield name, fuzz(name, counts[name], options.seed, options.kept)
    with world() if of_calls else nullcontext() as at:
        for name in of_calls:
            yield name, fuzz_calls(name, counts[name], options.seed, at)


def main() -> int:
    """Try every kind, or those named; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(KINDS)} (default: all)")
    parser.add_argument("--inputs", type=int, default=10_000, help="in all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kept", type=Path, default=Path(tempfile.gettempdir()) / "fuzz", help="where failures go")
    options = parser.parse_args()
    names = options.kinds or KINDS
    failed, total = [], 0
    for name, tried in every(names, options):
        total += sum(tried.count.values())
        failed += tried.failed
        counts = ", ".join(f"{count} {word}" for word, count in sorted(tried.count.items()))
        sys.stdout.write(f"{name}: {counts or 'none'}, {tried.slowest:.1f} s at most\n")
        sys.stdout.write("".join(f"  {line}\n" for line in tried.failed))
        sys.stdout.flush()
    sys.stdout.write(f"{total} inputs, {len(failed)} failed\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
