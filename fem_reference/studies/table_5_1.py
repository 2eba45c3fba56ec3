"""Table 5.1 of the report: time and accuracy of every solver on every scenario, relative to the reference; runs are reused."""

import logging
from collections.abc import Iterable
from dataclasses import replace
from fnmatch import fnmatch
from pathlib import Path

from fem_reference import solvers
from fem_reference.assessment.solver_table import Scenario, SolverKind, SolverResult, Table, solver_kinds
from fem_reference.assessment.soundness import unsound
from fem_reference.effects.contact import among
from fem_reference.foundations.records import Record
from fem_reference.metrics import Measure, MeasurementContext, context_of, in_tables, measure
from fem_reference.runs.key import versions
from fem_reference.runs.store import Run, complete, seconds_per_frame
from fem_reference.scenes.case import COMMAND, Candidate, SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import refinement
from fem_reference.studies.campaign import each
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

# Our own scenes, which need no downloaded data, and the five of the report (6.1.3 to 6.1.6). The iliacus has its anatomical
# attachments here, because with those of the report's program it has no solution beyond frame 77 (see the case).
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
_AVOIDS = ("collision", "contact", "voxels")  # settings with which a solver avoids bones


def stand(
    scenes: Iterable[MuscleCase], store: Path, foreign: dict[str, list[Candidate]], *, error_bars: bool = False
) -> Table:
    """The table of all solvers on ``scenes``, with runs in ``store``.

    ``foreign``: the user's solvers by case; recorded frames are read before anything is solved. With ``error_bars``, missing error
    bars of the reference are computed; otherwise only stored ones are used.
    """
    rows, scenarios, results = solver_kinds(), list[Scenario](), list[SolverResult]()
    benches = {scene.name: Bench(scene, store) for scene in scenes}
    read = {
        name: [bench.read(one.name, one, "--candidate") for one in foreign.get(name, []) if one.solver != COMMAND]
        for name, bench in benches.items()
    }
    there, missing = each(benches, lambda bench: bench.setup())
    for i, name in enumerate(there):
        log.info("scene %d of %d: %s", i + 1, len(there), name)
        commands = [one for one in foreign.get(name, []) if one.solver == COMMAND]
        scenario, found = _on(benches[name], rows, read[name], commands, error_bars)
        scenarios.append(scenario)
        results += found
    if foreign:
        rows = (*rows, SolverKind(name=FOREIGN, form="", speed="", precision="", literature=""))
    machines = tuple(dict.fromkeys(one.machine for one in results if one.kind != FOREIGN))
    return Table(rows, tuple(scenarios), tuple(results), missing, versions(), machines)


def _on(
    bench: Bench[MuscleCase],
    rows: Iterable[SolverKind],
    foreign: list[Run],
    commands: list[Candidate],
    error_bars: bool,
) -> tuple[Scenario, list[SolverResult]]:
    """The scenario of a bench, and the results of all solvers on it, the reference first."""
    scene = bench.scene
    reference = complete(bench.reference(), scene.numbers)
    bars = refinement.bars(bench, reference, model=False) if error_bars else refinement.stored(reference)
    context = context_of(bench.setup(), reference)
    measures, own = bars.of_deviations if bars else (), needs(scene, scene.reference, context)
    results = [_result(scene, REFERENCE, reference, measures, own)]
    those = chosen(scene, rows)
    for i, (kind, candidate, place) in enumerate(those):
        log.info("%s: %s, solver %d of %d", scene.name, candidate.name, i + 1, len(those))
        run = complete(bench.obtain(candidate.name, candidate, place), scene.numbers)
        measures = measure(run, reference, context, METRICS)
        found = _result(scene, kind, run, measures, needs(scene, candidate, context))
        results.append(replace(found, unsound=unsound(run, reference)))
    foreign = foreign + [complete(bench.obtain(one.name, one, "--solver-command"), scene.numbers) for one in commands]
    for run in foreign:
        found = _result(scene, FOREIGN, run, measure(run, reference, context, METRICS), {})
        results.append(replace(found, unsound=unsound(run, reference)))
    triangles = len(reference.surface.triangles)
    return Scenario(scene.name, scene.title, triangles, context.travel, reference.outcome), results


def chosen(case: MuscleCase, rows: Iterable[SolverKind]) -> list[tuple[str, Candidate, str]]:
    """The solvers that are compared on a case, in the order of ``rows``: the kind, the candidate, and the place that chooses it."""
    found = list[tuple[str, Candidate, str]]()
    for row in rows:
        for i, candidate in enumerate(case.candidate):
            if any(fnmatch(candidate.name, pattern) for pattern in row.of_case):
                found.append((row.name, candidate, f"candidate[{i}]"))
        found += [(row.name, candidate, f"{row.name} of Table 5.1") for candidate in solvers.in_table(row.name)]
    return found


def needs(case: MuscleCase, choice: SolverChoice, context: MeasurementContext) -> dict[str, int]:
    """The number of parameters that a solver needs on a case, by kind: settings, parameters of the effects that it simulates,
    attachments, shapes of the bones that it avoids, and fibres. Empty for recorded frames.
    """
    offer = solvers.find(choice.solver, "")
    if offer.moves == "nothing":
        return {}
    settings = solvers.settings(choice, choice.solver)
    simulates = offer.check_effects is not None
    avoids = among(case.effects) if simulates else any(getattr(settings, key, None) for key in _AVOIDS)
    along = simulates and any("fibre" in effect.needs for effect in case.effects)
    fibrous = offer.moves == "lines" or offer.fibres(settings) or along
    found = {
        "settings": stated(settings),
        "effects": sum(map(stated, case.effects)) if simulates else 0,
        "attachments": len(case.attachment),
        "bones": len(case.bone) if avoids else 0,
        "fibres": len(context.fibres) if fibrous else 0,
    }
    return {name: count for name, count in found.items() if count}


def stated(record: Record) -> int:
    """The number of values of a ``record`` that are required or differ from their defaults, including those of nested records."""
    fields = type(record).model_fields.items()
    given = [(field, getattr(record, key)) for key, field in fields]
    return sum(_leaves(value) for field, value in given if field.is_required() or value != field.default)


def _leaves(value: object) -> int:
    if isinstance(value, tuple) and all(isinstance(one, Record) for one in value):
        return sum(map(_leaves, value))
    return stated(value) if isinstance(value, Record) else 1


def _result(
    case: MuscleCase, kind: str, run: Run, measures: tuple[Measure, ...], needed: dict[str, int]
) -> SolverResult:
    named, machine = (kind, run.name, run.solver, case.name), str(run.origin["machine"])
    return SolverResult(
        *named,
        run.outcome,
        seconds_of(run),
        measures,
        run.numbers,
        machine,
        of_reference=kind == REFERENCE,
        needs=needed,
    )


def seconds_of(run: Run) -> float | None:
    """The time [s] per frame number, if the solver computes every frame number or ``candidate.toml`` states the time; otherwise the
    time per requested frame; None if unknown.
    """
    cost = run.outcome.cost
    given = cost.get("seconds_per_iteration", cost.get("seconds_per_frame"))
    return seconds_per_frame(run) if given is None else given
