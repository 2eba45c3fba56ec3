"""Comparisons of runs of a case of any kind; for a scalar case, also the convergence of its reference."""

import logging
import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import comparison
from fem_reference.assessment.comparison import Comparison, Convergence
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import join
from fem_reference.geometry.field_mesh import l2_distance
from fem_reference.problems import of_case, scalar
from fem_reference.problems.of_case import CaseSetup
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.case import Case
from fem_reference.scenes.scalar import Element, ScalarCase
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)


_REFINEMENTS = {2: 5, 3: 3}  # the maximum number of refinements, by the number of vertices of a cell
_MOST_CELLS = 100_000
_EXACT = 1e-9  # errors below this fraction of the solution are due to rounding, and show no order


def compare(
    bench: Bench[Case], reference: Run, candidates: Iterable[Run], error_bars: ErrorBars | None = None
) -> Comparison:
    """Measure and judge runs of the case of a ``bench`` over all frames of the case; for a scalar case, add the convergence."""
    case, setup = bench.scene, bench.setup()
    if case.parts:
        raise InputError(
            case.place, "a comparison of several muscles as one", "one muscle, or the command compare, for each"
        )
    complete_runs = tuple(complete(run, case.numbers) for run in candidates)
    result = comparison.compare(case, setup, complete(reference, case.numbers), complete_runs, error_bars)
    return replace(result, ladders=ladders(setup, case))


def ladders(problem: CaseSetup, case: Case) -> tuple[Convergence, ...]:
    """The convergence of the reference of a scalar ``case`` with elements of order 1 and 2; empty if the mesh cannot be refined."""
    return () if problem.field is None else tuple(_ladders(problem.field, of_case.scalar_case(case)))


def _ladders(coarse: FieldProblem, case: ScalarCase) -> Iterator[Convergence]:
    kind = coarse.mesh.cells.shape[1]
    growth = 2 if kind == 2 else 4
    levels = min(_REFINEMENTS[kind], int(math.log(_MOST_CELLS / len(coarse.mesh.cells), growth)))
    if levels < 1:
        return
    settings = solvers.settings(case.reference, join(case.place, "reference"), "solve_field")
    solver = solvers.find(case.reference.solver, case.place, "solve_field")

    def solved(order: int, level: int) -> tuple[FieldProblem, Floats]:
        element = Element(order=order, form=case.element.form)  # type: ignore[arg-type]
        built = scalar.build(case.model_copy(update={"element": element}), level)
        return built, solver.run(built, settings).values[0]

    exact = case.exact
    truth = np.empty(0) if exact is not None else solved(2, levels)[1]
    against = "the exact solution (L2)" if exact is not None else "the finest solution with P2 (rms at the vertices)"

    def error(built: FieldProblem, values: Floats) -> float:
        if exact is not None:
            return l2_distance(built.mesh, values, partial(scalar.at, exact))
        # The vertices of a mesh come first in every finer mesh. The error is taken over all vertices of this mesh: taken over
        # those of an irregular coarsest mesh alone, it would converge like h^2 log h, not like h^2.
        count = len(built.mesh.points)
        return float(np.sqrt(np.mean((values[:count] - truth[:count]) ** 2)))

    for order in (1, 2):
        # Without an exact solution, the finest solution of order 2 is the truth for all other solutions.
        finest = levels if order == 1 or case.exact is not None else levels - 1
        steps = [solved(order, level) for level in range(finest + 1)]
        errors = tuple(error(*step) for step in steps)
        scale = float(np.abs(steps[-1][1]).max())
        rounding = len(errors) < 2 or not errors[-1] > _EXACT * scale
        measured = math.nan if rounding else math.log2(errors[-2] / errors[-1])
        log.info("%s: elements of order %d measured on %d meshes", case.name, order, len(steps))
        yield Convergence(f"P{order}", tuple(len(built.mesh.cells) for built, _ in steps), errors, measured, against)
