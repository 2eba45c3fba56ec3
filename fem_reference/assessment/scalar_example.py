"""One scalar case with everything that was computed of it, as pages show it."""

from dataclasses import dataclass

from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.scalar import FieldRun
from fem_reference.scenes.case import Expectation
from fem_reference.scenes.scalar import ScalarCase


@dataclass(frozen=True)
class FieldMeasure:
    """A number measured of a run: ``of`` whom, ``measure`` its name, ``value``, NaN where there is none."""

    of: str
    measure: str
    value: float


@dataclass(frozen=True)
class FieldVerdict:
    """How an expectation came out."""

    word: str
    expectation: Expectation
    value: float


@dataclass(frozen=True)
class Ladder:
    """The same case on meshes each twice as fine: ``cells`` and ``errors`` by mesh, and the ``order`` measured on the finest two.

    ``against`` says what an error is: the L2 distance to the exact solution, or the rms distance at the vertices to
    the finest solution of order 2. ``order`` is NaN where the errors are rounding.
    """

    element: str
    cells: tuple[int, ...]
    errors: tuple[float, ...]
    order: float
    against: str


@dataclass(frozen=True, eq=False)
class Example:
    """A case: its problem, its ``reference`` run and ``candidates`` (their measures against it), verdicts and convergence."""

    scene: ScalarCase
    problem: FieldProblem
    reference: FieldRun
    candidates: tuple[FieldRun, ...]
    measures: tuple[FieldMeasure, ...]
    verdicts: tuple[FieldVerdict, ...]
    ladders: tuple[Ladder, ...]
    word: str

    @property
    def runs(self) -> tuple[FieldRun, ...]:
        """Every run, the reference first."""
        return (self.reference, *self.candidates)
