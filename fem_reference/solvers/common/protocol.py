"""Solver protocol: the functions of solvers, and the records in which their files offer them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, NamedTuple

from fem_reference.effects import Effect
from fem_reference.foundations.records import Record
from fem_reference.problems.body import Body
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.problem import Task
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Frame, Outcome, Run, Sink, collected
from fem_reference.runs.writer import CutOff

Moves = Literal["surface", "tetrahedra", "lines", "nothing"]


# Solves a problem of one type and passes every requested frame to a sink as it is reached. A physical failure is a status with a
# sentence, never an exception; earlier frames remain. A scalar field is one frame, NaN if the status is a failure.
type Solve[P, S: Record] = Callable[[P, S, Sink], Outcome]
# Continues a run that was cut off, from the last stored frame with a complete state, else from the first frame; ends as the
# uninterrupted run would have ended.
type GoOn[P, S: Record] = Callable[[P, S, Sink, CutOff], Outcome]
# Raises InputError, with a key below a given place, if the settings do not suit the effects of a scene.
type CheckEffects[S: Record] = Callable[[S, tuple[Effect, ...], str], None]
# Raises InputError, with a key below a given place, if settings do not suit bones, attachments, fibres or boundary of a case.
type CheckProblem[S: Record] = Callable[[S, Any, str], None]


class TableRow(NamedTuple):
    """A row of the page table-5-1: its ``name``, its ``kind`` in the report's table, and the ``settings`` for every scene."""

    kind: str
    name: str
    settings: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Solver[P, S: Record]:
    """The record in which a solver's file offers ``solve`` for one task.

    ``settings``: the record of its settings. ``example``: some of them, as scene files write them, for contract tests.
    ``require``: raises MissingSoftware or InputError if software for the settings is missing. ``check_problem``: for settings that
    refer to the contents of a case. ``slow``: True if it takes more than a few seconds on a small problem. ``go_on``: for slow
    solvers, continues a run; all others begin again from rest. ``table``: its rows of the page table-5-1.
    """

    task: ClassVar[Task]
    solves: ClassVar[str]

    settings: type[S]
    solve: Solve[P, S]
    example: Mapping[str, Any]
    require: Callable[[S], None] = lambda _: None
    check_problem: CheckProblem[S] | None = None
    slow: bool = False
    table: tuple[TableRow, ...] = ()
    go_on: GoOn[P, S] | None = None

    def record(self, given: Mapping[str, Any], place: str) -> type[S]:  # noqa: ARG002
        """The type of the settings ``given`` at a ``place``: always the same, unless the given settings add keys."""
        return self.settings

    def fills(self, settings: S) -> bool:  # noqa: ARG002
        """True if the solver needs a meshed problem."""
        return True

    def run(self, problem: P, settings: S) -> Run:
        """The run of a problem, in memory."""
        frames: list[Frame] = []
        outcome = self.solve(problem, settings, frames.append)
        return collected(frames, outcome)


@dataclass(frozen=True, kw_only=True)
class MuscleSolver[S: Record](Solver[MuscleProblem, S]):
    """A solver of muscles. ``moves``: the carrier of its unknowns, whose mesh determines accuracy and cost; ``check_effects``: None
    unless it simulates the effects of a scene; ``fibres``: True if a surface solver with these settings needs fibres; otherwise it
    receives a ``Setup``, without tetrahedra in the muscle. ``depends_on``: the order of vertices or the size of the muscle, if the
    result depends on it.
    """

    task = "solve"
    solves = "muscles"

    moves: Moves = "surface"
    depends_on: tuple[Literal["order", "size"], ...] = ()
    check_effects: CheckEffects[S] | None = None
    fibres: Callable[[S], bool] = lambda _: False

    def moved(self, settings: S) -> Moves:  # noqa: ARG002
        """The carrier of the unknowns with these settings."""
        return self.moves

    def fills(self, settings: S) -> bool:
        """True if the solver needs the muscle filled with tetrahedra and fibres."""
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


@dataclass(frozen=True)
class Trade:
    """Marks a settings key that trades time for accuracy: a ``ladder`` of useful values, as scene files write them, from the
    fastest to the most accurate. Some values may be refused for a scene, such as elements for other cells or effects.
    """

    ladder: tuple[float | str, ...]


def trades(settings: type[Record]) -> dict[str, tuple[float | str, ...]]:
    """The keys of ``settings`` that trade time for accuracy, each with its ladder."""
    return {
        key: entry.ladder
        for key, field in settings.model_fields.items()
        for entry in field.metadata
        if isinstance(entry, Trade)
    }
