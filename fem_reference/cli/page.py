"""The verb ``page``: a page about several cases."""

import argparse
from collections.abc import Callable, Iterable
from pathlib import Path

from fem_reference import report
from fem_reference.assessment import credibility
from fem_reference.assessment.claims import Cover
from fem_reference.cli import DONE, SOLVER_FAILED, _cases, out, write_output
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.report import claims_page, credibility_page, estimation_page, field_page, ranking_page
from fem_reference.report.asked import Asked, Part, written
from fem_reference.report.overview import comparison_text
from fem_reference.report.words import listed
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Candidate
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx, recorded
from fem_reference.studies import cube_fits, estimation, moment_arms, table_5_1, true_errors
from fem_reference.studies.execution import Bench
from fem_reference.verification import runner
from fem_reference.verification.lab import lab

HELP = "write a page about several cases"
TABLE = "table-5-1"
CLAIMS = "error-bars"
EXAMPLES = "octave-examples"
ESTIMATION = "estimation"
CREDIBILITY = "credibility"
OCTAVE = ("rod", "rod_advection", "plate_square", "plate_spiral", "surface_figure")


def add_options(parser: argparse.ArgumentParser) -> None:
    names = sorted(_PAGES)
    parser.add_argument("name", metavar="NAME", choices=names, help=f"one of {', '.join(names)}")
    some = f"for {TABLE}, {CLAIMS} and {ESTIMATION}: only this case (default: all); may be repeated"
    parser.add_argument("--case", action="append", default=[], metavar="CASE", help=some)
    foreign = f"for {TABLE}: frames that your solver computed for a case; may be repeated"
    parser.add_argument("--candidate", action="append", default=[], metavar="CASE=DIR", help=foreign)
    solving = f"for {ESTIMATION}: also solve the reference with each decomposition into fibres"
    parser.add_argument("--solve", action="store_true", help=solving)
    size = f"for {TABLE} and {ESTIMATION}: solve the cases at their quick sizes"
    parser.add_argument("--quick", action="store_true", help=size)
    share(parser, "--set", "--error-bar", "--solver-command", "--unit", "--name")


def run(options: argparse.Namespace) -> int:
    """Write a page about several cases."""
    takes, write = _PAGES[options.name]
    for option in ("case", "candidate", "unit", "solver_command", "set", "quick", "error_bar", "solve"):
        if getattr(options, option) and option not in takes:
            others = listed([name for name, (taken, _) in _PAGES.items() if option in taken])
            got = f"--{option.replace('_', '-')} for {options.name}"
            raise InputError("page", got, f"this option for {others} only")
    return write(options)


def _examples(options: argparse.Namespace) -> int:
    cases = [casefile.read(name) for name in OCTAVE]
    benches = [_cases.checked_bench(case, options, _cases.own_candidates(case)) for case in cases]
    with fenicsx.shared():
        results = tuple(_cases.judged(bench, options, _cases.own_candidates(bench.scene)) for bench in benches)
    page = field_page.page("The report's Octave examples", results)
    path, lines = written(_asked([], options), page, out(options), options.page_name)
    facts = {"page": str(path), "cases": [report.summary(result) for result in results]}
    texts = [f"{result.scene.title}:\n{comparison_text(result)}" for result in results]
    write_output(facts, "\n\n".join([*texts, "\n".join(lines)]), options)
    return _cases.status(results)


def _table(options: argparse.Namespace) -> int:
    """Compare the kinds of solvers in the report's Table 5.1, and write the page."""
    scenes = {scene.name: scene for scene in _scenes(options, table_5_1.SCENARIOS)}
    foreign = _foreign(options, list(scenes))
    for name in scenes if options.case else foreign:
        Bench(scenes[name], out(options)).setup()  # raises an error if a case that the user has named lacks its data
    own = _cases.own_solver(options)
    for name in scenes if own else ():
        foreign.setdefault(name, []).extend(own)
        _cases.check_names([one.name for one in foreign[name]])
    with fenicsx.shared():
        table = table_5_1.stand(scenes.values(), out(options) / "runs", foreign, error_bars=options.error_bar)
    pairs = [(case, one) for case, found in foreign.items() for one in found if one not in own]
    more = [Part(("--candidate", f"{case}={one.settings['folder']}"), f"{case}={one.name}") for case, one in pairs]
    asked = _asked(scenes.values(), options, [*more, *_cases.command_parts(own)])
    _cases.publish(options, asked, ranking_page.page(table), ranking_page.facts(table), ranking_page.text(table))
    return DONE if all(one.reference.status == "converged" for one in table.scenarios) else SOLVER_FAILED


def _claims(options: argparse.Namespace) -> int:
    scenes = _scenes(options, true_errors.CASES)
    found = true_errors.stake(scenes, out(options) / "runs")
    whole = Cover.of(found.claims)
    covered = f"{100 * whole.share:.1f} % cover the difference from a finer solution, median ratio {whole.median:.2f}"
    printed = [f"{whole.count} error bars: {covered}"]
    printed += [f"left out: {case}: {why}" for case, why in found.missing.items()]
    asked = _asked(scenes, options)
    _cases.publish(options, asked, claims_page.page(found), claims_page.facts(found), "\n".join(printed))
    return SOLVER_FAILED if found.missing else DONE


def _estimation(options: argparse.Namespace) -> int:
    scenes = _scenes(options, estimation.CASES)
    with fenicsx.shared():
        found = estimation.estimate(scenes, out(options) / "runs" if options.solve else None)
    if not found.fits:
        got = "; ".join(f"{case}: {why}" for case, why in found.missing.items())
        raise InputError(ESTIMATION, f"no case that can be measured ({got})", "one whose files are installed")
    printed = [estimation_page.said(found), *(f"left out: {case}: {why}" for case, why in found.missing.items())]
    page = estimation_page.page(found)
    asked = _asked(scenes, options, [Part(("--solve",), "solved")] if options.solve else [])
    _cases.publish(options, asked, page, estimation_page.facts(found), "\n".join(printed))
    return DONE


def _credibility(options: argparse.Namespace) -> int:
    """Write the page of the evidence for each quantity, with moment arms if the anatomy is installed."""
    with fenicsx.shared():
        arms, missing = moment_arms.beside(out(options) / "runs")
    entries = runner.entries().values()
    measured = runner.run([one for one in entries if one.kind == "experiment"], lab)
    results = {one.entry.name: one for one in measured}
    rows = tuple(credibility.row(claim, entries, results, arms) for claim in credibility.claims())
    fits = (cube_fits.shipped_law(), cube_fits.collagen_law())
    found = credibility.Credibility(rows, arms, missing, fits)
    printed = [credibility_page.said(found), *(f"left out: {case}: {why}" for case, why in missing.items())]
    page = credibility_page.page(found)
    _cases.publish(options, _asked([], options), page, credibility_page.facts(found), "\n".join(printed))
    return DONE


_PAGES: dict[str, tuple[tuple[str, ...], Callable[[argparse.Namespace], int]]] = {
    TABLE: (("case", "candidate", "unit", "solver_command", "set", "quick", "error_bar"), _table),
    CLAIMS: (("case",), _claims),
    ESTIMATION: (("case", "set", "quick", "solve"), _estimation),
    CREDIBILITY: ((), _credibility),
    EXAMPLES: ((), _examples),
}


def _scenes(options: argparse.Namespace, names: Iterable[str]) -> list[MuscleCase]:
    """The requested cases or, without a request, the cases ``names``."""
    return [_cases.muscle_case(name, options, quick=options.quick) for name in options.case or names]


def _asked(scenes: Iterable[MuscleCase], options: argparse.Namespace, more: Iterable[Part] = ()) -> Asked:
    cases = [Part(("--case", _cases.case_part(scene).words[0]), scene.name) for scene in scenes if options.case]
    size = [Part(("--quick",), "quick")] if options.quick else []
    return Asked("page", options.name, (Part((options.name,)), *cases, *size, *_cases.changes(options), *more))


def _foreign(options: argparse.Namespace, cases: list[str]) -> dict[str, list[Candidate]]:
    """Frames of external solvers, by the name of the case."""
    found = dict[str, list[Candidate]]()
    for text in options.candidate:
        case, equals, folder = text.partition("=")
        if not equals:
            raise InputError("--candidate", f'"{text}"', "CASE=DIR, a case and a folder with frames for it")
        if not folder:
            raise InputError("--candidate", '""', "a folder of frames")
        name = casefile.read_muscle(case).name
        if name not in cases:
            raise InputError("--candidate", f'"{case}"', f"one of {', '.join(cases)}")
        found.setdefault(name, []).append(recorded.choice(Path(folder), options.unit, "--candidate"))
        _cases.check_names([candidate.name for candidate in found[name]])
    return found
