"""The reference of this project: FEniCSx, as it is used elsewhere."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from benchmarks.peers import Solve, Solved
from benchmarks.peers.problem import QUADRATURE, RESIDUAL, Muscle
from fem_reference.solvers import fenicsx

PACKAGES = ("dolfinx-solver-real",)
TUNED = (
    "as it comes: factorisations lagged and in single precision, Newton's method inexact; it also checks det F, and counts "
    "the negative modes at rest and at the end, the one state that is asked of all"
)
OMITTED: dict[str, str] = {}


@contextmanager
def opened() -> Iterator[Solve]:
    """A process that has FEniCSx imported."""
    with fenicsx.session() as own:

        def solve(muscle: Muscle) -> Solved:
            settings = fenicsx.BodySettings(
                element=muscle.element,
                first_step=1.0,
                largest_step=1.0,
                residual=RESIDUAL,
                quadrature_degree=QUADRATURE[muscle.element],
            )
            first, *_, last = muscle.body.frames
            found = own.solve(replace(muscle.body, frames=(first, last)), settings)
            cost, outcome = found.outcome.cost, found.outcome
            points = found.states[-1].points if found.states else muscle.mesh.points
            iterations, unknowns = (int(cost.get(name, 0)) for name in ("newton_iterations", "unknowns"))
            return Solved(outcome.status == "converged", outcome.message, iterations, unknowns, points)

        yield solve
