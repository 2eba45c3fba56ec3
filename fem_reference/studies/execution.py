"""A scene and a choice of solver -> a run: from the store where it was solved before, else solved now and stored."""

import logging
import os
import platform
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout

from fem_reference import __version__, solvers
from fem_reference.foundations.records import Record
from fem_reference.problems import muscle
from fem_reference.problems.muscle import Problem, Setup
from fem_reference.runs import store
from fem_reference.runs.key import code_hash, key, versions
from fem_reference.runs.store import Frame, Run
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase

log = logging.getLogger(__name__)

_MACHINE_ONLY = {
    "ranks",
    "time_limit",
    "linear_solver",
    "precision",
}  # settings that change the time and not the answer


class Bench:
    """A scene with what is made from it once and only when needed: its setup, its problem, and where its runs are stored."""

    def __init__(self, scene: MuscleCase, store: Path, ranks: int | None = None) -> None:
        self.scene, self.store, self.ranks = scene, store, ranks
        self.setup: Callable[[], Setup] = cache(lambda: muscle.setup(scene))
        self.problem: Callable[[], Problem] = cache(lambda: _build(scene, self.setup()))

    def settings(self, choice: SolverChoice, place: str) -> Record:
        """The settings of ``choice``, checked; a folder among them is found as files of the scene are."""
        if isinstance(folder := choice.settings.get("folder"), str):
            choice = choice.model_copy(update={"folder": str(self.scene.file(folder, f"{place}.folder"))})
        if self.ranks is not None and choice.solver == "fenicsx":
            choice = choice.model_copy(update={"ranks": self.ranks})
        where = f"{self.scene.place}: {place}"
        settings = solvers.settings(choice, where)
        solvers.check(choice.solver, settings, self.scene.effects, where)
        return settings

    def obtain(self, name: str, choice: SolverChoice, place: str) -> Run:
        """The run of a solver of our own, by the name that pages give it; ``place`` is where the scene chooses it."""
        if choice.solver == "recorded":  # files may change behind a name; they are read anew each time
            return self.read(name, choice, place)
        settings = self.settings(choice, place)
        folder = self.store / f"{choice.solver}-{self.key(choice.solver, settings)}"
        if (stored := _stored(folder, name)) is not None:
            return stored
        solvers.require(choice.solver, settings, place)
        self.problem()  # what is wrong with the input shows before anything is written
        with _alone(folder):
            return _stored(folder, name) or self._solve(name, choice.solver, settings, folder)

    def _solve(self, name: str, solver: str, settings: Record, folder: Path) -> Run:
        built = self.problem()
        origin = self.origin(solver, settings) | {"mesh": built.mesh_facts}
        identity = {"name": name, "solver": solver, "origin": origin, "frames": built.frames}
        writer = store.Writer(folder, identity, built.surface, built.fibres, built.mesh, built.directions)
        outcome = solvers.find(solver, self.scene.place).solve(built, settings, writer.add)
        if not writer.frames:  # it failed before its first frame, which is rest
            writer.add(Frame(built.frames[0], built.surface.points, built.fibres.points))
        writer.close(outcome)
        return store.load(folder)

    def read(self, name: str, choice: SolverChoice, place: str) -> Run:
        """The run that somebody recorded, checked against the setup of the scene; it is read each time and not stored."""
        settings, frames, rest = self.settings(choice, place), list[Frame](), self.setup()
        solver = solvers.find(choice.solver, place)
        outcome = solver.solve(rest, settings, frames.append)
        positions = np.stack([frame.surface for frame in frames if frame.surface is not None])
        numbers = tuple(frame.number for frame in frames)
        origin = self.origin(choice.solver, settings) | solver.origin(settings)
        return Run(name, choice.solver, outcome, numbers, rest.surface, positions, origin=origin)

    def key(self, solver: str, settings: Record) -> str:
        """The key of a run: a hash over all that determines it."""
        numerics = {
            name: value for name, value in settings.model_dump(mode="json").items() if name not in _MACHINE_ONLY
        }
        return key(self.scene.key, solver, numerics)

    def origin(self, solver: str, settings: Record) -> dict[str, Any]:
        """Where a run comes from, for people and for doubt."""
        acting = self.scene.effects if solvers.takes_effects(solver) else ()
        return {
            "case": self.scene.name,
            "scene": self.scene.key,
            "solver": solver,
            "settings": settings.model_dump(mode="json"),
            "effects": {effect.title: effect.model_dump(mode="json") for effect in acting} or "none",
            "fem_reference": __version__,
            "code": code_hash(solver),
            "versions": versions(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        }


@contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Nobody else makes the run in ``folder`` meanwhile: whoever comes second waits, and then finds it made."""
    folder.parent.mkdir(parents=True, exist_ok=True)
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


def _build(scene: MuscleCase, setup: Setup) -> Problem:
    size = scene.muscle.tet_size / 2**scene.muscle.refinements
    log.info("%s: filling the muscle with tetrahedra of %g mm", scene.name, size)
    built = muscle.build(scene, setup)
    facts = built.mesh_facts
    log.info("%s: %d tetrahedra, quality at least %.2f", scene.name, facts["tets"], facts["quality_min"])
    return built


def _stored(folder: Path, name: str) -> Run | None:
    """The finished run in ``folder`` under the name that it has here; None where there is none, or other packages made it."""
    run = store.finished(folder)
    if run is None:
        return None
    now, then = versions(), run.origin["versions"]
    other = [package for package in now if package in then and now[package] != then[package] and package != "python"]
    if other:
        log.info("%s: solved before, but with another %s; solving again", name, other[0])
        return None
    log.info("%s: solved before, taken from %s", name, folder)
    return replace(run, name=name)


def complete(run: Run, numbers: tuple[int, ...]) -> Run:
    """The run over exactly the frames ``numbers``; frames that it did not reach are not-a-number, so they never pass."""
    if run.numbers == numbers:
        return run
    rows = [run.numbers.index(number) if number in run.numbers else None for number in numbers]

    def pick(values: Any) -> Any:
        if values is None:
            return None
        blank = np.full(values.shape[1:], np.nan)
        return np.stack([blank if row is None else values[row] for row in rows])

    return replace(
        run,
        numbers=numbers,
        positions=pick(run.positions),
        fibre_positions=pick(run.fibre_positions),
        scalars={name: pick(values) for name, values in run.scalars.items()},
    )
