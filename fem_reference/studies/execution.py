"""Runs of a case by a solver: read from the store if they were solved before, otherwise solved now and stored."""

import logging
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import cast, overload

from fem_reference import solvers
from fem_reference.assessment import second_check
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join
from fem_reference.foundations.threads import made_once
from fem_reference.foundations.version import __version__
from fem_reference.problems import of_case
from fem_reference.problems.estimates import Decision
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem, MusclesSetup
from fem_reference.problems.of_case import CaseProblem, CaseSetup
from fem_reference.problems.setup import Setup
from fem_reference.problems.stresses import Watch
from fem_reference.runs import store
from fem_reference.runs.key import code_hash, key, machine, versions
from fem_reference.runs.store import Frame, Outcome, Run, Sink, collected
from fem_reference.runs.views import run_of
from fem_reference.runs.writer import Writer, pass_on
from fem_reference.scenes import casefile
from fem_reference.scenes.case import MACHINE_ONLY, Candidate, Case, SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase
from fem_reference.solvers import recorded
from fem_reference.solvers.common.protocol import AnySolver
from fem_reference.studies import making
from fem_reference.studies.features import expected
from fem_reference.studies.making import Wanted

log = logging.getLogger(__name__)


class Bench[C: Case]:
    """A case with its set-up, its problem and the store of its runs. Set-up and problem are made once, when first needed."""

    def __init__(self, scene: C, store: Path, ranks: int | None = None, time_limit: float = math.inf) -> None:
        self._setup: Callable[[], CaseSetup] = made_once(lambda: of_case.setup(scene))
        self._scene, self.store, self.ranks = of_case.chosen(scene, self._setup), store, ranks
        self.time_limit = time_limit  # the processor time [s] that a candidate may take
        self._begin()

    def _begin(self) -> None:
        """Reset the problem and the watch, which depend on the acting effects, so that both are made again when needed."""
        self._problem: Callable[[], CaseProblem] = made_once(lambda: of_case.problem(self.scene, self._setup()))
        # The watch for effects that the case left out but that turn out to matter; None if it left out none.
        self.watch: Callable[[], Watch | None] = cache(lambda: of_case.watch(self.scene, self._setup(), self._problem))

    @property
    def scene(self) -> C:
        """The case with its acting effects, including those that turned out to matter."""
        return self._scene

    @overload
    def setup(self: "Bench[MuscleCase]") -> Setup: ...
    @overload
    def setup(self) -> CaseSetup: ...
    def setup(self) -> CaseSetup:
        """The set-up of the case, before it is meshed."""
        return self._setup()

    @overload
    def problem(self: "Bench[MuscleCase]") -> MuscleProblem: ...
    @overload
    def problem(self) -> CaseProblem: ...
    def problem(self) -> CaseProblem:
        """The problem of the case, with its mesh."""
        return self._problem()

    def of_muscle(self) -> "Bench[MuscleCase]":
        """This bench, as the bench of a single muscle. Raises InputError if the case is not that of a single muscle."""
        casefile.muscle(self.scene)
        return cast("Bench[MuscleCase]", self)

    def found[S: SolverChoice](self, choice: S, place: str) -> S:
        """The ``choice`` with its setting ``folder``, if it has one, as a complete path.

        A relative folder, or one that the scene itself names, must be a folder that the scene may read. ``place``: the key of the
        choice in the scene.
        """
        folder, named = choice.settings.get("folder"), choice in (self.scene.reference, *self.scene.candidate)
        if not isinstance(folder, str) or not (named or not Path(folder).is_absolute()):
            return choice
        return choice.model_copy(update={"folder": str(self.scene.file(folder, f"{place}.folder"))})

    def settings(self, choice: SolverChoice, place: str) -> Record:
        """The settings of ``choice``, checked against the case; ``place`` is the key of the scene that chooses the solver."""
        choice = self.found(choice, place)
        where, task = join(self.scene.place, place), self.scene.task
        settings = solvers.settings(choice, where, task)
        if self.ranks is not None and choice.solver == "fenicsx" and "ranks" in type(settings).model_fields:
            settings = solvers.settings(choice.model_copy(update={"ranks": self.ranks}), where, task)
        solvers.check(choice.solver, settings, self.scene.effects, where, task)
        return settings

    @property
    def parts(self) -> "dict[str, Bench[MuscleCase]]":
        """The bench of each muscle of a case of several muscles, by name; empty for any other case."""
        scene = self.scene
        if not isinstance(scene, MusclesCase):
            return {}
        made = {
            one.name: Bench(part, self.store, self.ranks) for one, part in zip(scene.muscle, scene.parts, strict=True)
        }
        for name, bench in made.items():
            bench._setup = partial(lambda name: cast("MusclesSetup", self._setup()).muscles[name], name)
        return made

    def by_muscle(self, run: Run) -> dict[str, Run]:
        """The ``run`` of several muscles, split into one run for each muscle, by name."""
        problem, parts = self.problem(), self.parts
        assert isinstance(problem, MusclesProblem)
        found = {name: run_of(run, problem, name) for name in parts}
        return {name: replace(one, origin=one.origin | {"scene": parts[name].scene.key}) for name, one in found.items()}

    def check(self, chosen: Sequence[tuple[SolverChoice, str]] = ()) -> None:
        """Raise InputError if the settings of a solver do not suit the case.

        The settings of the reference, of the ``chosen`` solvers and of the candidates of the case are checked, except candidates
        with recorded frames, which may not exist yet. The recorded frames of chosen candidates are read, and the problem is
        checked, only if a run has to be solved.
        """
        if self.scene.parts:
            self.settings(self.scene.reference, "reference")
            for part in self.parts.values():
                part.check([one for one in chosen if one[0].solver != "recorded"])
            return
        named = [(one, f"candidate[{i}]") for i, one in enumerate(self.scene.candidate) if one.solver != "recorded"]
        wanted = [(self.scene.reference, "reference"), *chosen]
        settings = [(one, place, self.settings(one, place)) for one, place in [*wanted, *named]]
        solved = [(one, place) for one, place in wanted if one.solver != "recorded"]
        if all(store.finished(self.folder(*one), self._ended(one[0].solver)) for one in solved):
            return
        for one, place in wanted:
            if one.solver == "recorded":
                self.read(place, one, place)
        for one, place, own in settings:
            offer = solvers.find(one.solver, place, self.scene.task)
            if offer.check_problem:
                offer.check_problem(own, self.given(offer, own), join(self.scene.place, place))

    def obtain(self, name: str, choice: SolverChoice, place: str) -> Run:
        """The run of a solver, from the store or solved now.

        ``name``: the name of the run on pages; ``place``: the key of the scene that chooses the solver.
        """
        run = self._run(name, choice, place, self._made)
        assert run is not None  # a run that is not stored is solved
        return run

    def reference(self) -> Run:
        """The run of the case's reference."""
        return self.obtain("reference", self.scene.reference, "reference")

    def runs(self, chosen: Sequence[tuple[Candidate, str]]) -> tuple[Run, ...]:
        """The runs of the reference and of the ``chosen`` candidates. Each candidate comes with its key in the scene. Recorded
        frames are read before anything is solved.
        """
        read = {one.name: self.read(one.name, one, place) for one, place in chosen if one.solver == "recorded"}
        reference = self.reference()
        return (reference, *(read.get(one.name) or self.obtain(one.name, one, place) for one, place in chosen))

    def known(self, name: str, choice: SolverChoice, place: str) -> Run | None:
        """The stored run that ``obtain`` would reuse; None if ``obtain`` would solve."""
        other = Bench(self.scene, self.store, self.ranks)
        other._setup = self._setup
        return other._run(name, choice, place, lambda _: None)

    def _run(self, name: str, choice: SolverChoice, place: str, make: Callable[[Wanted], Run | None]) -> Run | None:
        """The stored run or, without one, the run from ``make``. It is repeated with all effects that turn out to matter."""
        if choice.solver == "recorded":  # read each time, as files may change under the same name
            return self.read(name, choice, place)
        offer = solvers.find(choice.solver, place, self.scene.task)
        while True:
            folder = self.folder(choice, place)
            wanted = Wanted(name, choice, offer, self.settings(choice, place), folder)
            run = self._stored(wanted) or make(wanted)
            found = () if run is None else self._turned_out(run)
            if run is None or not found:
                return run
            self._scene = of_case.with_effects(self.scene, found)
            self._begin()
            assert run.folder is not None  # it is in the store
            folder = self.folder(choice, place)
            with making.locked(folder):  # the new run continues the stopped one
                pass_on(run.folder, folder)

    def _stored(self, wanted: Wanted) -> Run | None:
        run = wanted.stored(self._ended(wanted.choice.solver))
        return None if run is None else self._checked(run)

    def _made(self, wanted: Wanted) -> Run:
        """Solve a run under a lock, so that only one process solves it; invalid input is reported before anything is written."""
        wanted.offer.require(wanted.settings)
        if self.scene.parts and wanted.choice.solver != "fenicsx":
            got = f'"{wanted.choice.solver}" for several muscles'
            raise InputError(
                join(self.scene.place, "solver"),
                got,
                "the reference; in compare, other solvers solve each muscle separately",
            )
        if wanted.choice == self.scene.reference:
            self.check()
        given = self.given(wanted.offer, wanted.settings)
        long = ""
        if wanted.choice.solver == "fenicsx" and given.body is not None:
            long = f", about {expected(given.body, wanted.settings).seconds:.2g} s of processor time"
        log.info("%s: no stored run in %s; solving%s", wanted.name, wanted.folder.parent.resolve(), long)
        with making.locked(wanted.folder), making.bars_kept(wanted.folder):
            return self._stored(wanted) or self._checked(self._solved(wanted, given))

    def _ended(self, solver: str) -> tuple[str, ...]:
        """The statuses with which a stored run is reused."""
        return ("converged", "denied", *(("stopped",) if self._watched(solver) else ()))

    def _checked(self, run: Run) -> Run:
        """The ``run``; with a second check, stored with the run, if the case has muscles and the solver models effects."""
        asked = self.scene.task == "solve" and solvers.takes_effects(run.solver)
        if not asked or run.outcome.status not in ("converged", "denied"):
            return run
        return second_check.confirmed_run(cast("Callable[[], MuscleProblem | MusclesProblem]", self.problem), run)

    def _watched(self, solver: str) -> Watch | None:
        """The watch for effects that the case left out and that may turn out to matter."""
        return self.watch() if solvers.takes_effects(solver) else None

    def _turned_out(self, run: Run) -> tuple[Decision, ...]:
        """Effects that the case left out but that matter in a stored ``run``: those at the first frame that reveals any."""
        watch = self._watched(run.solver)
        if watch is None or run.origin.get("watched") == watch.names:
            return ()
        assert run.folder is not None  # it is in the store
        return next(filter(None, making.seen(watch, run.folder, run.numbers)), ()) or watch.end()

    def _solved(self, wanted: Wanted, given: CaseSetup) -> Run:
        """Solve ``given`` (the problem or the set-up), and write the run into its folder frame by frame."""
        solver = wanted.choice.solver
        origin = self.origin(solver, wanted.settings)
        if wanted.offer.fills(wanted.settings):
            origin["mesh"] = self._problem().mesh_facts
        identity = {"name": wanted.name, "solver": solver, "origin": origin, "frames": self.scene.numbers}
        offer = wanted.offer
        keeps = offer.go_on is not None and not (given.body is not None and given.body.remembers)
        writer = Writer(wanted.folder, identity, given.rest, anew=not keeps)

        def solve(sink: Sink) -> Outcome:
            sofar = (given, wanted.settings, sink)
            return offer.go_on(*sofar, writer.cut_off) if offer.go_on and keeps else offer.solve(*sofar)

        limit = math.inf if wanted.choice == self.scene.reference else self.time_limit
        making.write(writer, solve, self._watched(solver), limit)
        return store.load(wanted.folder)

    def given(self, offer: AnySolver, settings: Record) -> CaseSetup:
        """The input of a solver: the problem or, for a solver without tetrahedra, the set-up of the muscle."""
        return cast("CaseSetup", self._problem()) if offer.fills(settings) else self._setup()

    def read(self, name: str, choice: SolverChoice, place: str) -> Run:
        """Read recorded frames as a run, and check them against the set-up of the scene; the run is never stored."""
        if self.scene.parts:
            raise InputError(place, "frames of several muscles", "frames of each muscle, in a folder with its name")
        wanted, frames = self.settings(choice, place), list[Frame]()
        assert isinstance(wanted, recorded.RecordedSettings)
        outcome = solvers.find(choice.solver, place, self.scene.task).solve(self._setup(), wanted, frames.append)
        origin = self.origin(choice.solver, wanted) | recorded.origin(wanted)
        run = collected(frames, outcome, self._setup().rest)
        return replace(run, name=name, solver=choice.solver, origin=origin, states=())

    def folder(self, choice: SolverChoice, place: str) -> Path:
        """The folder of a solver's stored run; the folder does not exist before the run is made."""
        return self.store / f"{choice.solver}-{self.key(choice.solver, self.settings(choice, place))}"

    def key(self, solver: str, settings: Record) -> str:
        """The key of a run: a hash of everything that determines its result."""
        numerics = {name: value for name, value in settings.model_dump(mode="json").items() if name not in MACHINE_ONLY}
        return key(self.scene.key, solver, numerics)

    def origin(self, solver: str, settings: Record) -> dict[str, object]:
        """Provenance of a run, with everything that is needed to reproduce it."""
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
            "machine": machine(),
        }
