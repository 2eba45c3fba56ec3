"""The folders of runs while they are made: by one process at a time, with the error bars beside them, with states or without."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from fem_reference.assessment import error_bars
from fem_reference.io import files
from fem_reference.runs import store
from fem_reference.runs.key import versions
from fem_reference.scenes.case import SolverChoice

log = logging.getLogger(__name__)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Make the run in ``folder`` alone: a second process waits, and then finds it made."""
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


def without_states(choice: SolverChoice) -> SolverChoice:
    """The ``choice`` of a run that is only measured, one of many: the reference keeps no states of it."""
    return choice.model_copy(update={"store_state": False}) if choice.solver == "fenicsx" else choice
