"""Python API: one function for each step from a case to a page."""

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
    """Read a ``case``: the name of a shipped case, a folder with a ``case.toml``, or a scene file.

    ``changes``: other values, as in scene files, for keys such as ``"frames.last"`` or ``"effect[1].bulk"``. Raises InputError if a
    key is missing, unknown or wrong; the error states the file, the key, the value and the expected value.
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
    """Solve a case, or read its stored run. Runs are stored under a key that depends on everything that determines the result.

    ``solver``: the name of a solver, such as ``"pbd"``, or your function ``solver(scene, out, **settings)``. Your function reads
    the folder ``scene``, which :func:`export_case` has written, and writes frames into the folder ``out``. Without a ``solver`` the
    reference of the case is solved. ``settings``: the settings of the ``solver``, as in scene files; by default those of the case
    for this solver or, if the case has none, those of Table 5.1. ``muscle``: in a case of several muscles, the muscle that the
    ``solver`` solves by itself; the reference solves all muscles together.

    The run has ``positions`` (f, n, 3) [mm] of the surface's vertices in each frame, an ``outcome`` (status, message, cost) and a
    ``folder``. If the solution fails, the status says so, and the frames that were reached are kept.
    """
    arguments.check_case(case)
    arguments.check_solver(solver, settings, muscle)
    folder = arguments.free_folder(store, "store")
    bench = _bench(case, muscle, folder)
    name, choice = _chosen(bench.scene, solver, settings, folder)
    with reported(progress):
        return bench.obtain(name, choice, f'solver "{choice.solver}"')


def _bench(case: Case, muscle: str, folder: Path) -> Bench[Any]:
    """The bench of a case or, if a ``muscle`` is named, of this muscle. Raises InputError if the case has no such muscle."""
    if not muscle:
        return Bench(case, folder)
    arguments.check_muscle(muscle, case)
    return Bench(case, folder).parts[muscle]


def _chosen(
    case: Case, solver: str | Callable[..., None] | None, settings: dict[str, Any], folder: Path
) -> tuple[str, SolverChoice]:
    """The name of a run, and its solver with settings. A function is saved inside the ``folder`` of runs."""
    if callable(solver):
        return solver.__name__, command.of_function(solver, settings, folder / "functions")
    if solver is None:
        return "reference", case.reference
    return solver, SolverChoice(solver=solver, **settings) if settings else solvers.choice(case, solver)[1]


def read_run(folder: str | Path, case: Case, *, unit: str | None = None, muscle: str = "") -> Run:
    """Read frames that another program wrote: ``positions`` (f, n, 3) [mm] of the muscle's vertices, in the order of the case.

    ``folder``: a folder with a mesh for each frame, or a file with a sequence of frames; a ``candidate.toml`` in the folder may
    state name and unit. ``unit``: the unit of length, by default that of ``candidate.toml`` or, without one, mm. ``muscle``: the
    name of the muscle, if the case has several. Raises InputError if a file cannot be read completely, or if the vertices or the
    first frame are not those of the case.
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
    """Estimate the error of each statistic of a reference from runs on larger tetrahedra and with stiffer contact. The error of a
    body is estimated from one solution on smaller cells or with more unknowns in each cell.

    ``reference``: the run that :func:`solve` returned without a ``solver``, next to which the error bars are stored; or the run
    that :func:`solve_body` returned. ``muscle``: in a case of several muscles, the muscle whose error bars are wanted; the runs
    always solve all muscles. Each statistic has an error bar for each frame, in the unit of the statistic; a body has error bars of
    points, forces, moments and energy. Returns None if the reference did not converge.
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

    A frame that a run did not reach has the value NaN and never passes. With ``error_bars`` of the reference, which
    :func:`error_bars` returns, a verdict is inconclusive if the error bars leave it in doubt. The measure
    ``comparison["pbd", "surface_deviation", "rms"]`` has ``values`` (f,), a ``unit`` and a ``worst`` frame. ``muscle``: in a case
    of several muscles, the muscle that is compared; ``reference`` is then the run of all muscles, and ``candidates`` are runs of
    this muscle.
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
    """Write everything that another program needs to solve a case into a new or empty ``folder``; return the names of the files.

    ``form``: ``"open"`` for PLY, VTU, MSH, VTK, CSV and JSON files in mm; ``"febio"`` for an input file of FEBio in addition.
    Raises InputError if ``folder`` is not empty, or if FEBio does not have an effect of the case.
    """
    arguments.check_case(case)
    muscle = casefile.muscle(case)
    return export.export(muscle, Bench(muscle, STORE).problem, arguments.free_folder(folder, "folder"), form)


def export_runs(comparison: Comparison, folder: str | Path) -> list[str]:
    """Write the runs of a muscle for ParaView into a new or empty ``folder``; return the names of the files.

    Open ``runs.pvd`` to see all frames as named blocks with arrays; README.md describes each array. Stress, pressure and det F are
    included if the reference was solved with ``store_state = true``. Raises InputError if the runs cannot be exported.
    """
    arguments.check_comparison(comparison)
    return paraview.write(comparison, arguments.free_folder(folder, "folder"))


def write_report(comparison: Comparison, folder: str | Path) -> Path:
    """Write ``report.html``, ``measures.json`` and ``measures.csv`` into ``folder``; return the path of the page."""
    arguments.check_comparison(comparison)
    return report.write(report.of_comparison(comparison), arguments.free_folder(folder, "folder"), report.NAME)


def solve_body(body: Body, *, progress: Progress | None = None, **settings: Any) -> Run:
    """Solve a body of any shape with FEniCSx, the reference. Prescribed displacements may be your own functions.

    ``settings``: those under ``[reference]`` in a scene file, such as ``element``, ``first_step`` or ``residual``. The run has an
    ``outcome`` and ``states``. Each state has ``points`` (n, 3) [mm] of the nodes, and ``forces`` (3,) [N] by name of the
    prescribed displacement. :func:`error_bars` estimates the error due to the size of the cells.
    """
    with reported(progress):
        chosen = parse(fenicsx.BodySettings, settings, "settings")
        return second_check.confirmed_body(body, fenicsx.solve_body(body, chosen))
