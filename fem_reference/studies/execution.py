"""A case and a choice of solver -> a run: from the store where it was solved before, else solved now and stored."""

import logging
import math
import os
import platform
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, singledispatch
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import second_check
from fem_reference.foundations.records import Record, join
from fem_reference.foundations.usage import forget_peak_memory, peak_memory
from fem_reference.foundations.version import __version__
from fem_reference.problems import of_case
from fem_reference.problems.muscle import Problem, Setup
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs import cut_off, states, store
from fem_reference.runs.fields import VALUES, NodalField
from fem_reference.runs.key import code_hash, key, versions
from fem_reference.runs.store import Frame, Outcome, Run
from fem_reference.scenes.case import MACHINE_ONLY, Case, SolverChoice
from fem_reference.solvers import recorded
from fem_reference.solvers.common.protocol import MuscleSolver
from fem_reference.studies import expected_cost, run_folders, watched

log = logging.getLogger(__name__)


class Bench[C: Case]:
    """A case with what is made from it once and only when needed: its setup, its problem, and where its runs are stored."""

    def __init__(self, scene: C, store: Path, ranks: int | None = None) -> None:
        self.setup: Callable[[], Any] = cache(lambda: of_case.setup(scene))
        self.scene, self.store, self.ranks = of_case.chosen(scene, self.setup), store, ranks
        self.problem: Callable[[], Any] = cache(lambda: of_case.problem(self.scene, self.setup()))
        self.watch: Callable[[], Any] = cache(lambda: of_case.watch(self.scene, self.setup(), self.problem))

    def settings(self, choice: SolverChoice, place: str) -> Record:
        """The settings of ``choice``, checked; a folder that the scene names is found as its files are, and only there."""
        folder, named = choice.settings.get("folder"), choice in (self.scene.reference, *self.scene.candidate)
        if isinstance(folder, str) and (named or not Path(folder).is_absolute()):
            choice = choice.model_copy(update={"folder": str(self.scene.file(folder, f"{place}.folder"))})
        where, task = join(self.scene.place, place), self.scene.task
        settings = solvers.settings(choice, where, task)
        if self.ranks is not None and choice.solver == "fenicsx" and "ranks" in type(settings).model_fields:
            settings = solvers.settings(choice.model_copy(update={"ranks": self.ranks}), where, task)
        solvers.check(choice.solver, settings, self.scene.effects, where, task)
        return settings

    def check(self, chosen: Sequence[tuple[SolverChoice, str]] = ()) -> None:
        """InputError where settings of the reference, of a candidate of the case (but frames that are only made later) or of what
        is ``chosen`` do not suit the case. What is made of it is looked at where there is something to solve.
        """
        named = [(one, f"candidate[{i}]") for i, one in enumerate(self.scene.candidate) if one.solver != "recorded"]
        wanted = [(self.scene.reference, "reference"), *chosen]
        settings = [(one, place, self.settings(one, place)) for one, place in [*wanted, *named]]
        solved = [(one, place) for one, place in wanted if one.solver != "recorded"]
        if all(store.finished(self.folder(*one), self._ended(one[0].solver)) for one in solved):
            return
        for one, place, own in settings:
            offer = solvers.find(one.solver, place, self.scene.task)
            if offer.check_problem:
                offer.check_problem(own, self.made_for(one.solver, own), join(self.scene.place, place))

    def obtain(self, name: str, choice: SolverChoice, place: str) -> Run:
        """The run of a solver of our own, by the name that pages give it; ``place`` is where the scene chooses it."""
        if choice.solver == "recorded":  # files may change behind a name; they are read anew each time
            return self.read(name, choice, place)
        settings, folder = self.settings(choice, place), self.folder(choice, place)
        ended = self._ended(choice.solver)
        if (stored := _stored(folder, name, ended, settings)) is not None:
            return self._with_all_that_matters(self._checked(stored), choice, place)
        solvers.require(choice.solver, settings, place, self.scene.task)
        if choice == self.scene.reference:
            self.check()
        built = self.made_for(choice.solver, settings)  # what is wrong with the input shows before anything is written
        takes = expected_cost.seconds(choice.solver, built, settings)
        long = "" if takes is None else f", about {takes:.2g} s of processor time"
        log.info("%s: no stored run of it in %s; solving%s", name, folder.parent.resolve(), long)
        with run_folders.locked(folder), run_folders.bars_kept(folder):
            run = _stored(folder, name, ended, settings) or self._solve(name, choice.solver, settings, folder)
            run = self._checked(run)
        return self._with_all_that_matters(run, choice, place)

    def _ended(self, solver: str) -> tuple[str, ...]:
        """Statuses of stored runs that are taken again."""
        return ("converged", "denied", *(("stopped",) if self._watches(solver) else ()))

    def known(self, name: str, choice: SolverChoice, place: str) -> Run | None:
        """The stored run that ``obtain`` takes up, None where it would solve one."""
        shelf = _Shelf(self.scene, self.store, self.ranks)
        shelf.setup = self.setup
        with suppress(_UnsolvedError):
            return shelf.obtain(name, choice, place)
        return None

    def _checked(self, run: Run) -> Run:
        """The ``run``; that of a muscle by a solver of effects with the second check of it, which is stored with it."""
        asked = self.scene.task == "solve" and solvers.takes_effects(run.solver)
        if not asked or run.outcome.status not in ("converged", "denied"):
            return run
        return second_check.confirmed_run(self.problem, run)

    def _watches(self, solver: str) -> bool:
        """Whether the case left effects out that may turn out to matter."""
        return solvers.takes_effects(solver) and self.watch() is not None

    def _with_all_that_matters(self, run: Run, choice: SolverChoice, place: str) -> Run:
        """The ``run``; where an effect that the case left out turns out to matter in it, one with that effect, which goes on from
        what is kept of a run that was stopped for it.
        """
        if not self._watches(choice.solver) or run.origin.get("watched") == self.watch().names:
            return run
        found = watched.again(self.watch(), run)
        if not found:
            return run
        self.scene = of_case.with_effects(self.scene, found)
        self.problem.cache_clear()  # type: ignore[attr-defined]
        self.watch.cache_clear()  # type: ignore[attr-defined]
        assert run.folder is not None  # from the store
        folder = self.folder(choice, place)
        with run_folders.locked(folder):
            cut_off.pass_on(run.folder, folder)
        return self.obtain(run.name, choice, place)

    def folder(self, choice: SolverChoice, place: str) -> Path:
        """Where the run of a solver of our own is stored, once there is one."""
        return self.store / f"{choice.solver}-{self.key(choice.solver, self.settings(choice, place))}"

    def _solve(self, name: str, solver: str, settings: Record, folder: Path) -> Run:
        origin, numbers = self.origin(solver, settings), self.scene.numbers
        identity = {"name": name, "solver": solver, "origin": origin, "frames": numbers}
        _solved(
            self.made_for(solver, settings),
            solvers.find(solver, self.scene.place, self.scene.task),
            settings,
            folder,
            identity,
            self.watch() if self._watches(solver) else None,
        )
        return store.load(folder)

    def made_for(self, solver: str, settings: Record) -> Any:
        """What the solver needs: the problem, or the setup of a muscle that it does not need filled."""
        offer = solvers.find(solver, self.scene.place, self.scene.task)
        return self.setup() if isinstance(offer, MuscleSolver) and not offer.fills(settings) else self.problem()

    def read(self, name: str, choice: SolverChoice, place: str) -> Run:
        """The run that somebody recorded, checked against the setup of the scene; it is read each time and not stored."""
        settings, frames, rest = self.settings(choice, place), list[Frame](), self.setup()
        assert isinstance(settings, recorded.RecordedSettings)
        outcome = recorded.solve(rest, settings, frames.append)
        positions = np.stack([frame.surface for frame in frames if frame.surface is not None])
        numbers = tuple(frame.number for frame in frames)
        origin = self.origin(choice.solver, settings) | recorded.origin(settings)
        return Run(name, choice.solver, outcome, numbers, rest.surface, positions, origin=origin)

    def key(self, solver: str, settings: Record) -> str:
        """The key of a run: a hash over all that determines it."""
        numerics = {name: value for name, value in settings.model_dump(mode="json").items() if name not in MACHINE_ONLY}
        return key(self.scene.key, solver, numerics)

    def origin(self, solver: str, settings: Record) -> dict[str, Any]:
        """Where a run comes from, for people and for doubt."""
        acting = self.scene.acting if self.scene.task != "solve" or solvers.takes_effects(solver) else {}
        return {
            "case": self.scene.name,
            "scene": self.scene.key,
            "solver": solver,
            "settings": settings.model_dump(mode="json"),
            "effects": {title: effect.model_dump(mode="json") for title, effect in acting.items()} or "none",
            **({"effects_chosen": [str(one) for one in self.scene.decisions]} if self.scene.decisions else {}),
            "fem_reference": __version__,
            "code": code_hash(solver),
            "versions": versions(),
            "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        }


class _UnsolvedError(Exception):
    """A run is not there yet."""


class _Shelf(Bench[Any]):
    """A bench that takes up what is stored, and solves nothing."""

    def made_for(self, solver: str, settings: Record) -> Any:
        """Nothing: what would be solved is not there."""
        raise _UnsolvedError(f"{solver}-{self.key(solver, settings)}")


@singledispatch
def _solved(built: object, solver: Any, settings: Record, folder: Path, identity: dict[str, Any], watch: Any) -> None:  # noqa: ARG001
    """Solve what was ``built`` of a case, and write the run into ``folder`` as it goes; ``watch`` sees each frame of a muscle, and
    may stop it.
    """
    raise TypeError(f"{type(built).__name__} is no problem of a case")


@_solved.register
def _(built: Problem, solver: Any, settings: Record, folder: Path, identity: dict[str, Any], watch: Any) -> None:
    identity["origin"]["mesh"] = built.mesh_facts
    writer = store.Writer(folder, identity, built.surface, built.fibres, built.mesh, built.directions)
    _write(writer, built, solver, settings, Frame(built.frames[0], built.surface.points, built.fibres.points), watch)


@_solved.register
def _(built: Setup, solver: Any, settings: Record, folder: Path, identity: dict[str, Any], watch: Any) -> None:
    writer = store.Writer(folder, identity, built.surface)
    _write(writer, built, solver, settings, Frame(built.frames[0], built.surface.points), watch)


def _write(writer: store.Writer, built: Setup, solver: Any, settings: Record, rest: Frame, watch: Any) -> None:
    """The run of a muscle, with what it cost; of one that failed before its first frame that frame, which is ``rest``."""

    def add(frame: Frame) -> None:
        writer.add(frame)
        if watch is not None:
            watched.see(watch, frame)

    if watch is not None:
        watched.begin(watch, writer)
    forget_peak_memory()
    began = time.process_time()
    go_on = solver.go_on
    try:
        outcome = go_on(built, settings, add, writer.cut_off) if go_on else solver.solve(built, settings, add)
        if watch is not None and outcome.status == "converged":
            watched.end(watch)
    except watched.StoppedError as why:
        outcome = Outcome("stopped", str(why))
    processor, cost = time.process_time() - began, outcome.cost
    if "seconds_compile" in cost:  # which does not count: what is left takes no more processor time than time
        processor = min(processor, cost.get("seconds_setup", 0.0) + cost.get("seconds_solve", math.inf))
    used = {"seconds_processor": processor, "peak_memory_mb": peak_memory()}
    outcome = replace(outcome, cost=used | outcome.cost)  # a solver with processes of its own says what those used
    if not writer.frames:
        writer.add(rest)
    names = {"watched": watch.names} if watch is not None and outcome.status == "converged" else {}
    writer.close(outcome, **_contact(writer.state), **names)


def _contact(state: dict[str, Any]) -> dict[str, str]:
    """Where contact was in the equations, of a run whose ``state`` says it."""
    counts = state["scalars"].get("contact_points")
    if counts is None:
        return {}
    pressed = [number for number, count in zip(state["numbers"], counts, strict=True) if count]
    return {"contact": f"pressed first at frame {pressed[0]}" if pressed else "nothing was pressed at any frame"}


@_solved.register
def _(built: FieldProblem, solver: Any, settings: Record, folder: Path, identity: dict[str, Any], watch: Any) -> None:  # noqa: ARG001
    identity["origin"]["mesh"] = built.mesh_facts
    writer = store.Writer(folder, identity)
    solution = solver.solve_field(built, settings)
    components = {} if solution.components is None else {"components": solution.components}
    (number,) = identity["frames"]
    writer.add(Frame(number, field=NodalField(built.mesh, {VALUES: solution.values} | components)))
    writer.close(solution.outcome, form=solution.form or built.form)


def _stored(folder: Path, name: str, ended: tuple[str, ...], settings: Record) -> Run | None:
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
