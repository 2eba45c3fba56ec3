"""Many runs at once: on processes of this machine, or on the workers of a Dask cluster; each run goes into the store.

A worker that dies takes nothing with it but what it was solving: that is solved again, by another worker. What is in the store is
not solved again, so that a campaign that was cut off goes on where it was.
"""

import logging
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.runs import store as runs
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench
from fem_reference.studies.ladders import Trial
from fem_reference.studies.scene_changes import without_states

log = logging.getLogger(__name__)

# How often a run is tried again whose worker died.
ATTEMPTS = 3
# A run that ended so ends so again; one that timed out or crashed may have had other reasons.
_LASTING = ("diverged", "inverted", "collapsed", "limit point", "out of steps")


@dataclass(frozen=True)
class Workers:
    """Solvers of runs: so many processes of this machine (``count``), or the workers of the Dask scheduler at ``address``, such as
    one that dask-jobqueue started on a cluster; these see the same store. InputError where it is fewer than one.
    """

    count: int = 1
    address: str | None = None

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError("--workers", self.count, "1 or more")

    def __str__(self) -> str:
        """The manner of runs, beside what machine it is."""
        if self.address is not None:
            return "runs by the workers of a cluster"
        return "runs one after the other" if self.count == 1 else f"runs {self.count} at once"


@dataclass(frozen=True, eq=False)
class Made:
    """A trial with its ``run``, or why there is none (``failure``)."""

    trial: Trial
    run: Run | None
    failure: str = ""

    @property
    def reached(self) -> Run | None:
        """The run, None where it did not reach all frames."""
        return self.run if self.run is not None and self.run.outcome.status == "converged" else None


def carry_out(trials: Sequence[Trial], store: Path, workers: Workers) -> tuple[Made, ...]:
    """The runs of all ``trials``, in their order, from the ``store`` where they are, else solved now."""
    if workers.count == 1 and workers.address is None:
        made = []
        for i, trial in enumerate(trials):
            log.info("run %d of %d: %s", i + 1, len(trials), trial.label)
            made.append(_made(trial, lambda trial=trial: solve(trial, store)))  # type: ignore[misc]
        return tuple(made)
    return _in_parallel(trials, store.absolute(), workers)


def solve(trial: Trial, store: Path) -> Run:
    """The run of a trial, in this process; one that failed before is not tried again, where it would fail again."""
    bench = shared_bench(trial.scene, store)
    folder = bench.folder(trial.choice, trial.name)
    if runs.status(folder) in _LASTING:
        return _loaded(folder, trial)
    return bench.obtain(trial.name, without_states(trial.choice), trial.name)


@lru_cache(maxsize=2)
def _kept(key: str, store: Path, case: str) -> list[Bench[MuscleCase]]:  # noqa: ARG001 - they are the key
    """An empty list, the same each time: a case itself is no key."""
    return []


def shared_bench(case: MuscleCase, store: Path) -> Bench[MuscleCase]:
    """The bench, and so the tetrahedra, that runs on a case share in this process."""
    kept = _kept(case.key, store, str(case.folder))
    if not kept:
        kept.append(Bench(case, store, ranks=1))
    return kept[0]


def _made(trial: Trial, result: Callable[[], Run]) -> Made:
    """A trial with its result; bad input and what is not installed are no reason to give up the others."""
    try:
        return Made(trial, result())
    except (InputError, MissingSoftware) as error:
        return Made(trial, None, str(error).replace(f"{trial.scene.folder}{os.sep}", ""))


def _in_parallel(trials: Sequence[Trial], store: Path, workers: Workers) -> tuple[Made, ...]:
    made, begin = dict[int, Made](), time.perf_counter()
    for attempt in range(ATTEMPTS):
        left = [i for i in range(len(trials)) if i not in made]
        if not left:
            break
        if attempt:
            log.info("a worker ended before its time; %d runs are tried again", len(left))
        try:
            with _executor(workers) as executor:
                futures = {executor.submit(_stored, trials[i], store): i for i in left}
                for i, one in _finished(futures, trials):
                    made[i] = one
                    _log(len(made), len(trials), one, begin)
        except BrokenProcessPool:
            continue
    lost = [Made(trial, None, f"its worker ended before its time, {ATTEMPTS} times") for trial in trials]
    return tuple(made.get(i, lost[i]) for i in range(len(trials)))


def _finished(futures: dict[Future[Path], int], trials: Sequence[Trial]) -> Iterator[tuple[int, Made]]:
    """Each trial with its result as its future ends; the run itself is read from the store."""
    for future in as_completed(futures):
        i = futures[future]
        yield i, _made(trials[i], lambda future=future, i=i: _loaded(future.result(), trials[i]))  # type: ignore[misc]


def _loaded(folder: Path, trial: Trial) -> Run:
    return replace(runs.load(folder), name=trial.name)


def _stored(trial: Trial, store: Path) -> Path:
    """Solve a trial in a worker; the folder of its run in the store."""
    folder = solve(trial, store).folder
    assert folder is not None  # what a solver of ours makes is stored
    return folder


def _log(done: int, count: int, one: Made, begin: float) -> None:
    passed = time.perf_counter() - begin
    status = one.run.outcome.status if one.run else one.failure
    left = f", about {passed / done * (count - done):.0f} s left" if done < count else ""
    log.info("run %d of %d: %s: %s%s", done, count, one.trial.label, status, left)


def _executor(workers: Workers) -> AbstractContextManager[Executor]:
    if workers.address is None:
        # Processes of their own and no forks: numba, PETSc and locks do not survive those.
        return ProcessPoolExecutor(workers.count, mp_context=multiprocessing.get_context("spawn"))
    return _dask(workers.address)


@contextmanager
def _dask(address: str) -> Iterator[Executor]:
    """The workers of a Dask scheduler; it hands what a worker that died was solving to another one by itself."""
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingSoftware("Dask is not installed: pip install 'fem_reference[cluster]'") from error
    with Client(address) as client, nullcontext(client.get_executor(retries=ATTEMPTS)) as executor:
        yield executor
