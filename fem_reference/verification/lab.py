"""The solvers that measure entries: one process of FEniCSx, and scikit-fem."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fem_reference.assessment import second_check
from fem_reference.problems.body import Body
from fem_reference.runs.store import Run
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx.session import Session

_TIME_LIMIT = "30 min"  # of one body; the slowest of the catalogue takes about a minute


class FemLab:
    """Solves bodies by the reference in a ``session``, and by the second opinion."""

    def __init__(self, session: Session) -> None:
        self.session = session

    def solve(self, body: Body, element: str, **settings: Any) -> Run:
        """The states of ``body`` by the reference, FEniCSx, within a time limit."""
        limited = {"time_limit": _TIME_LIMIT} | settings
        solved = self.session.solve(body, fenicsx.BodySettings(element=element, **limited))
        return second_check.confirmed_body(body, solved)

    def second(self, body: Body, element: str, **settings: Any) -> Run:
        """The states of ``body`` by the second opinion, scikit-fem."""
        return scikit_fem.solve_body(body, scikit_fem.ScikitBodySettings(element=element, **settings))


@contextmanager
def lab() -> Iterator[FemLab]:
    """A lab; its process ends with it. MissingSoftware where FEniCSx is not installed."""
    with fenicsx.session() as session:
        yield FemLab(session)
