"""Pages of the command line: the parts of a command that determine them, and where they are written."""

import argparse
from collections.abc import Iterable
from typing import Any

from fem_reference import report
from fem_reference.assessment.comparison import Comparison
from fem_reference.cli._choosing import check_names, checked_bench, refuse_error_bar
from fem_reference.cli._printing import DONE, SOLVER_FAILED, VERDICT_FAIL, out, write_output
from fem_reference.report.asked import Asked, Part, written
from fem_reference.report.overview import comparison_text
from fem_reference.report.pages import Page
from fem_reference.scenes.case import HOME, Candidate, Case
from fem_reference.solvers import fenicsx
from fem_reference.studies import judging


def case_part(case: Case) -> Part:
    """The case of a page: by its name where it is a shipped one, else by its folder."""
    return Part((case.name if case.folder.parent == HOME / "cases" else str(case.folder),))


def changes(options: argparse.Namespace) -> tuple[Part, ...]:
    """The changes of a case by ``--set`` and ``--negative-control``."""
    control = (Part(("--negative-control",), "negative_control"),) if options.negative_control is True else ()
    return (*(Part(("--set", text), text) for text in getattr(options, "set", ())), *control)


def candidates(case: Case, chosen: Iterable[Candidate]) -> tuple[Part, ...]:
    """The candidates of a page; nothing where they are the case's own."""
    found = tuple(chosen)
    if found == case.candidate:
        return ()
    foreign = [one.solver == "recorded" and one not in case.candidate for one in found]
    words = [one.settings["folder"] if read else one.name for one, read in zip(found, foreign, strict=True)]
    return tuple(Part(("--candidate", word), one.name) for word, one in zip(words, found, strict=True))


def publish(options: argparse.Namespace, asked: Asked, page: Page, facts: dict[str, Any], text: str) -> None:
    """Print ``text`` (``facts`` as JSON), and write a page into ``--out``, by ``--name`` where that is given."""
    write_output(facts, text, options)  # also where the page fails
    print(*written(asked, page, out(options), options.page_name)[1], sep="\n")


def judge(case: Case, options: argparse.Namespace, chosen: list[tuple[Candidate, str]]) -> int:
    """Measure and judge the ``chosen`` candidates, and write the page; where the case has candidates and none is wanted, that of
    the reference alone. What is bad in the input shows before anything is solved.
    """
    entries = [entry for entry, _ in chosen]
    refuse_error_bar(case, options)
    check_names([entry.name for entry in entries])
    with fenicsx.shared():
        result = judging.judged(checked_bench(case, options, chosen), chosen, error_bars=options.error_bar)
    alone = bool(case.candidate) and not chosen
    who = (Part((), "reference"),) if alone else candidates(case, entries)
    asked = Asked("run" if alone else "compare", case.name, (case_part(case), *changes(options), *who), "report")
    text = "\n".join([comparison_text(result), *unturned(options, result.word)])
    publish(options, asked, report.of_comparison(result), report.summary(result), text)
    return status([result])


def unturned(options: argparse.Namespace, word: str) -> list[str]:
    """A line where the negative control was to turn the verdict, and did not."""
    if not options.negative_control or word == "fail":
        return []
    why = "what it changes is not judged here (compare judges candidates too), or matters too little"
    return [f"negative control: the verdict is {word} and was to be fail: {why}"]


def status(results: Iterable[Comparison]) -> int:
    """The exit status of comparisons."""
    found = tuple(results)
    if any(run.outcome.status != "converged" for result in found for run in result.runs):
        return SOLVER_FAILED
    return VERDICT_FAIL if any(result.word == "fail" for result in found) else DONE
