"""The time that a reference will take, before it is solved."""

from typing import Any

from fem_reference.foundations.records import Record
from fem_reference.problems.muscle import Problem
from fem_reference.problems.muscle_body import as_body
from fem_reference.solvers.fenicsx import resources

# Measured on hip_flexion: seconds of processor time of one of Newton's iterations with so many unknowns, the exponent by which it
# grows, and iterations a frame.
_SECONDS, _UNKNOWNS, _EXPONENT, _ITERATIONS = 0.13, 5456, 1.15, 4


def unknowns(built: Problem, settings: Any) -> int:
    """The number of unknowns of the reference of a muscle with its ``settings``."""
    return resources.unknowns(as_body(built).mesh, settings.element)


def seconds(solver: str, built: Any, settings: Record) -> float | None:
    """The processor time [s] that solving a muscle that is ``built`` takes, within a factor of three; None where nobody knows, as
    of other solvers.
    """
    if solver != "fenicsx" or not isinstance(built, Problem):
        return None
    each = _SECONDS * float((unknowns(built, settings) / _UNKNOWNS) ** _EXPONENT)
    return each * _ITERATIONS * (len(built.frames) - 1)
