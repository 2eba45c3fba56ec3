"""The verbs: each prints its results and returns the exit status."""

import argparse
from pathlib import Path

from fem_reference import metrics, report, solvers
from fem_reference.assessment import comparison
from fem_reference.assessment.claims import Cover
from fem_reference.cli import scalar, verification
from fem_reference.cli.choosing import check_names, checked_bench, choose, own_candidates, scene_of
from fem_reference.cli.printing import DONE, SOLVER_FAILED, VERDICT_FAIL, lines, out, write_output
from fem_reference.cli.scalar import Printed
from fem_reference.foundations.errors import InputError
from fem_reference.io import files
from fem_reference.report.claims_page import facts as claims_facts
from fem_reference.report.overview import (
    comparison_text,
    field_scene_facts,
    ranking_text,
    run_facts,
    run_text,
    scene_facts,
)
from fem_reference.report.ranking_page import facts as ranking_facts
from fem_reference.runs import store
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.scalar import ScalarCase
from fem_reference.solvers import recorded
from fem_reference.studies import refinement, table_5_1, true_errors
from fem_reference.studies.execution import Bench, complete
from fem_reference.studies.scalar import FieldBench

MAIN_JOB = "hip_flexion"
TABLE = "table-5-1"
CLAIMS = "error-bars"


def demo(options: argparse.Namespace) -> int:
    """The main job."""
    scene = casefile.read_muscle(MAIN_JOB)
    return _judge(scene, options, own_candidates(scene))


def compare(options: argparse.Namespace) -> int:
    """Measure candidates against the reference."""
    scene = scene_of(options)
    if isinstance(scene, ScalarCase):
        _refuse_error_bar(options)
        return _printed(scalar.compare(scene, options.candidate, out(options)), options)
    scene = casefile.muscle(scene)
    wanted = options.candidate or [candidate.name for candidate in scene.candidate]
    return _judge(scene, options, [choose(scene, text, options.unit) for text in wanted])


def run(options: argparse.Namespace) -> int:
    """Solve a case, and judge what it expects of the reference."""
    scene = scene_of(options)
    if isinstance(scene, ScalarCase):
        _refuse_error_bar(options)
        return _printed(scalar.run(scene, options.solver, out(options)), options)
    scene = casefile.muscle(scene)
    if options.solver is None or options.solver == scene.reference.solver:
        return _judge(scene, options, [])
    _refuse_error_bar(options)
    bench = Bench(scene, out(options) / "runs", options.ranks)
    run = bench.obtain(options.solver, _choice(scene, options.solver), f"--solver {options.solver}")
    write_output(run_facts(scene, run), run_text(run), options)
    return DONE if run.outcome.status == "converged" else SOLVER_FAILED


def _refuse_error_bar(options: argparse.Namespace) -> None:
    if options.error_bar:
        raise InputError("--error-bar", "a scalar case or another solver", "the reference of a muscle")


def _choice(scene: MuscleCase, solver: str) -> SolverChoice:
    """How the scene chooses ``solver``: its settings as a candidate, else no settings."""
    return next((entry for entry in scene.candidate if entry.solver == solver), SolverChoice(solver=solver))


def _printed(printed: Printed, options: argparse.Namespace) -> int:
    """Print the results of scalar cases or of a verification; returns the exit status."""
    write_output(printed.facts, printed.text, options)
    if printed.word == "failed":
        return SOLVER_FAILED
    return VERDICT_FAIL if printed.word == "fail" else DONE


def page(options: argparse.Namespace) -> int:
    """Write a page over several cases."""
    if options.name == TABLE:
        return _table(options)
    if options.name == CLAIMS and not (options.candidate or options.unit):
        return _claims(options)
    if options.case or options.candidate or options.unit:
        given = "--candidate or --unit" if options.name == CLAIMS else "--case, --candidate or --unit"
        raise InputError("page", f"{given} for {options.name}", f"them for {TABLE} only")
    return _printed(scalar.page(options.name, out(options)), options)


def _table(options: argparse.Namespace) -> int:
    """The families of the report's table, measured."""
    scenes = {scene.name: scene for scene in map(casefile.read_muscle, options.case or table_5_1.SCENARIOS)}
    foreign = _foreign(options, list(scenes))
    for name in scenes if options.case else foreign:
        Bench(scenes[name], out(options)).setup()  # only what nobody asked for by name may be missing
    table = table_5_1.stand(scenes.values(), out(options) / "runs", foreign)
    path = report.write_ranking(table, out(options), TABLE)
    write_output(ranking_facts(table), f"{ranking_text(table)}\npage: {path}", options)
    return DONE if all(one.reference.status == "converged" for one in table.scenarios) else SOLVER_FAILED


def _claims(options: argparse.Namespace) -> int:
    """Error bars beside errors."""
    scenes = [casefile.read_muscle(case) for case in options.case or true_errors.CASES]
    found = true_errors.stake(scenes, out(options) / "runs")
    path = report.write_claims(found, out(options), CLAIMS)
    whole = Cover.of(found.claims)
    holding = f"{100 * whole.share:.1f} % hold the difference from a finer solution, median ratio {whole.median:.2f}"
    printed = [f"{whole.count} error bars: {holding}"]
    printed += [f"left out: {case}: {why}" for case, why in found.missing.items()]
    write_output(claims_facts(found), "\n".join([*printed, f"page: {path}"]), options)
    return SOLVER_FAILED if found.missing else DONE


def _foreign(options: argparse.Namespace, cases: list[str]) -> dict[str, list[Candidate]]:
    """By the name of a case, what somebody else's solvers made of it."""
    found = dict[str, list[Candidate]]()
    for text in options.candidate:
        case, equals, folder = text.partition("=")
        if not equals:
            raise InputError("--candidate", f'"{text}"', "CASE=DIR, a case and a folder of frames of it")
        name = casefile.read_muscle(case).name
        if name not in cases:
            raise InputError("--candidate", f'"{case}"', f"one of {', '.join(cases)}")
        found.setdefault(name, []).append(_recorded(folder, options.unit))
        check_names([candidate.name for candidate in found[name]])
    return found


def _recorded(text: str, unit: str | None) -> Candidate:
    if not text:
        raise InputError("--candidate", '""', "a folder of frames")
    return recorded.choice(Path(text), unit, "--candidate")


def verify(options: argparse.Namespace) -> int:
    """Measure problems whose answers are known."""
    measured = verification.verify(options.names, options.negative_control)
    status = _printed(verification.printed(measured), options)  # measurements are printed even if the page fails
    part = options.names or options.negative_control
    name = "verify_part" if part else "verify"  # a part does not replace the whole
    print(f"page: {report.write_verification(measured, out(options), name)}")
    return status


def _judge(scene: MuscleCase, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Reference and candidates -> page, JSON and exit status. What is bad in the input shows before anything is solved."""
    check_names([entry.name for entry, _ in chosen])
    bench = checked_bench(scene, options, chosen)
    read = {entry.name: bench.read(entry.name, entry, place) for entry, place in chosen if entry.solver == "recorded"}
    reference = bench.obtain("reference", scene.reference, "reference")
    solved = {
        entry.name: bench.obtain(entry.name, entry, place) for entry, place in chosen if entry.solver != "recorded"
    }
    bars = refinement.obtain(bench, reference) if options.error_bar else refinement.offered(bench, reference)
    numbers = scene.numbers
    candidates = tuple(complete((read | solved)[entry.name], numbers) for entry, _ in chosen)
    result = comparison.compare(scene, bench.setup(), complete(reference, numbers), candidates, bars)
    page = report.write(result, out(options) / scene.name)
    write_output(report.summary(result), comparison_text(result, page), options)
    if any(run.outcome.status != "converged" for run in (reference, *candidates)):
        return SOLVER_FAILED
    return VERDICT_FAIL if result.word == "fail" else DONE


def list_all(options: argparse.Namespace) -> int:
    """Say what there is."""
    scenes = {name: casefile.read(name).title for name in casefile.cases()}
    stored = [_stored(path.parent) for path in sorted((out(options) / "runs").rglob("run.json"))]
    facts = {"cases": scenes, "solvers": solvers.names(), "metrics": metrics.names(), "runs": stored}
    width = max(map(len, scenes))
    lines = ["cases:", *(f"  {name:{width}}  {title}" for name, title in scenes.items())]
    lines += [f"solvers: {', '.join(facts['solvers'])}", f"metrics: {', '.join(facts['metrics'])}"]
    lines += ["stored runs:", *(f"  {path}" for path in stored)] if stored else []
    write_output(facts, "\n".join(lines), options)
    return DONE


def _stored(folder: Path) -> str:
    """A stored run, with its status where it did not converge."""
    status = store.status(folder)
    return str(folder) if status == "converged" else f"{folder} ({status})"


def show(options: argparse.Namespace) -> int:
    """Say what a case is made of."""
    scene = scene_of(options)
    if isinstance(scene, ScalarCase):
        facts = field_scene_facts(scene, FieldBench(scene, out(options)).problem)
        write_output(facts, "\n".join(lines(facts)), options)
        return DONE
    scene = casefile.muscle(scene)
    bench = checked_bench(scene, options, own_candidates(scene))
    facts = scene_facts(scene, bench.setup())
    if options.out is not None:
        built, folder = bench.problem(), options.out / scene.name
        folder.mkdir(parents=True, exist_ok=True)
        files.write_surface(folder / "surface.vtp", built.surface, built.surface.points)
        files.write_polylines(folder / "fibres.vtp", built.fibres, built.fibres.points)
        files.write_tets(folder / "tets.vtu", built.mesh, built.mesh.points)
        facts |= {"mesh": built.mesh_facts, "folder": str(folder)}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE
