"""The solvers with which entries are measured: one process of FEniCSx, and scikit-fem."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fem_reference.assessment import second_check
from fem_reference.problems.body import Body
from fem_reference.runs.store import Run
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx.session import Session

_TIME_LIMIT = "30 min"  # for one body; the slowest of the catalogue takes about a minute


class FemLab:
    """Solves bodies with the reference, in a ``session`` of FEniCSx, and with the second opinion, scikit-fem."""

    def __init__(self, session: Session) -> None:
        self.session = session

    def solve(self, body: Body, element: str, **settings: Any) -> Run:
        """The states of ``body``, computed by FEniCSx. Raises RuntimeError if FEniCSx crashed or exceeded the time limit."""
        limited = {"time_limit": _TIME_LIMIT} | settings
        solved = self.session.solve(body, fenicsx.BodySettings(element=element, **limited))
        if solved.outcome.status in ("crashed", "timed out", "stalled"):
            raise RuntimeError(solved.outcome.message)
        return second_check.confirmed_body(body, solved)

    def second(self, body: Body, element: str, **settings: Any) -> Run:
        """The states of ``body``, computed by scikit-fem."""
        return scikit_fem.solve_body(body, scikit_fem.ScikitBodySettings(element=element, **settings))


@contextmanager
def lab() -> Iterator[FemLab]:
    """A context with a lab, whose process ends with the context. Raises MissingSoftware if FEniCSx is not installed."""
    with fenicsx.session() as session:
        yield FemLab(session)
