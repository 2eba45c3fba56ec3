"""The steps from a case to a page, one call each: what the package offers to Python."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fem_reference import export, report
from fem_reference.assessment import judge, solver_table
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.export import paraview
from fem_reference.foundations.given import path
from fem_reference.foundations.records import parse
from fem_reference.problems import of_case
from fem_reference.problems.body import Body
from fem_reference.runs.solved import Solved
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case, SolverChoice
from fem_reference.solvers import fenicsx, recorded
from fem_reference.studies import arguments, judging, refinement
from fem_reference.studies.execution import Bench

Progress = Callable[[str], object]
STORE = Path("reports/runs")


def load_case(case: str | Path, changes: Mapping[str, Any] | None = None) -> Case:
    """Read a case.

    Parameters
    ----------
    case
        The name of a shipped case, a folder with a ``case.toml``, or a scene file.
    changes
        Keys such as ``"frames.last"`` or ``"effect[1].bulk"`` with other values, as scene files write them.

    Raises
    ------
    InputError
        Where a key is missing, unknown or wrong; it names file, key, what was got and what is wanted.

    """
    arguments.check_changes(changes)
    path(case, "case")
    return of_case.chosen(casefile.read(case, changes=dict(changes or {})))


def solve(
    case: Case,
    solver: str | None = None,
    *,
    store: str | Path = STORE,
    progress: Progress | None = None,
    **settings: Any,
) -> Run:
    """Solve a case, or take up what was solved before: a run is stored by all that determines it.

    Parameters
    ----------
    case
        What :func:`load_case` read.
    solver
        The name of a solver, such as ``"pbd"``; without it the reference of the case, with the settings that the case has.
    store
        The folder that runs are stored in.
    progress
        Called with each line of progress.
    settings
        Of the ``solver``, as scene files write them; without any those that the case has for it, or else the page table-5-1.

    Returns
    -------
    Run
        ``positions`` (f, n, 3) [mm] of the surface's vertices by frame number, ``outcome`` (status, message, cost), ``folder``.
        Where physics fails, the status says so and the frames that were reached are there.

    """
    arguments.check_case(case)
    arguments.check_solver(solver, settings)
    arguments.check_progress(progress)
    folder = arguments.free_folder(store, "store")
    choice: SolverChoice = case.reference
    if solver is not None:
        choice = SolverChoice(solver=solver, **settings) if settings else solver_table.choice(case, solver)[1]
    name = "reference" if solver is None else solver
    with _reported(progress):
        return Bench(case, folder).obtain(name, choice, f'solver "{choice.solver}"')


def read_run(folder: str | Path, case: Case, *, unit: str | None = None) -> Run:
    """Read frames that another program wrote, and check them against the case.

    Parameters
    ----------
    folder
        A folder of meshes, one a frame, or a file of a sequence; a ``candidate.toml`` in it may say name and unit.
    case
        The case that they are frames of: the vertices are those of its muscle's surface, in its order.
    unit
        The unit of length of the frames, by default what ``candidate.toml`` says, else mm.

    Returns
    -------
    Run
        ``positions`` (f, n, 3) [mm] of the surface's vertices by frame number.

    Raises
    ------
    InputError
        Where a file cannot be read whole, or its vertices or its first frame are not those of the case.

    """
    arguments.check_case(case)
    choice = recorded.choice(path(folder, "folder"), unit)
    return Bench(case, STORE).read(choice.name, choice, "folder")


def error_bars(
    case: Case, reference: Run, *, store: str | Path = STORE, progress: Progress | None = None
) -> ErrorBars | None:
    """Estimate how far each statistic of a reference may be from the truth, from runs on larger tetrahedra and with finer contact.

    Parameters
    ----------
    case
        The case of the reference.
    reference
        What :func:`solve` returned without a ``solver``.
    store
        The folder that runs are stored in; bars are kept beside the reference's run.
    progress
        Called with each line of progress.

    Returns
    -------
    ErrorBars or None
        By statistic a bar for each frame, in the unit of the statistic; None where the reference did not converge.

    """
    arguments.check_case(case)
    arguments.check_run(reference, case, "reference")
    arguments.check_progress(progress)
    folder = arguments.free_folder(store, "store")
    with _reported(progress):
        bench = Bench(casefile.muscle(case), folder)
        return refinement.stored(reference) or refinement.obtain(bench, reference)


def compare(
    case: Case, reference: Run, candidates: Sequence[Run] = (), *, error_bars: ErrorBars | None = None
) -> Comparison:
    """Measure candidates against the reference of a case, and judge what the case expects.

    Parameters
    ----------
    case
        The case that all runs are of.
    reference
        The run that counts as the truth.
    candidates
        Runs to measure against it. A frame that a run did not reach is NaN, and never a pass.
    error_bars
        Those of the reference, from :func:`error_bars`. With them a verdict that they leave in doubt is inconclusive.

    Returns
    -------
    Comparison
        ``comparison["pbd", "surface_deviation", "rms"]`` is a measure: ``values`` (f,), ``unit``, ``worst`` frame.

    """
    arguments.check_case(case)
    arguments.check_runs(reference, candidates, case)
    arguments.check_error_bars(error_bars, case)
    judge.check(case)
    return judging.compare(Bench(case, STORE), reference, candidates, error_bars)


def export_case(case: Case, folder: str | Path, form: export.Format = "open") -> list[str]:
    """Write all that another program needs to solve a case.

    Parameters
    ----------
    case
        What :func:`load_case` read.
    folder
        A new or empty folder.
    form
        ``"open"``: PLY, VTU, MSH, VTK, CSV and JSON, lengths in mm; ``"febio"``: FEBio's input file too.

    Returns
    -------
    list of str
        The names of the files.

    Raises
    ------
    InputError
        Where ``folder`` is not empty, or FEBio has not the same effects.

    """
    arguments.check_case(case)
    muscle = casefile.muscle(case)
    return export.export(muscle, Bench(muscle, STORE).problem, arguments.free_folder(folder, "folder"), form)


def export_runs(comparison: Comparison, folder: str | Path) -> list[str]:
    """Write the runs of a muscle for ParaView: ``runs.pvd`` opens all frames, with named blocks and arrays on them.

    Parameters
    ----------
    comparison
        From :func:`compare`. Stress, pressure and det F are there if its reference was solved with ``store_state = true``.
    folder
        A new or empty folder.

    Returns
    -------
    list of str
        The names of the files; the README.md among them says what each array is.

    Raises
    ------
    InputError
        Where ``folder`` is not empty.

    """
    arguments.check_comparison(comparison)
    return paraview.write(comparison, arguments.free_folder(folder, "folder"))


def write_report(comparison: Comparison, folder: str | Path) -> Path:
    """Write ``report.html``, ``measures.json`` and ``measures.csv`` into ``folder``; the path of the page."""
    arguments.check_comparison(comparison)
    return report.write(comparison, arguments.free_folder(folder, "folder"))


def solve_body(body: Body, *, progress: Progress | None = None, **settings: Any) -> Solved:
    """Solve a body of any shape with the reference, FEniCSx.

    Parameters
    ----------
    body
        Cells, effects, what is prescribed where, and the frames that are wanted. What is prescribed may be a function of the
        caller's own.
    progress
        Called with each line of progress.
    settings
        As under ``[reference]`` in a scene file: ``element``, ``first_step``, ``residual``, ...

    Returns
    -------
    Solved
        ``states``, each with ``points`` (n, 3) [mm] of the nodes and ``forces`` (3,) [N] by name of what is prescribed; the
        ``outcome``.

    """
    arguments.check_progress(progress)
    with _reported(progress):
        return fenicsx.solve_body(body, parse(fenicsx.BodySettings, settings, "settings"))


@contextmanager
def _reported(progress: Progress | None) -> Iterator[None]:
    """Meanwhile each line of progress goes to ``progress``."""
    if progress is None:
        yield
        return
    log = logging.getLogger("fem_reference")
    handler, level = _Calling(progress), log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


class _Calling(logging.Handler):
    """Calls a function with each line."""

    def __init__(self, progress: Progress) -> None:
        super().__init__()
        self.progress = progress

    def emit(self, record: logging.LogRecord) -> None:
        self.progress(record.getMessage())
