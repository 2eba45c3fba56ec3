"""Runs that are taken from the store: who makes them meanwhile, which fit what is asked for, what is kept beside them."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from filelock import FileLock, Timeout

from fem_reference.assessment import error_bars
from fem_reference.foundations.records import Record
from fem_reference.io import files
from fem_reference.runs import states, store
from fem_reference.runs.key import versions
from fem_reference.runs.store import Run

log = logging.getLogger(__name__)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Nobody else makes the run in ``folder`` meanwhile: whoever comes second waits, and then finds it made."""
    files.make_folder(folder.parent)
    lock = FileLock(folder.parent / f".{folder.name}.lock")
    try:
        lock.acquire(timeout=0)
    except Timeout:
        log.info("%s: another process is making this run; waiting for it", folder)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


@contextmanager
def bars_kept(folder: Path) -> Iterator[None]:
    """The error bars beside a run are there afterwards too, where the same packages solve it again for its states."""
    path, before = folder / error_bars.FILE, store.finished(folder)
    same = before is not None and before.origin.get("versions") == versions()
    bars = path.read_text(encoding="utf-8") if same and path.is_file() else None
    yield
    if bars is not None:
        files.write_text(path, bars)


def stored(folder: Path, name: str, ended: tuple[str, ...], settings: Record) -> Run | None:
    """The run in ``folder`` that ``ended`` so, under the name that it has here; None where there is none, other packages made
    it, or it lacks states that the ``settings`` ask for.
    """
    run = store.finished(folder, ended)
    if run is None:
        return None
    now, then = versions(), run.origin.get("versions", {})
    other = [package for package in now if package in then and now[package] != then[package] and package != "python"]
    if other:
        log.info("%s: solved before, but with another %s; solving again", name, other[0])
        return None
    if getattr(settings, "store_state", None) and not states.are_kept(folder, run.numbers):
        log.info("%s: solved before without its states; solving again", name)
        return None
    log.info("%s: solved before, taken from %s", name, folder)
    return replace(run, name=name)
