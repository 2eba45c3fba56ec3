"""Reference and candidates of a case -> page, JSON and exit status: what ``demo``, ``run`` and ``compare`` share."""

import argparse

from fem_reference import report
from fem_reference.cli._choosing import check_names, checked_bench, refuse_error_bar
from fem_reference.cli._pages import candidates, case_part, changes, written
from fem_reference.cli._printing import DONE, SOLVER_FAILED, VERDICT_FAIL, write_output
from fem_reference.report.asked import Asked, Part
from fem_reference.report.overview import comparison_text
from fem_reference.scenes.case import Candidate, Case
from fem_reference.solvers import fenicsx
from fem_reference.studies import judging, refinement


def judge(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure and judge the ``chosen`` candidates. What is bad in the input shows before anything is solved."""
    with fenicsx.shared():
        return _judge(case, options, chosen)


def _judge(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    refuse_error_bar(case, options)
    check_names([entry.name for entry, _ in chosen])
    bench = checked_bench(case, options, chosen)
    read = {entry.name: bench.read(entry.name, entry, place) for entry, place in chosen if entry.solver == "recorded"}
    reference = bench.obtain("reference", case.reference, "reference")
    solved = {
        entry.name: bench.obtain(entry.name, entry, place) for entry, place in chosen if entry.solver != "recorded"
    }
    bars = refinement.obtain(bench, reference) if options.error_bar else refinement.offered(bench, reference)
    result = judging.compare(bench, reference, [(read | solved)[entry.name] for entry, _ in chosen], bars)
    asked = _asked(case, options, [entry for entry, _ in chosen])
    _, lines = written(options, asked, report.of_comparison(result))
    write_output(
        report.summary(result), "\n".join([comparison_text(result), *unturned(options, result.word), *lines]), options
    )
    if any(run.outcome.status != "converged" for run in result.runs):
        return SOLVER_FAILED
    return VERDICT_FAIL if result.word == "fail" else DONE


def unturned(options: argparse.Namespace, word: str) -> list[str]:
    """A line where the negative control was to turn the verdict, and did not."""
    if not options.negative_control or word == "fail":
        return []
    why = "what it changes is not judged here (compare judges candidates too), or matters too little"
    return [f"negative control: the verdict is {word} and was to be fail: {why}"]


def _asked(case: Case, options: argparse.Namespace, chosen: list[Candidate]) -> Asked:
    """The page of the case; where it has candidates and none is wanted, that of the reference alone."""
    alone = bool(case.candidate) and not chosen
    who = (Part((), "reference"),) if alone else candidates(case, chosen)
    return Asked("run" if alone else "compare", case.name, (case_part(case), *changes(options), *who), "report")
