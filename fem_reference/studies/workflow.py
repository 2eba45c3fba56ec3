"""Python API: the steps from a case to a page, one call each."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

from fem_reference import export, report, solvers
from fem_reference.assessment import judge, second_check
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import BodyBars, ErrorBars
from fem_reference.export import paraview
from fem_reference.foundations.given import path
from fem_reference.foundations.progress import Progress, reported
from fem_reference.foundations.records import parse
from fem_reference.problems import of_case
from fem_reference.problems.body import Body
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case, SolverChoice
from fem_reference.solvers import command, fenicsx, recorded
from fem_reference.studies import arguments, body_refinement, by_muscle, judging, muscle_bars, refinement
from fem_reference.studies.execution import Bench

STORE = Path("reports/runs")


def load_case(case: str | Path, changes: Mapping[str, object] | None = None) -> Case:
    """Read a ``case``: the name of a shipped case, a folder with a ``case.toml``, or a scene file; with ``changes``: keys such as
    ``"frames.last"`` or ``"effect[1].bulk"`` with other values, as scene files write them. InputError if a key is missing,
    unknown or wrong; the error states the file, the key, the value and the expected value.
    """
    arguments.check_changes(changes)
    path(case, "case")
    return of_case.chosen(casefile.read(case, changes=dict(changes or {})))


def solve(
    case: Case,
    solver: str | Callable[..., None] | None = None,
    *,
    muscle: str = "",
    store: str | Path = STORE,
    progress: Progress | None = None,
    **settings: Any,
) -> Run:
    """Solve a case, or read its stored run; a run is stored under a key that depends on everything that determines it.

    ``solver``: its name, such as ``"pbd"``, or your function ``solver(scene, out, **settings)``, which reads a folder that
    :func:`export_case` writes and writes frames into another; without it the reference, with the settings of the case. ``settings``
    are those of the ``solver``, as scene files write them; by default those of the case for it, else those of Table 5.1.
    ``muscle``: in a case of several muscles, the one that the ``solver`` solves by itself; the reference solves all together. The
    run has ``positions`` (f, n, 3) [mm] of the surface's vertices in each frame, ``outcome`` (status, message, cost) and
    ``folder``. If the solution fails, the status states this, and the frames reached before are kept.
    """
    arguments.check_case(case)
    arguments.check_solver(solver, settings, muscle)
    folder = arguments.free_folder(store, "store")
    bench = _bench(case, muscle, folder)
    name, choice = _chosen(bench.scene, solver, settings, folder)
    with reported(progress):
        return bench.obtain(name, choice, f'solver "{choice.solver}"')


def _bench(case: Case, muscle: str, folder: Path) -> Bench[Any]:
    """The bench of a case, or of the ``muscle`` with this name if it is not empty; InputError if the case has no such muscle."""
    if not muscle:
        return Bench(case, folder)
    arguments.check_muscle(muscle, case)
    return Bench(case, folder).parts[muscle]


def _chosen(
    case: Case, solver: str | Callable[..., None] | None, settings: dict[str, Any], folder: Path
) -> tuple[str, SolverChoice]:
    """The name of a run and its solver; a function is written below the ``folder`` of runs."""
    if callable(solver):
        return solver.__name__, command.of_function(solver, settings, folder / "functions")
    if solver is None:
        return "reference", case.reference
    return solver, SolverChoice(solver=solver, **settings) if settings else solvers.choice(case, solver)[1]


def read_run(folder: str | Path, case: Case, *, unit: str | None = None, muscle: str = "") -> Run:
    """Read frames that another program wrote, ``positions`` (f, n, 3) [mm] of the vertices of the case's muscle in the same order.

    ``folder``: a folder with a mesh per frame, or a file of a sequence; ``candidate.toml`` in it may state name and unit. ``unit``:
    the unit of length, by default that of ``candidate.toml``, else mm. ``muscle``: its name, if there are several.
    InputError if a file cannot be read completely, or its vertices or its first frame are not those of the case.
    """
    arguments.check_case(case)
    choice = recorded.choice(path(folder, "folder"), unit)
    return _bench(case, muscle, STORE).read(choice.name, choice, "folder")


@overload
def error_bars(
    case: Case, reference: Run, *, muscle: str = "", store: str | Path = STORE, progress: Progress | None = None
) -> ErrorBars | None: ...


@overload
def error_bars(
    case: Body, reference: Run, *, store: str | Path = STORE, progress: Progress | None = None
) -> BodyBars | None: ...


def error_bars(
    case: Case | Body,
    reference: Run,
    *,
    muscle: str = "",
    store: str | Path = STORE,
    progress: Progress | None = None,
) -> ErrorBars | BodyBars | None:
    """Estimate the error of each statistic of a reference, from runs on larger tetrahedra and with finer contact; or that of a
    body, from a solution on smaller cells or with more unknowns in each cell.

    ``reference``: the result of :func:`solve` without a ``solver``, next to which bars are stored, or of :func:`solve_body`.
    ``muscle``: the name of the muscle whose bars are wanted, in a case of several; the runs solve all muscles.
    Each statistic has a bar for each frame, in its unit; a body has bars of points, forces, moments and energy. None if the
    reference did not converge.
    """
    with reported(progress):
        arguments.check_muscle(muscle, case)
        if arguments.is_of_body(reference, case):
            return body_refinement.body_bars(reference)
        scene = arguments.check_case(case)
        arguments.check_run(reference, scene, "reference")
        bench = Bench(scene if scene.parts else casefile.muscle(scene), arguments.free_folder(store, "store"))
        return muscle_bars.bars(bench, reference, muscle) if muscle else refinement.bars(bench, reference)


def compare(
    case: Case,
    reference: Run,
    candidates: Sequence[Run] = (),
    *,
    error_bars: ErrorBars | None = None,
    muscle: str = "",
) -> Comparison:
    """Measure candidates against the reference of a case, and judge the expectations of the case.

    A frame that a run did not reach is NaN, and never a pass. With ``error_bars`` of the reference, from :func:`error_bars`, a
    verdict that they leave in doubt is inconclusive. ``comparison["pbd", "surface_deviation", "rms"]`` is a measure: ``values``
    (f,), ``unit``, ``worst`` frame. ``muscle``: in a case of several muscles, the one that is compared; ``reference`` is the run
    of all muscles, ``candidates`` are runs of this muscle.
    """
    arguments.check_case(case)
    arguments.check_run(reference, case, "reference")
    bench = _bench(case, muscle, STORE)
    if muscle:
        reference = by_muscle.split(Bench(case, STORE), reference)[muscle]
    arguments.check_runs(reference, candidates, bench.scene)
    arguments.check_error_bars(error_bars, bench.scene)
    judge.check(bench.scene)
    return judging.compare(bench, reference, candidates, error_bars)


def export_case(case: Case, folder: str | Path, form: export.Format = "open") -> list[str]:
    """Write all that another program needs to solve a case into a new or empty ``folder``; return the names of the files.

    ``form``: ``"open"`` for PLY, VTU, MSH, VTK, CSV and JSON, in mm; ``"febio"`` for FEBio's input file too. InputError if
    ``folder`` is not empty, or FEBio lacks an effect.
    """
    arguments.check_case(case)
    muscle = casefile.muscle(case)
    return export.export(muscle, Bench(muscle, STORE).problem, arguments.free_folder(folder, "folder"), form)


def export_runs(comparison: Comparison, folder: str | Path) -> list[str]:
    """Write the runs of a muscle for ParaView into a new or empty ``folder``; return the names of the files, or raise InputError.

    ``runs.pvd`` opens all frames, with named blocks and arrays on them; the README.md among the files describes each array.
    Stress, pressure and det F are included if the reference was solved with ``store_state = true``.
    """
    arguments.check_comparison(comparison)
    return paraview.write(comparison, arguments.free_folder(folder, "folder"))


def write_report(comparison: Comparison, folder: str | Path) -> Path:
    """Write ``report.html``, ``measures.json`` and ``measures.csv`` into ``folder``; return the path of the page."""
    arguments.check_comparison(comparison)
    return report.write(report.of_comparison(comparison), arguments.free_folder(folder, "folder"), report.NAME)


def solve_body(body: Body, *, progress: Progress | None = None, **settings: Any) -> Run:
    """Solve a body of any shape, whose prescribed displacements may be your own functions, with the reference, FEniCSx.

    ``settings`` are as under ``[reference]`` in a scene file: ``element``, ``first_step``, ``residual``, ... The run has
    ``states``, each with ``points`` (n, 3) [mm] of the nodes and ``forces`` (3,) [N] by name of the prescribed displacement, and
    the ``outcome``. :func:`error_bars` estimates the error due to the size of the cells.
    """
    with reported(progress):
        chosen = parse(fenicsx.BodySettings, settings, "settings")
        return second_check.confirmed_body(body, fenicsx.solve_body(body, chosen))
