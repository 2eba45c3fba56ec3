"""The verb ``calibrate``: parameters of a case fitted to measurements."""

import argparse
from pathlib import Path

from fem_reference.assessment.calibration import facts
from fem_reference.cli import DONE, SOLVER_FAILED, VERDICT_FAIL, out, write_output
from fem_reference.cli._cases import muscle_case
from fem_reference.cli._parser import share
from fem_reference.report import calibration_texts
from fem_reference.studies import calibration
from fem_reference.studies.campaign import Workers

HELP = "fit parameters of a case to measured forces, lengths or positions, with confidence intervals"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    data = "CSV file with the columns frame, quantity, value, unit, sd"
    parser.add_argument("--to", type=Path, required=True, metavar="FILE", help=data)
    fit = "a parameter of the case that has a range, such as effect[0].mu; may be repeated"
    parser.add_argument("--fit", action="append", default=[], metavar="KEY", help=fit)
    share(parser, "--workers", "--scheduler")


def run(options: argparse.Namespace) -> int:
    """Fit parameters at the quick size of a case, which ``--set`` overrides. The exit status is 1 if a parameter is not determined,
    the law does not fit the data or the fit has not converged, and 3 if a run that the fit needs has failed.
    """
    scene = muscle_case(options.case, options, quick=True)
    workers = Workers(options.workers, options.scheduler)
    found = calibration.calibrate(scene, options.to, options.fit, out(options) / "runs", workers)
    write_output(facts(found), calibration_texts.text(found), options)
    if found.ended:
        return SOLVER_FAILED
    return DONE if found.holds else VERDICT_FAIL
