"""A scalar scene -> runs, measures, verdicts and convergence: what ``run``, ``compare`` and ``page`` do with it."""

import logging
import math
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np

from fem_reference import __version__, solvers
from fem_reference.assessment.judge import judge, overall
from fem_reference.assessment.scalar_example import Example, FieldMeasure, FieldVerdict, Ladder
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join
from fem_reference.problems import scalar as field_problem
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs import scalar
from fem_reference.runs.key import code_hash, versions
from fem_reference.runs.scalar import FieldRun, Solution
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.scalar import Element, ScalarCase
from fem_reference.solvers import scikit_fem

log = logging.getLogger(__name__)

_OF_ONE = (
    "minimum",
    "maximum",
    "nodal_error",
    "l2_error",
)  # measures of a run by itself; difference is from the reference
_REFINEMENTS = {2: 5, 3: 3}  # by vertices of a cell
_MOST_CELLS = 100_000
_EXACT = 1e-9  # errors below this share of the solution are rounding on fine meshes, and have no order


class FieldBench:
    """A scalar scene, its problem, and where its runs are stored."""

    def __init__(self, scene: ScalarCase, store: Path) -> None:
        self.scene, self.store = scene, store / scene.name
        self.problem = field_problem.build(scene)
        _check_expectations(scene)
        for _, choice, place in _choices(scene):
            self._settings(choice, join(scene.place, place))

    def _settings(self, choice: SolverChoice, place: str) -> Record:
        return solvers.settings(choice, place, "solve_field")

    def obtain(self, name: str, choice: SolverChoice) -> FieldRun:
        """The run of a solver, solved now and stored; scalar problems take less time than it takes to look."""
        settings = self._settings(choice, f"--solver {choice.solver}")
        solution = solvers.find(choice.solver, self.scene.place, "solve_field").solve_field(self.problem, settings)
        folder = self.store / name
        run = FieldRun(name, choice.solver, self.problem, solution, self._origin(choice.solver, settings), folder)
        scalar.write(run, folder)
        log.info("%s: %s by %s: %s", self.scene.name, name, choice.solver, solution.outcome.status)
        return run

    def _origin(self, solver: str, settings: Record) -> dict[str, object]:
        return {
            "case": self.scene.name,
            "scene": self.scene.model_dump(mode="json", include={"domain", "boundary", "element", "exact"}),
            "effects": {type(effect).__name__: effect.model_dump(mode="json") for effect in self.scene.effects},
            "solver": solver,
            "settings": settings.model_dump(mode="json"),
            "fem_reference": __version__,
            "code": code_hash(solver),
            "versions": versions(),
        }


def example(scene: ScalarCase, store: Path, candidates: Iterable[str] | None = None) -> Example:
    """A case with its reference, the ``candidates`` named (by default all), their verdicts, and its convergence."""
    bench = FieldBench(scene, store)
    chosen = [entry for entry in scene.candidate if candidates is None or entry.name in candidates]
    reference = bench.obtain("reference", scene.reference)
    others = tuple(bench.obtain(entry.name, entry) for entry in chosen)
    measures = tuple(entry for run in (reference, *others) for entry in measure(scene, run, reference))
    verdicts = judged(scene, measures)
    return Example(
        scene,
        bench.problem,
        reference,
        others,
        measures,
        verdicts,
        tuple(_ladders(scene)),
        overall(verdict.word for verdict in verdicts),  # type: ignore[misc]
    )


def measure(scene: ScalarCase, run: FieldRun, reference: FieldRun | None) -> tuple[FieldMeasure, ...]:
    """Everything that can be measured of a run; ``reference`` None where there is none to compare with."""
    values = run.vertex_values
    found = {"minimum": float(values.min()), "maximum": float(values.max())}
    if scene.exact is not None:
        exact = field_problem.at(scene.exact, run.problem.mesh.points)
        found["nodal_error"] = float(np.abs(values - exact).max())
        found["l2_error"] = scikit_fem.errors(run.problem, run.solution.values, scene.exact)
    if reference is not None and reference is not run:
        found["difference"] = _difference(values, reference.vertex_values)
    return tuple(FieldMeasure(run.name, name, value) for name, value in found.items())


def judged(scene: ScalarCase, measures: Iterable[FieldMeasure]) -> tuple[FieldVerdict, ...]:
    """The verdict on each expectation of what was measured."""
    values = {(entry.of, entry.measure): entry.value for entry in measures}
    return tuple(
        FieldVerdict(judge(values[key], float(expectation.truth), float(expectation.within)), expectation, values[key])
        for expectation in scene.expect
        if (key := (expectation.of, expectation.metric)) in values
    )


def _difference(values: np.ndarray, reference: np.ndarray) -> float:
    scale = np.abs(reference).max()
    return float(np.abs(values - reference).max() / (scale if scale > 0 else 1.0))


def _choices(scene: ScalarCase) -> list[tuple[str, SolverChoice, str]]:
    """Every run that the scene names: its name, who makes it, and where the scene says so."""
    candidates = [(entry.name, entry, f"candidate[{i}]") for i, entry in enumerate(scene.candidate)]
    return [("reference", scene.reference, "reference"), *candidates]


def _check_expectations(scene: ScalarCase) -> None:
    """InputError unless every expectation is of a measure that there will be."""
    known = [name for name in _OF_ONE if scene.exact is not None or not name.endswith("_error")]
    for i, expectation in enumerate(scene.expect):
        names = known if expectation.of == "reference" else [*known, "difference"]
        if expectation.metric not in names:
            place = join(scene.place, f"expect[{i}].metric")
            raise InputError(place, f'"{expectation.metric}"', f"one of {', '.join(names)}")


def _ladders(scene: ScalarCase) -> Iterable[Ladder]:
    """The convergence of the reference solver with elements of order 1 and 2."""
    coarse = field_problem.build(scene)
    kind = coarse.mesh.cells.shape[1]
    growth = 2 if kind == 2 else 4
    levels = min(_REFINEMENTS[kind], int(math.log(_MOST_CELLS / len(coarse.mesh.cells), growth)))
    if levels < 1:
        return
    settings = solvers.settings(scene.reference, join(scene.place, "reference"), "solve_field")
    solver = solvers.find(scene.reference.solver, scene.place, "solve_field")

    def solved(order: int, level: int) -> tuple[FieldProblem, Solution]:
        element = Element(order=order, form=scene.element.form)  # type: ignore[arg-type]
        built = field_problem.build(scene.model_copy(update={"element": element}), level)
        return built, solver.solve_field(built, settings)

    error, against = _error(scene, lambda: solved(2, levels)[1])
    for order in (1, 2):
        # Without an exact solution the finest one of order 2 is what the others are measured against.
        finest = levels if order == 1 or scene.exact is not None else levels - 1
        steps = [solved(order, level) for level in range(finest + 1)]
        errors = tuple(error(*step) for step in steps)
        scale = float(np.abs(steps[-1][1].values).max())
        exact = len(errors) < 2 or not errors[-1] > _EXACT * scale
        measured = math.nan if exact else math.log2(errors[-2] / errors[-1])
        log.info("%s: elements of order %d measured on %d meshes", scene.name, order, len(steps))
        yield Ladder(f"P{order}", tuple(len(built.mesh.cells) for built, _ in steps), errors, measured, against)


def _error(scene: ScalarCase, finest: Callable[[], Solution]) -> tuple[Callable[[FieldProblem, Solution], float], str]:
    """How far a solution is from the truth, and what that is."""
    exact = scene.exact
    if exact is not None:
        return (lambda built, solution: scikit_fem.errors(built, solution.values, exact)), "the exact solution (L2)"
    # The vertices of a mesh come first in every finer one. All of them count: where the coarsest mesh is irregular its
    # own vertices alone converge with h^2 log h, and not with h^2.
    truth = finest().values

    def rms(built: FieldProblem, solution: Solution) -> float:
        count = len(built.mesh.points)
        return float(np.sqrt(np.mean((solution.values[:count] - truth[:count]) ** 2)))

    return rms, "the finest solution with P2 (rms at the vertices)"
