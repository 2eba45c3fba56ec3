"""Table 5.1 of the report on every scenario: each solver run where no run is stored, timed, and measured against the reference."""

import logging
from collections.abc import Iterable
from fnmatch import fnmatch
from pathlib import Path

from fem_reference import solvers
from fem_reference.assessment.solver_table import Scenario, SolverKind, SolverResult, Table, solver_kinds
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import Measure, MeasurementContext, in_tables, measure
from fem_reference.runs.complete import complete
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.key import versions
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Candidate
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import refinement
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

# Our own, which need nothing, and the five of the report (6.1.3 to 6.1.6). Its iliacus as the report's program attached it has no
# solution beyond frame 77 (see the case): here it has its anatomical attachments.
SCENARIOS = (
    "hip_flexion",
    "box_squeeze",
    "box_squeeze_report",
    "gluteus_maximus",
    "gluteus_medius",
    "iliacus_anatomical",
    "adductor_brevis",
)
METRICS = in_tables()
REFERENCE = "FEM"
FOREIGN = "Yours"


def stand(scenes: Iterable[MuscleCase], store: Path, foreign: dict[str, list[Candidate]]) -> Table:
    """The table over ``scenes``, with runs in ``store``; ``foreign``: by case, what somebody else's solvers made of it, which is
    read before anything is solved.
    """
    rows, scenarios, results, missing = solver_kinds(), list[Scenario](), list[SolverResult](), dict[str, str]()
    benches = [Bench(scene, store) for scene in scenes]
    read = {
        bench.scene.name: [bench.read(entry.name, entry, "--candidate") for entry in foreign.get(bench.scene.name, [])]
        for bench in benches
    }
    for i, bench in enumerate(benches):
        log.info("scene %d of %d: %s", i + 1, len(benches), bench.scene.name)
        try:
            bench.setup()
        except InputError as error:
            log.info("%s is left out: %s", bench.scene.name, error)
            missing[bench.scene.name] = str(error)
            continue
        scenario, found = _on(bench, rows, read[bench.scene.name])
        scenarios.append(scenario)
        results += found
    if foreign:
        rows = (*rows, SolverKind(name=FOREIGN, form="", speed="", precision="", literature=""))
    machines = tuple(dict.fromkeys(one.machine for one in results if one.kind != FOREIGN))
    return Table(rows, tuple(scenarios), tuple(results), missing, versions(), machines)


def chosen(scene: MuscleCase, row: SolverKind) -> list[tuple[Candidate, str]]:
    """The solvers measured for a kind on a scene, and the place that says so."""
    own = [
        (candidate, f"candidate[{i}]")
        for i, candidate in enumerate(scene.candidate)
        if any(fnmatch(candidate.name, pattern) for pattern in row.of_case)
    ]
    return own + [(candidate, f"{row.name} of Table 5.1") for candidate in solvers.in_table(row.name)]


def _on(
    bench: Bench[MuscleCase], rows: Iterable[SolverKind], foreign: list[Run]
) -> tuple[Scenario, list[SolverResult]]:
    """How everybody stands on the scene of a bench."""
    scene, numbers = bench.scene, bench.scene.numbers
    reference = complete(bench.obtain("reference", scene.reference, "reference"), numbers)
    bars = refinement.stored(reference)
    assert reference.fibres is not None  # a reference has an interior
    context = MeasurementContext.of(reference, reference.fibres, bench.setup().bones, bench.setup().exempt)
    found = [_result(scene, REFERENCE, reference, bars.of_deviations if bars else ())]
    meeting = [(row.name, *entry) for row in rows for entry in chosen(scene, row)]
    for i, (kind, candidate, place) in enumerate(meeting):
        log.info("%s: %s, solver %d of %d", scene.name, candidate.name, i + 1, len(meeting))
        run = complete(bench.obtain(candidate.name, candidate, place), numbers)
        found.append(_result(scene, kind, run, measure(run, reference, context, METRICS)))
    found += [_result(scene, FOREIGN, run, measure(run, reference, context, METRICS)) for run in foreign]
    triangles = len(reference.surface.triangles)
    return Scenario(scene.name, scene.title, triangles, context.travel, reference.outcome), found


def _result(scene: MuscleCase, kind: str, run: Run, measures: tuple[Measure, ...]) -> SolverResult:
    return SolverResult(
        kind,
        run.name,
        run.solver,
        scene.name,
        run.outcome,
        _seconds_per_frame(run),
        measures,
        run.numbers,
        str(run.origin["machine"]),
        of_reference=kind == REFERENCE,
    )


def _seconds_per_frame(run: Run) -> float | None:
    """Time [s] for a frame number of a solver that makes one for each, so says ``candidate.toml``; else for a frame wanted."""
    for key in ("seconds_per_iteration", "seconds_per_frame"):
        if key in run.outcome.cost:
            return run.outcome.cost[key]
    return seconds_per_frame(run)
