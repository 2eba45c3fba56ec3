"""Solvers: the calls that they answer, and the records with which their files offer these."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Protocol

from fem_reference.effects import Effect
from fem_reference.foundations.records import Record
from fem_reference.problems.body import Body
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.problem import Task
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.cut_off import CutOff
from fem_reference.runs.store import Frame, Outcome, Run, Sink, collected

Moves = Literal["surface", "tetrahedra", "lines", "nothing"]


class Solve[P, S: Record](Protocol):
    """Solves problems of a kind."""

    def __call__(self, problem: P, settings: S, sink: Sink, /) -> Outcome:
        """Sink every requested frame as it is reached. Physics that fails is a status with a sentence and never an exception;
        what was reached before stays. A scalar field is one frame, not-a-number where the status says that it failed.
        """


class GoOn[P, S: Record](Protocol):
    """Solves problems from where a run was cut off."""

    def __call__(self, problem: P, settings: S, sink: Sink, cut_off: CutOff, /) -> Outcome:
        """Solve as ``Solve`` does, from the last stored frame that the solver kept enough of, which need not be the last of all,
        else from the first; it ends as the run would have ended.
        """


class CheckEffects[S: Record](Protocol):
    """Checks settings against effects."""

    def __call__(self, settings: S, effects: tuple[Effect, ...], place: str, /) -> None:
        """InputError below ``place`` where the settings do not suit the effects of a scene."""


class CheckProblem[S: Record](Protocol):
    """Checks settings against what is made of a case."""

    def __call__(self, settings: S, problem: Any, place: str, /) -> None:
        """InputError below ``place`` where the settings do not suit the bones, attachments, fibres or boundary of a case."""


def _nothing(_: Record) -> None:
    """Nothing but what this package needs itself."""


def _none(_: Record) -> bool:
    """No fibres."""
    return False


@dataclass(frozen=True, kw_only=True)
class Solver[P, S: Record]:
    """An offer of a solver's file for one task: ``solve``.

    ``settings``: the record of its own settings. ``example``: some of them, as scene files write them, which contract tests solve
    with. ``require``: MissingSoftware where what it needs under such settings is not installed. ``check_problem`` of one whose
    settings speak of what a case has. ``slow``: it takes more than a few seconds on a small problem. ``go_on`` of one
    that takes long: any other begins again from rest.
    """

    task: ClassVar[Task]
    solves: ClassVar[str]

    settings: type[S]
    solve: Solve[P, S]
    example: Mapping[str, Any]
    require: Callable[[S], None] = _nothing
    check_problem: CheckProblem[S] | None = None
    slow: bool = False
    go_on: GoOn[P, S] | None = None

    def fills(self, settings: S) -> bool:  # noqa: ARG002
        """True where it needs the problem meshed."""
        return True

    def run(self, problem: P, settings: S) -> Run:
        """The run of a problem, in memory."""
        return solved(self.solve, problem, settings)


@dataclass(frozen=True, kw_only=True)
class MuscleSolver[S: Record](Solver[MuscleProblem, S]):
    """A solver of muscles; ``moves``: what carries its unknowns, whose mesh its accuracy and cost depend on;
    ``check_effects`` of one that simulates the effects of a scene, None of one that does not; ``fibres``: whether one of surfaces
    needs the fibres under such settings: without them it is given a ``Setup``, as the muscle is not filled for it.
    """

    task = "solve"
    solves = "muscles"

    moves: Moves = "surface"
    check_effects: CheckEffects[S] | None = None
    fibres: Callable[[S], bool] = _none

    def fills(self, settings: S) -> bool:
        """True where it needs the muscle filled with tetrahedra and fibres."""
        return self.moves not in ("surface", "nothing") or self.fibres(settings)


@dataclass(frozen=True, kw_only=True)
class FieldSolver[S: Record](Solver[FieldProblem, S]):
    """A solver of scalar fields."""

    task = "solve_field"
    solves = "scalar fields"


@dataclass(frozen=True, kw_only=True)
class BodySolver[S: Record](Solver[Body, S]):
    """A solver of bodies of any shape."""

    task = "solve_body"
    solves = "finite element bodies"


AnySolver = Solver[Any, Any]


def solved[P, S: Record](solve: Solve[P, S], problem: P, settings: S) -> Run:
    """The run of a problem, in memory."""
    frames: list[Frame] = []
    outcome = solve(problem, settings, frames.append)
    return collected(frames, outcome)


@dataclass(frozen=True)
class Trade:
    """Marks a key of settings that buys accuracy with time: a ``ladder`` of values worth a look, as scene files write them, from
    the fastest to the most accurate. Some may be refused: elements for other cells or other effects.
    """

    ladder: tuple[float | str, ...]


def trades(settings: type[Record]) -> dict[str, tuple[float | str, ...]]:
    """The keys of ``settings`` that buy accuracy with time, each with its ladder."""
    return {
        key: entry.ladder
        for key, field in settings.model_fields.items()
        for entry in field.metadata
        if isinstance(entry, Trade)
    }
