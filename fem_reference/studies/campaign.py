"""Many runs at once, in processes on this machine or on the workers of a Dask cluster; each run is stored as soon as it ends.

If a worker dies, only the run that it was solving is lost, and another worker repeats it. Stored runs are reused, so an interrupted
campaign continues where it stopped.
"""

import logging
import multiprocessing
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.runs import store as runs
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import Trial, without_states

log = logging.getLogger(__name__)

# The number of attempts at a run whose worker died.
ATTEMPTS = 3
# A run that ended with one of these statuses would end the same way again; a run that timed out or crashed may succeed.
_LASTING = ("diverged", "inverted", "collapsed", "limit point", "out of steps")
_BENCHES: dict[tuple[str, Path, Path], Bench[MuscleCase]] = {}


@dataclass(frozen=True)
class Workers:
    """Workers that solve runs: ``count`` processes on this machine, or the workers of the Dask scheduler at an ``address``.

    Dask-jobqueue, for example, starts such a scheduler on a cluster. All workers need access to the store. Raises InputError if
    ``count`` is below one.
    """

    count: int = 1
    address: str | None = None

    def __post_init__(self) -> None:
        if self.count < 1:
            raise InputError("--workers", self.count, "1 or more")

    def __str__(self) -> str:
        """The manner in which runs are solved, for reports."""
        if self.address is not None:
            return "runs by the workers of a cluster"
        return "runs one after the other" if self.count == 1 else f"runs {self.count} at once"


@dataclass(frozen=True, eq=False)
class Made:
    """A trial with its ``run``, or the reason (``failure``) why there is none."""

    trial: Trial
    run: Run | None
    failure: str = ""

    @property
    def reached(self) -> Run | None:
        """The run; None if there is no run or it did not reach all frames."""
        return self.run if self.ended[0] == "converged" else None

    @property
    def ended(self) -> tuple[str, str]:
        """Status and message of the run; ``"refused"`` and the reason if there is no run."""
        return (self.run.outcome.status, self.run.outcome.message) if self.run else ("refused", self.failure)


def each[S, T](scenes: Mapping[str, S], of: Callable[[S], T]) -> tuple[dict[str, T], dict[str, str]]:
    """Call the function ``of`` for each of ``scenes``. Return the results by name, and the messages of InputErrors by name."""
    found, missing = dict[str, T](), dict[str, str]()
    for name, scene in scenes.items():
        try:
            found[name] = of(scene)
        except InputError as error:
            log.info("%s is left out: %s", name, error)
            missing[name] = str(error)
    return found, missing


def carry_out(trials: Sequence[Trial], store: Path, workers: Workers) -> tuple[Made, ...]:
    """The runs of all ``trials`` in their order, read from the ``store`` or solved now."""
    if workers.count > 1 or workers.address is not None:
        return _in_parallel(trials, store.absolute(), workers)
    made = []
    for i, trial in enumerate(trials):
        log.info("run %d of %d: %s", i + 1, len(trials), trial.label)
        made.append(_made(trial, store))
    return tuple(made)


def spread[S, T](of: Callable[[S], T], items: Sequence[S], workers: Workers) -> list[T]:
    """The results of the function ``of`` for all ``items``, in their order, computed by ``workers``."""
    if workers == Workers():
        return [of(item) for item in items]
    with _executor(workers) as executor:
        return list(executor.map(of, items))


def solve(trial: Trial, store: Path) -> Run:
    """The run of a trial, from the ``store`` or solved in this process. A failed run that would fail again is not repeated."""
    bench = shared_bench(trial.scene, store)
    folder = bench.folder(trial.choice, trial.name)
    if runs.status(folder) in _LASTING:
        return _loaded(folder, trial)
    return bench.obtain(trial.name, without_states(trial.choice), trial.name)


def shared_bench(case: MuscleCase, store: Path) -> Bench[MuscleCase]:
    """The bench, and with it the mesh, that all runs on a case share in this process. The process keeps the last two benches."""
    key = case.key, store, case.folder
    if key not in _BENCHES:
        for old in list(_BENCHES)[:-1]:
            del _BENCHES[old]
        _BENCHES[key] = Bench(case, store, ranks=1)
    return _BENCHES[key]


def _made(trial: Trial, store: Path) -> Made:
    """Solve a trial. Invalid input or missing software ends only this trial."""
    try:
        return Made(trial, solve(trial, store))
    except (InputError, MissingSoftware) as error:
        return Made(trial, None, str(error).replace(f"{trial.scene.folder}{os.sep}", ""))


def _in_parallel(trials: Sequence[Trial], store: Path, workers: Workers) -> tuple[Made, ...]:
    made, begin, count = dict[int, Made](), time.perf_counter(), len(trials)
    for attempt in range(ATTEMPTS):
        wanted = [i for i in range(count) if i not in made]
        if wanted and attempt:
            log.info("a worker died; %d runs are tried again", len(wanted))
        try:
            with _executor(workers) as executor:
                futures = {executor.submit(_by_worker, trials[i], store): i for i in wanted}
                for future in as_completed(futures):
                    i = futures[future]
                    folder, failure = future.result()
                    made[i] = Made(trials[i], _loaded(folder, trials[i]) if folder else None, failure)
                    seconds = (time.perf_counter() - begin) / len(made) * (count - len(made))
                    left = f", about {seconds:.0f} s left" if len(made) < count else ""
                    status = failure or made[i].ended[0]
                    log.info("run %d of %d: %s: %s%s", len(made), count, trials[i].label, status, left)
        except BrokenProcessPool:
            continue
        break
    lost = f"its worker died {ATTEMPTS} times"
    return tuple(made.get(i, Made(trial, None, lost)) for i, trial in enumerate(trials))


def _by_worker(trial: Trial, store: Path) -> tuple[Path | None, str]:
    """Solve a trial in a worker. Return the folder of the run, from which the main process reads it, and the reason if there is no
    run.
    """
    found = _made(trial, store)
    return found.run.folder if found.run else None, found.failure


def _loaded(folder: Path, trial: Trial) -> Run:
    return replace(runs.load(folder), name=trial.name)


@contextmanager
def _executor(workers: Workers) -> Iterator[Executor]:
    """Processes on this machine, or the workers of a Dask scheduler, which gives the run of a dead worker to another worker."""
    if workers.address is None:
        # Processes are spawned, because numba, PETSc and locks do not survive a fork.
        before = set(multiprocessing.active_children())
        with ProcessPoolExecutor(workers.count, mp_context=multiprocessing.get_context("spawn")) as executor:
            try:
                yield executor
            except BaseException:  # including an interruption: otherwise the executor would wait for runs in progress
                for worker in set(multiprocessing.active_children()) - before:
                    worker.terminate()
                raise
        return
    try:
        from distributed import Client
    except ImportError as error:
        raise MissingSoftware("Dask is not installed: pip install 'fem_reference[cluster]'") from error
    with Client(workers.address) as client:
        yield client.get_executor(retries=ATTEMPTS)
