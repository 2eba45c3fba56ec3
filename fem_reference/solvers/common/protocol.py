"""The solver protocol: the types of a solver's functions, and the records in which its file offers these functions."""

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


# Solves a problem and passes each requested frame to a sink as soon as it is reached. A physical failure is reported as a status
# with a sentence, never as an exception; earlier frames are kept. A scalar field is a single frame, which is NaN after a failure.
type Solve[P, S: Record] = Callable[[P, S, Sink], Outcome]
# Continues a run that was cut off, from the last stored frame with a complete state, otherwise from the first frame. The result is
# that of an uninterrupted run.
type GoOn[P, S: Record] = Callable[[P, S, Sink, CutOff], Outcome]
# Raises InputError, with a key inside a given place, if the settings do not suit the effects of a scene.
type CheckEffects[S: Record] = Callable[[S, tuple[Effect, ...], str], None]
# Raises InputError, with a key inside a given place, if settings do not suit the bones, attachments, fibres or boundary of a case.
type CheckProblem[S: Record] = Callable[[S, Any, str], None]


class TableRow(NamedTuple):
    """A row of the page table-5-1: the ``kind`` of method in the report's table, the ``name``, and ``settings`` for all scenes."""

    kind: str
    name: str
    settings: Mapping[str, Any]


@dataclass(frozen=True, kw_only=True)
class Solver[P, S: Record]:
    """A record in which the file of a solver offers the function ``solve`` for one ``task``.

    ``settings``: the type of the settings. ``example``: settings as in a scene file, for contract tests. ``require``: a function
    that raises MissingSoftware or InputError if software for the settings is missing. ``check_problem``: the check of settings that
    refer to the contents of a case. ``slow``: True if a small problem takes more than a few seconds. ``go_on``: the function that
    continues a run of a slow solver; other solvers begin again from rest. ``table``: the rows of the solver on the page table-5-1.
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
        """The type of the settings; solvers whose ``given`` settings define further keys override this. ``place``: for messages."""
        return self.settings

    def fills(self, settings: S) -> bool:  # noqa: ARG002
        """True if the solver needs a problem with a mesh."""
        return True

    def run(self, problem: P, settings: S) -> Run:
        """Solve a problem in memory and return the run."""
        frames: list[Frame] = []
        outcome = self.solve(problem, settings, frames.append)
        return collected(frames, outcome)


@dataclass(frozen=True, kw_only=True)
class MuscleSolver[S: Record](Solver[MuscleProblem, S]):
    """A solver of muscles.

    ``moves``: the surface, tetrahedra or lines that have the unknowns; their resolution determines accuracy and cost.
    ``depends_on``: "order" or "size" if the result depends on the order of the vertices or on the size of the muscle.
    ``check_effects``: the check of the effects of a scene; None if the solver does not model them. ``fibres``: True if a surface
    solver with these settings needs fibres; otherwise the solver receives a ``Setup``, in which the muscle has no tetrahedra.
    """

    task = "solve"
    solves = "muscles"

    moves: Moves = "surface"
    depends_on: tuple[Literal["order", "size"], ...] = ()
    check_effects: CheckEffects[S] | None = None
    fibres: Callable[[S], bool] = lambda _: False

    def moved(self, settings: S) -> Moves:  # noqa: ARG002
        """The value of ``moves`` for these settings."""
        return self.moves

    def fills(self, settings: S) -> bool:
        """True if the solver needs a muscle with tetrahedra and fibres."""
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
    """A mark on a key of the settings that trades time for accuracy.

    ``ladder``: useful values, as in scene files, from the fastest to the most accurate. Some may be impossible in a scene, such as
    an element for another kind of cell.
    """

    ladder: tuple[float | str, ...]


def trades(settings: type[Record]) -> dict[str, tuple[float | str, ...]]:
    """The ladders of the keys of ``settings`` that trade time for accuracy, by key."""
    return {
        key: entry.ladder
        for key, field in settings.model_fields.items()
        for entry in field.metadata
        if isinstance(entry, Trade)
    }
