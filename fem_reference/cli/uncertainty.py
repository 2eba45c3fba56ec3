"""The verb ``uncertainty``: the bands of results for unknown parameters of a case."""

import argparse

from fem_reference.assessment.uncertainty import facts
from fem_reference.cli import DONE, SOLVER_FAILED, out
from fem_reference.cli._cases import asked, muscle_case, publish
from fem_reference.cli._parser import positive, share
from fem_reference.report import uncertainty_page
from fem_reference.report.asked import Part
from fem_reference.studies import uncertainty
from fem_reference.studies.campaign import Workers

HELP = "vary the unknown parameters of a case within their ranges, and write the page of bands and sensitivities"
RUNS = 64


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    many = f"number of runs of the reference, at the case's quick size (default: {RUNS})"
    parser.add_argument("--runs", type=positive, default=RUNS, metavar="N", help=many)
    parser.add_argument("--seed", type=positive, default=1, metavar="N", help="seed of the sampling (default: 1)")
    share(parser, "--workers", "--scheduler", "--name")


def run(options: argparse.Namespace) -> int:
    """Solve a case with varied parameters, at its quick size, which ``--set`` overrides, and write the page."""
    scene = muscle_case(options.case, options, quick=True)
    workers = Workers(options.workers, options.scheduler)
    found = uncertainty.study(scene, out(options) / "runs", workers, options.runs, options.seed)
    more = [Part(("--runs", str(options.runs)), f"runs{options.runs}")] if options.runs != RUNS else []
    more += [Part(("--seed", str(options.seed)), f"seed{options.seed}")] if options.seed != 1 else []
    wanted = asked("uncertainty", scene, options, "uncertainty", *more)
    publish(options, wanted, uncertainty_page.page(found), facts(found), uncertainty_page.text(found))
    return SOLVER_FAILED if found.refused or any(band.refused for band in found.bands) else DONE
