"""Functions that make a run: they lock its folder, store frames as they are reached, and watch for omitted effects that matter."""

import logging
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from fem_reference.assessment import error_bars
from fem_reference.assessment.fronts import LOAD
from fem_reference.foundations.records import Record
from fem_reference.foundations.subprocesses import MachineTime, forget_peak_memory, peak_memory
from fem_reference.io import files
from fem_reference.problems.estimates import Decision
from fem_reference.problems.stresses import Watch
from fem_reference.runs import states, store
from fem_reference.runs.key import versions
from fem_reference.runs.store import Frame, Outcome, Run, Sink
from fem_reference.runs.writer import Writer, places
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers.common.protocol import AnySolver

log = logging.getLogger(__name__)


class StoppedError(Exception):
    """Raised to stop a run that has to continue with other effects."""


class OvertimeError(Exception):
    """Raised to stop a run that has used up its processor time."""


@dataclass(frozen=True)
class Wanted:
    """A requested run: its ``name`` on pages, its solver and settings, and the ``folder`` in which it is stored."""

    name: str
    choice: SolverChoice
    offer: AnySolver
    settings: Record
    folder: Path

    def stored(self, ended: tuple[str, ...]) -> Run | None:
        """The stored run, if its status is in ``ended``; None if other package versions made it or it lacks requested states."""
        run = store.finished(self.folder, ended)
        if run is None:
            return None
        now, then = versions(), run.origin.get("versions", {})
        other = [name for name in now if name in then and now[name] != then[name] and name != "python"]
        if other:
            log.info("%s: solved before, but with another version of %s; solving again", self.name, other[0])
            return None
        if getattr(self.settings, "store_state", None) and not states.are_kept(self.folder, run.numbers):
            log.info("%s: solved before, but its states were not stored; solving again", self.name)
            return None
        log.info("%s: solved before, taken from %s", self.name, self.folder)
        return replace(run, name=self.name)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """A context in which only this process makes the run in ``folder``. A second process waits, and then finds the stored run."""
    files.make_folder(folder.parent)
    lock = FileLock(folder.parent / f".{folder.name}.lock")
    try:
        held = lock.acquire(timeout=0)
    except Timeout:
        log.info("%s: another process is making this run; waiting for it", folder)
        held = lock.acquire()
    with held:
        yield


@contextmanager
def bars_kept(folder: Path) -> Iterator[None]:
    """A context that preserves the error bars of a run when the same package versions solve it again to store its states."""
    before = store.finished(folder)
    same = before is not None and before.origin.get("versions") == versions()
    bars = {path: path.read_text(encoding="utf-8") for path in folder.rglob(error_bars.FILE)} if same else {}
    yield
    for path, text in bars.items():
        files.make_folder(path.parent)
        files.write_text(path, text)


def seen(watch: Watch, folder: Path, numbers: Sequence[float]) -> Iterator[tuple[Decision, ...]]:
    """Show ``watch`` again the frames with these ``numbers``, stored in ``folder``; yield the effects that matter at each."""
    watch.frames.clear()
    for number in numbers:
        yield watch.see(number, *places(folder, number))


def _stop_for(found: Sequence[Decision]) -> None:
    """Raise StoppedError if effects were ``found`` to matter."""
    if found:
        titles = " and ".join(one.effect.title for one in found)
        raise StoppedError(f"{titles}, which the case left out, turned out to matter at frame {found[0].turned_out}")


def write(writer: Writer, solve: Callable[[Sink], Outcome], watch: Watch | None, time_limit: float = math.inf) -> None:
    """Solve, and write each frame as it is reached, then the cost. If no frame is reached, write the rest state.

    ``watch`` may stop the run. If this process uses more than ``time_limit`` [s] of processor time, the run ends at the next frame.
    """

    def add(frame: Frame) -> None:
        writer.add(frame)
        if (used := time.process_time() - began) > time_limit:
            raise OvertimeError(
                f"ended at frame {frame.number:g} after {used:.3g} s of processor time, limit {time_limit:g} s"
            )
        if watch is not None and frame.surface is not None:
            _stop_for(watch.see(frame.number, frame.surface, frame.points if len(frame.points) else None))

    if watch is not None:
        list(seen(watch, writer.folder, writer.frames))  # the frames stored by an earlier process
    forget_peak_memory()
    clock, began = MachineTime.now(), time.process_time()
    try:
        outcome = solve(add)
        if watch is not None and outcome.status == "converged":
            _stop_for(watch.end())
    except StoppedError as why:
        outcome = Outcome("stopped", str(why))
    except OvertimeError as why:
        outcome = Outcome("timed out", str(why))
    processor, cost = time.process_time() - began, outcome.cost
    # Compilation does not count: the processor time is limited to the clock time of set-up and solution.
    if "seconds_compile" in cost:
        processor = min(processor, cost.get("seconds_setup", 0.0) + cost.get("seconds_solve", math.inf))
    load = clock.load()
    used = {"seconds_processor": processor, "peak_memory_mb": peak_memory()} | ({} if load is None else {LOAD: load})
    outcome = replace(outcome, cost=used | cost)  # the solver's costs take precedence: they include its own processes
    if not writer.frames:
        rest = writer.rest
        writer.add(Frame(writer.state["frames"][0], rest.surface.points, rest.fibres.points if rest.fibres else None))
    names = {"watched": watch.names} if watch is not None and outcome.status == "converged" else {}
    writer.close(outcome, **_contact(writer.state), **names)


def _contact(state: dict[str, Any]) -> dict[str, str]:
    """A note on the first contact, from the ``state`` of a run; empty if its equations had no contact."""
    counts = state["scalars"].get("contact_points")
    if counts is None:
        return {}
    pressed = [number for number, count in zip(state["numbers"], counts, strict=True) if count]
    return {"contact": f"first contact at frame {pressed[0]}" if pressed else "no contact at any frame"}
