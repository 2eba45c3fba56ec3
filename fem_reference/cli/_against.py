"""A candidate against what it was -> the page of what changed: what ``compare --against`` does."""

import argparse
from pathlib import Path

from fem_reference.assessment import baseline, versions
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.assessment.versions import Versions
from fem_reference.cli._choosing import check_names, checked_bench
from fem_reference.cli._pages import candidates, case_part, changes, written
from fem_reference.cli._printing import DONE, SOLVER_FAILED, write_output
from fem_reference.foundations.errors import InputError
from fem_reference.report import against_page
from fem_reference.report.asked import Asked, Part
from fem_reference.runs.reached import complete
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate, Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import recorded
from fem_reference.studies import refinement
from fem_reference.studies.execution import Bench

PAGE = "against"


def against(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure the one candidate and what it was, and write the page of what changed."""
    scene = casefile.muscle(case, "--against")
    if len(chosen) != 1:
        raise InputError("--against", f"{len(chosen)} candidates", "one, by --candidate or --solver")
    if options.limit:
        raise InputError("--limit", "with --against", "one of the two: check judges a candidate by its past")
    ((entry, place),) = chosen
    check_names([entry.name])
    bench, path = checked_bench(scene, options, chosen), options.against
    if path.is_file() and path.suffix == ".json":
        before: Run | baseline.Baseline = baseline.read(path, scene, entry.name)
    else:
        before = bench.read("before", recorded.choice(path, options.unit, "--against"), "--against")
    now, reference = bench.obtain(entry.name, entry, place), bench.obtain("reference", scene.reference, "reference")
    failed = [one for one in (reference, now) if one.outcome.status != "converged"]
    if reference in failed:
        why = f"{reference.name}: {reference.outcome.status}, {reference.outcome.message}"
        write_output({"case": scene.name, "notes": [why]}, f"{why}\nnothing can be compared", options)
        return SOLVER_FAILED
    bars = refinement.obtain(bench, reference) if options.error_bar else refinement.offered(bench, reference)

    def measured(run: Run) -> CurrentMeasures:
        return CurrentMeasures.of(scene, bench.setup(), complete(run, scene.numbers), reference, bars)

    was = str(path)
    if isinstance(before, Run):
        found = versions.of_runs(measured(now), measured(before), was)
    else:
        found = versions.of_baseline(measured(now), before, was)
    lines = _written(found, bench, options, entry)
    write_output(against_page.facts(found), "\n".join([against_page.text(found), *lines]), options)
    return SOLVER_FAILED if failed else DONE


def _written(found: Versions, bench: Bench[MuscleCase], options: argparse.Namespace, entry: Candidate) -> list[str]:
    """Write the page, whose name says against what."""
    path: Path = options.against
    part = Part(("--against", str(path.resolve())), f"against_{path.stem if path.is_file() else path.resolve().name}")
    who = candidates(bench.scene, [entry]) or (Part(("--candidate", entry.name), entry.name),)
    asked = Asked("compare", bench.scene.name, (case_part(bench.scene), *changes(options), *who, part), PAGE)
    setup = bench.setup()
    return written(options, asked, against_page.page(found, setup))[1]
