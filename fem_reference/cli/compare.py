"""The verb ``compare``: candidates compared with the reference, or a candidate with its earlier version."""

import argparse
from pathlib import Path

from fem_reference import solvers
from fem_reference.assessment import baseline, versions
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.cli import DONE, SOLVER_FAILED, write_output
from fem_reference.cli._cases import asked, candidates, checked_bench, choose, compared, own_solver, publish, scene_of
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.report import against_page
from fem_reference.report.asked import Part
from fem_reference.runs.store import Run, complete
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, Case
from fem_reference.solvers import recorded
from fem_reference.studies import refinement

HELP = "measure candidates against the reference and write the page"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    either = "a candidate of the case or a folder of frames; may be repeated"
    parser.add_argument("--candidate", action="append", metavar="NAME|DIR", help=either)
    ours = "a shipped solver as a candidate, with its standard settings if the case has none; may be repeated"
    parser.add_argument("--solver", action="append", default=[], metavar="NAME", help=ours)
    share(parser, "--solver-command")
    past = "write the page of changes since earlier results (a baseline of check, a stored run or a folder of frames)"
    parser.add_argument("--against", type=Path, metavar="BASELINE", help=past)
    share(parser, "--unit")
    limit = "judge candidates: the maximum allowed deviation of a statistic, such as surface_deviation.max='5 mm'; may be repeated"
    parser.add_argument("--limit", action="append", default=[], metavar="METRIC.STATISTIC=VALUE", help=limit)
    share(parser, "--error-bar", "--negative-control", "--name", "--ranks")


def run(options: argparse.Namespace) -> int:
    """Measure candidates against the reference."""
    scene = scene_of(options)
    known = solvers.names(scene.task)
    for name in options.solver:
        if name not in known:
            raise InputError("--solver", f'"{name}"', f"one of {', '.join(known)}")
    own = [(one, "--solver-command") for one in own_solver(options)]
    wanted = [*(options.candidate or []), *options.solver]
    if not own and not wanted:
        wanted = [candidate.name for candidate in scene.candidate]
    chosen = [*own, *(choose(scene, text, options.unit) for text in wanted)]
    return compared(scene, options, chosen) if options.against is None else _against(scene, options, chosen)


def _against(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure a candidate and its earlier version, and write the page of changes."""
    scene = casefile.muscle(case, "--against")
    if len(chosen) != 1:
        raise InputError("--against", f"{len(chosen)} candidates", "exactly one, given with --candidate or --solver")
    if options.limit:
        raise InputError("--limit", "this option with --against", "only one of the two: check judges changes")
    ((entry, place),) = chosen
    bench, path = checked_bench(scene, options, chosen), options.against
    if path.is_file() and path.suffix == ".json":
        before: Run | baseline.Baseline = baseline.read(path, scene, entry.name)
    else:
        before = bench.read("before", recorded.choice(path, options.unit, "--against"), "--against")
    now, reference = bench.obtain(entry.name, entry, place), bench.reference()
    if reference.outcome.status != "converged":
        why = f"{reference.name}: {reference.outcome.status}, {reference.outcome.message}"
        write_output({"case": scene.name, "notes": [why]}, f"{why}\nnothing can be compared", options)
        return SOLVER_FAILED
    bars = refinement.offered(bench, reference, asked=options.error_bar)

    def measured(run: Run) -> CurrentMeasures:
        return CurrentMeasures.of(scene, bench.setup(), complete(run, scene.numbers), reference, bars)

    if isinstance(before, Run):
        found = versions.of_runs(measured(now), measured(before), str(path))
    else:
        found = versions.of_baseline(measured(now), before, str(path))
    part = Part(("--against", str(path.resolve())), f"against_{path.stem if path.is_file() else path.resolve().name}")
    who = candidates(scene, [entry]) or (Part(("--candidate", entry.name), entry.name),)
    page = against_page.page(found, bench.setup())
    wanted = asked("compare", scene, options, "against", *who, part)
    publish(options, wanted, page, against_page.facts(found), against_page.text(found))
    return DONE if now.outcome.status == "converged" else SOLVER_FAILED
