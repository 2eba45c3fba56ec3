"""A scene and a choice of solver -> a run: from the store where it was solved before, else solved now and stored."""

import fcntl
import hashlib
import importlib.metadata
import json
import logging
import os
import platform
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import __version__, problem, runs, solvers
from fem_reference.problem import Problem, Setup
from fem_reference.records import Record
from fem_reference.runs import Frame, Run
from fem_reference.scene import Scene, SolverChoice

log = logging.getLogger(__name__)

# What happens after a run is solved does not change the run.
_AFTER_THE_RUN = (
    "metrics",
    "report",
    "results.py",
    "study.py",
    "judge.py",
    "ranking.py",
    "claims.py",
    "true_errors.py",
    "comparison.py",
    "catalogue.py",
    "truths.py",
    "verification",
    "overview.py",
    "cli",
    "exchange",
    "regression",
    "benchmark",
    "families.py",
    "standings.py",
    "__main__.py",
    "execution.py",
    "refinement.py",
    "field_execution.py",
    "field_verbs.py",
)
_MACHINE_ONLY = {
    "ranks",
    "time_limit",
    "linear_solver",
    "precision",
}  # settings that change the time and not the answer


class Bench:
    """A scene with what is made from it once and only when needed: its setup, its problem, and where its runs are stored."""

    def __init__(self, scene: Scene, store: Path, ranks: int | None = None) -> None:
        self.scene, self.store, self.ranks = scene, store / scene.name, ranks
        self.setup: Callable[[], Setup] = cache(lambda: problem.setup(scene))
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
        folder = self.store / f"{choice.solver}-{self.key(choice.solver, settings)[:16]}"
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
        writer = runs.Writer(folder, identity, built.surface, built.fibres, built.mesh, built.directions)
        outcome = solvers.find(solver, self.scene.place).solve(built, settings, writer.add)
        if not writer.frames:  # it failed before its first frame, which is rest
            writer.add(Frame(built.frames[0], built.surface.points, built.fibres.points))
        writer.close(outcome)
        return runs.load(folder)

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
        """A hash over all that determines a run: the scene, the solver's settings, and the code that makes runs."""
        numerics = {key: value for key, value in settings.model_dump(mode="json").items() if key not in _MACHINE_ONLY}
        parts = [self.scene.key, solver, json.dumps(numerics, sort_keys=True), code_hash(solver)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()

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
    with (folder.parent / f".{folder.name}.lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            log.info("%s: another process is making this run; waiting for it", folder)
            fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def _build(scene: Scene, setup: Setup) -> Problem:
    size = scene.muscle.tet_size / 2**scene.muscle.refinements
    log.info("%s: filling the muscle with tetrahedra of %g mm", scene.name, size)
    built = problem.build(scene, setup)
    facts = built.mesh_facts
    log.info("%s: %d tetrahedra, quality at least %.2f", scene.name, facts["tets"], facts["quality_min"])
    return built


def _stored(folder: Path, name: str) -> Run | None:
    """The finished run in ``folder`` under the name that it has here; None where there is none, or other packages made it."""
    run = runs.finished(folder)
    if run is None:
        return None
    now, then = versions(), run.origin["versions"]
    other = [package for package in now if package in then and now[package] != then[package] and package != "python"]
    if other:
        log.info("%s: solved before, but with another %s; solving again", name, other[0])
        return None
    log.info("%s: solved before, taken from %s", name, folder)
    return replace(run, name=name)


@cache
def code_hash(solver: str) -> str:
    """A hash over the source files that determine the runs of ``solver``: those of other solvers do not."""
    root = Path(__file__).parent
    others = {
        path for path in (root / "solvers").rglob("*.py") if path.name != "__init__.py" or path.parent.name != "solvers"
    }
    digest = hashlib.sha256()
    for path in sorted({*root.rglob("*.py")} - others | _files(root / "solvers", solver)):
        if path.relative_to(root).parts[0] not in _AFTER_THE_RUN:
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _files(folder: Path, solver: str) -> set[Path]:
    """The source files of a solver and of what it imports from the others below ``folder``."""
    found, wanted = set[str](), {solver}
    files = set[Path]()
    while wanted:
        found |= wanted
        own = {
            path
            for name in wanted
            for path in [folder / f"{name}.py", *(folder / name).rglob("*.py")]
            if path.is_file()
        }
        files |= own
        text = "\n".join(path.read_text(encoding="utf-8") for path in own)
        names = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
        wanted = {name for name in names - found if re.search(rf"solvers(\.| import .*\b){name}\b", text)}
    return files


def versions() -> dict[str, str]:
    """The versions of the packages that a run may depend on, and of Python."""
    wanted = (
        "numpy",
        "scipy",
        "gmsh",
        "libigl",
        "pytetwild",
        "scikit-fem",
        "numba",
        "dolfinx-solver-real",
        "fenics-dolfinx",
    )
    found = {"python": platform.python_version()}
    for package in wanted:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


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
