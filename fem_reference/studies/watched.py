"""Runs that are watched for effects that their case left out: as they are made, at their end, and when they are found stored."""

from collections.abc import Sequence

from fem_reference.problems.estimates import Decision
from fem_reference.problems.stresses import Watch
from fem_reference.runs import cut_off
from fem_reference.runs.store import Frame, Run
from fem_reference.runs.writer import Writer


class StoppedError(Exception):
    """A run that goes on with other effects, and why."""


def begin(watch: Watch, writer: Writer) -> None:
    """Begin to watch a run, of which a process before this one may have stored frames."""
    watch.frames.clear()
    for number in writer.frames:
        watch.see(number, *cut_off.places(writer.folder, number))


def see(watch: Watch, frame: Frame) -> None:
    """StoppedError where an effect matters in a ``frame`` that was solved."""
    if frame.surface is not None:
        _stop(watch.see(frame.number, frame.surface, frame.points if len(frame.points) else None))


def end(watch: Watch) -> None:
    """StoppedError where one matters beside all that acted in a run."""
    _stop(watch.end())


def again(watch: Watch, run: Run) -> tuple[Decision, ...]:
    """The effects that matter in a stored ``run``, at the first frame that shows one."""
    assert run.folder is not None
    watch.frames.clear()
    for number in run.numbers:
        if found := watch.see(number, *cut_off.places(run.folder, number)):
            return found
    return watch.end()


def _stop(found: Sequence[Decision]) -> None:
    if found:
        titles = " and ".join(one.effect.title for one in found)
        raise StoppedError(f"{titles}, left out, turned out to matter at frame {found[0].turned_out}")
