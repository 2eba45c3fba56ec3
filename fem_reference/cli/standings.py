"""The verb ``standings``: shipped solvers, external programs and submitted frames on several cases, on one page."""

import argparse
from pathlib import Path

from fem_reference.assessment.standings import STATES, load
from fem_reference.cli import DONE, SOLVER_FAILED, out
from fem_reference.cli._cases import muscle_case, publish
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.units import positive
from fem_reference.report import standings_page
from fem_reference.report.asked import Asked
from fem_reference.solvers import fenicsx
from fem_reference.studies import standings

HELP = "write the page of standings of shipped and external solvers on several cases; measure only new and changed rows"
PAGE = "standings"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "cases",
        metavar="CASE",
        nargs="*",
        help=f"a case (default: {', '.join(standings.CASES)}; the last five need the data below FEM_REFERENCE_DATA)",
    )
    program = (
        "a folder NAME with a program NAME.py and its candidate.toml, such as candidates/newton_vbd; may be repeated"
    )
    parser.add_argument("--program", action="append", default=[], type=Path, metavar="DIR", help=program)
    submitted = "a folder of frames; candidate.toml states case, name, version, sha256; no code is run; may be repeated"
    parser.add_argument("--submission", action="append", default=[], type=Path, metavar="DIR", help=submitted)
    only = f"measure only new rows and the rows in these states ({','.join(STATES)}); keep all others"
    parser.add_argument("--only", default="", metavar="STATES", help=only)
    limit = "limit on a solver's processor time per case (not the reference's); slower solvers have no rank (default: %(default)s)"
    parser.add_argument("--time-limit", default=f"{standings.TIME_LIMIT:g} s", metavar="TIME", help=limit)
    parser.add_argument("--quick", action="store_true", help="solve the cases at their quick sizes")
    share(parser, "--set", "--name")


def run(options: argparse.Namespace) -> int:
    """Measure new and changed rows, and write the page."""
    limit = _time(options.time_limit)
    only = {state for state in options.only.split(",") if state}
    if not only <= {*STATES}:
        raise InputError("--only", f'"{options.only}"', f"one or more of {','.join(STATES)}")
    cases = [muscle_case(case, options, quick=options.quick) for case in options.cases or standings.CASES]
    entrants = [standings.program(folder) for folder in options.program]
    entrants += [standings.submission(folder) for folder in options.submission]
    if (options.quick or options.set) and any(one.case and not one.scene for one in entrants):
        want = "the cases as they are published, or the scene that the export states in its candidate.toml"
        raise InputError("--submission", "this option with --quick or --set", want)
    before = load(out(options) / f"{options.page_name or PAGE}.json")
    with fenicsx.shared():
        found = standings.stand(cases, out(options) / "runs", entrants, before, only, limit)
    page = standings_page.page(found)
    publish(options, Asked(PAGE, PAGE), page, page.numbers, standings_page.text(found))
    return SOLVER_FAILED if found.missing else DONE


def _time(text: str) -> float:
    """The time limit [s]."""
    try:
        return positive(text, "a time")
    except ValueError as error:
        raise InputError("--time-limit", f'"{text}"', str(error)) from error
