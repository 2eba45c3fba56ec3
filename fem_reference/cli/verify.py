"""The verb ``verify``: problems whose answers are known."""

import argparse
import time

from fem_reference.assessment.catalogue import Verification
from fem_reference.cli import DONE, SOLVER_FAILED, VERDICT_FAIL
from fem_reference.cli._cases import publish
from fem_reference.cli._parser import share
from fem_reference.foundations.subprocesses import MachineTime, spent_since
from fem_reference.foundations.version import __version__
from fem_reference.report import verify_page
from fem_reference.report.asked import Asked, Part
from fem_reference.runs.key import versions
from fem_reference.verification import runner

HELP = "measure the errors of problems with known answers, and write a page"


def add_options(parser: argparse.ArgumentParser) -> None:
    known = "an entry, a group or a shell pattern of entries (default: all)"
    parser.add_argument("names", metavar="NAME", nargs="*", help=known)
    control = "measure this entry with its deliberate mistake, which must make it fail; may be repeated"
    parser.add_argument("--negative-control", action="append", default=[], metavar="NAME", help=control)
    share(parser, "--name")


def run(options: argparse.Namespace) -> int:
    """Measure the errors of all problems with known answers, or of the named ones."""
    from fem_reference.verification.lab import lab  # loads the solvers

    catalogue = runner.entries()
    wrong = frozenset(runner.choose(catalogue, options.negative_control, "--negative-control"))
    meant = {*runner.choose(catalogue, options.names, "NAME"), *wrong}
    begin, clock = time.perf_counter(), MachineTime.now()
    results = runner.run([entry for name, entry in catalogue.items() if name in meant or not meant], lab, wrong)
    made_with = {"fem_reference": __version__, **versions(), **spent_since(clock)}
    measured = Verification(results, time.perf_counter() - begin, made_with)
    parts = [Part((name,), name) for name in options.names]
    parts += [Part(("--negative-control", name), f"negative_control={name}") for name in options.negative_control]
    asked = Asked("verify", "verify", tuple(parts))
    publish(options, asked, verify_page.page(measured), verify_page.facts(measured), verify_page.text(measured))
    return {"failed": SOLVER_FAILED, "fail": VERDICT_FAIL}.get(measured.word, DONE)
