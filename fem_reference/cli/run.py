"""The verb ``run``: solve a case with its reference, or with another solver."""

import argparse

from fem_reference import solvers
from fem_reference.assessment.comparison import alone
from fem_reference.assessment.judge import check
from fem_reference.cli import DONE, SOLVER_FAILED, VERDICT_FAIL, out, write_output
from fem_reference.cli._cases import compared, scene_of, unturned
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.problems import of_case
from fem_reference.report.overview import run_text
from fem_reference.report.tables import of_run
from fem_reference.studies.execution import Bench

HELP = "solve a case and judge its expectations of the reference"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    parser.add_argument("--solver", metavar="NAME", help="a solver other than the case's own reference")
    share(parser, "--error-bar", "--ranks", "--negative-control", "--name")
    explain = "report whether and why the case needs each effect, without solving it"
    parser.add_argument("--explain", action="store_true", help=explain)


def run(options: argparse.Namespace) -> int:
    """Solve a case, and judge its expectations of the reference; for another solver, only expectations that need no reference."""
    scene = scene_of(options)
    if options.explain:
        found = [str(one) for one in scene.decisions or of_case.explained(scene)] or ["all effects act"]
        write_output({"case": scene.name, "effects": found}, "\n".join(found), options)
        return DONE
    if options.solver is None or options.solver == scene.reference.solver:
        return compared(scene, options, [])
    if options.error_bar:
        raise InputError("--error-bar", "another solver", "the reference of a muscle")
    check(scene)
    bench = Bench(scene, out(options) / "runs", options.ranks)
    solved = bench.obtain(*solvers.choice(scene, options.solver), f"--solver {options.solver}")
    result = alone(scene, bench.setup(), solved)
    text = "\n".join([run_text(solved, result), *unturned(options, result.word)])
    write_output(of_run(scene, solved, result), text, options)
    if solved.outcome.status != "converged":
        return SOLVER_FAILED
    return VERDICT_FAIL if result.word == "fail" else DONE
