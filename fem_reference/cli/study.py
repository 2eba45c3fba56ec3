"""The verb ``study``: error against time on cases."""

import argparse
from dataclasses import replace

from fem_reference import solvers
from fem_reference.assessment.cost_study import facts
from fem_reference.cli import DONE, SOLVER_FAILED, out
from fem_reference.cli._cases import asked, case_part, changes, command_parts, own_solver, publish
from fem_reference.cli._parser import CASE, share
from fem_reference.report import study_page
from fem_reference.report.asked import Asked, Part, written
from fem_reference.scenes import casefile
from fem_reference.scenes.case import COMMAND
from fem_reference.studies import cost
from fem_reference.studies.campaign import Workers

PAGE = "study"
HELP = "measure error against time: reference and candidates over series of settings; write a page"


def add_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("cases", metavar="CASE", nargs="+", help=CASE)
    change = "change a key of every case, such as muscle.tet_size='8 mm'; may be repeated"
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=change)
    share(parser, "--workers", "--scheduler")
    only = "only this solver; may be repeated (default: the reference and every candidate)"
    parser.add_argument("--solver", default=[], choices=solvers.names("solve"), metavar="NAME", help=only)
    share(parser, "--solver-command", "--name")


def run(options: argparse.Namespace) -> int:
    """Measure the cost of accuracy on cases; write a page for each case and, for several cases, a common page."""
    given = dict(map(casefile.setting, options.set))
    scenes = [casefile.read_muscle(case, given) for case in options.cases]
    own = own_solver(options, [one for scene in scenes for one in scene.candidate])
    scenes = [scene.model_copy(update={"candidate": (*scene.candidate, *own)}) for scene in scenes]
    workers, only = Workers(options.workers, options.scheduler), [*options.solver]
    if only and own:
        only.append(COMMAND)
    found = cost.study(scenes, out(options) / "runs", workers, only)
    more = [*(Part(("--solver", name), name) for name in options.solver), *command_parts(own)]
    pages_of = {scene.name: asked("study", scene, options, PAGE, *more) for scene in scenes}
    pages = [(pages_of[case.case], study_page.page(replace(found, cases=(case,), missing={}))) for case in found.cases]
    if len(pages) != 1:
        named = [Part(case_part(scene).words, scene.name) for scene in scenes]
        pages.append((Asked("study", PAGE, (*named, *changes(options), *more)), study_page.page(found)))
    for one, page in pages[:-1]:
        written(one, page, out(options))
    printed = {"cases": [facts(case, found.origin) for case in found.cases], "missing": found.missing}
    publish(options, *pages[-1], printed, study_page.text(found))
    return SOLVER_FAILED if found.missing else DONE
