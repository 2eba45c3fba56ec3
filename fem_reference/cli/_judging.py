"""Reference and candidates of a case -> page, JSON and exit status: what ``demo``, ``run`` and ``compare`` share."""

import argparse

from fem_reference import report
from fem_reference.cli._choosing import check_names, checked_bench, refuse_error_bar
from fem_reference.cli._printing import DONE, SOLVER_FAILED, VERDICT_FAIL, out, write_output
from fem_reference.report.overview import comparison_text
from fem_reference.scenes.case import Candidate, Case
from fem_reference.studies import judging, refinement


def judge(scene: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure and judge the ``chosen`` candidates. What is bad in the input shows before anything is solved."""
    refuse_error_bar(scene, options)
    check_names([entry.name for entry, _ in chosen])
    bench = checked_bench(scene, options, chosen)
    read = {entry.name: bench.read(entry.name, entry, place) for entry, place in chosen if entry.solver == "recorded"}
    reference = bench.obtain("reference", scene.reference, "reference")
    solved = {
        entry.name: bench.obtain(entry.name, entry, place) for entry, place in chosen if entry.solver != "recorded"
    }
    bars = refinement.obtain(bench, reference) if options.error_bar else refinement.offered(bench, reference)
    result = judging.compare(bench, reference, [(read | solved)[entry.name] for entry, _ in chosen], bars)
    page = report.write(result, out(options) / scene.name)
    write_output(report.summary(result), comparison_text(result, page), options)
    if any(run.outcome.status != "converged" for run in result.runs):
        return SOLVER_FAILED
    return VERDICT_FAIL if result.word == "fail" else DONE
