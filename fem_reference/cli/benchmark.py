"""The verb ``benchmark``: how fast the candidates are, or the reference, alone or against its peers."""

import argparse
import os

from fem_reference.cli._parser import positive
from fem_reference.cli._printing import DONE, SOLVER_FAILED, out, write_output
from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.studies.benchmark import against_peers, candidates, checkout, peer_table, reference, reference_table
from fem_reference.studies.execution import Bench

TIMED, TIMED_WITH_DATA = ("hip_flexion", "box_squeeze"), ("gluteus_maximus", "box_squeeze_report")


HELP = "time the solvers of Table 5.1 in processor time, beside the machine's own speed, or the reference by phase"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options that this verb has."""
    some = f"cases to time them on (default: {', '.join(TIMED_WITH_DATA)} where the data is, else {', '.join(TIMED)})"
    other = (
        f"with --reference cases as CASE or CASE:FRAME, the last frame, and {', '.join(reference.FUSIFORM)} or "
        f"{reference.ALL_FUSIFORM}, all of these (default: {reference.ALL_FUSIFORM} and, where the data is, "
        f"{', '.join(reference.WITH_DATA)})"
    )
    parser.add_argument("cases", metavar="CASE", nargs="*", help=f"{some}; {other}")
    timed = "time the finite element reference by phase instead"
    parser.add_argument("--reference", action="store_true", help=timed)
    commit = "with --reference: in turn with that of an earlier commit of this repository, and compare"
    parser.add_argument("--against", metavar="COMMIT", help=commit)
    others = "time the reference in turn with FElupe and SfePy instead, as far as they are installed"
    parser.add_argument("--peers", action="store_true", help=others)
    often = (
        f"with --reference or --peers: how often (default: {reference.REPEATS}, of a muscle {reference.REPEATS_OF_MUSCLE}; "
        "the first time, what is compiled is made beforehand)"
    )
    parser.add_argument("--repeats", type=int, metavar="N", help=often)
    ranks = "with --reference: MPI processes of a muscle (default: as run has it); fusiform bodies have 1"
    parser.add_argument("--ranks", type=positive, metavar="N", help=ranks)


def run(options: argparse.Namespace) -> int:
    """Time the solvers of Table 5.1, or the reference."""
    if options.peers:
        return _time_against_peers(options)
    if options.reference:
        return _time_reference(options)
    for name in ("against", "repeats", "ranks"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name}", getattr(options, name), "it with --reference only")
    cases = options.cases or (TIMED_WITH_DATA if os.environ.get(DATA_SETTING) else TIMED)
    benches = [Bench(casefile.read_muscle(case), out(options) / "runs") for case in cases]
    for bench in benches:
        candidates.check(bench.scene)
        bench.setup()  # what is missing shows before anything is timed
    timings, machine = candidates.measure(benches)
    write_output(candidates.facts(timings, machine), candidates.text(timings, machine), options)
    return DONE


def _time_reference(options: argparse.Namespace) -> int:
    names, left_out = (options.cases, {}) if options.cases else reference.default()
    against = None if options.against is None else checkout.find(options.against)
    timings = reference.measure(reference.bodies(names, options.repeats, options.ranks), against)
    facts = reference_table.facts(timings, against, left_out)
    write_output(facts, reference_table.text(timings, against, left_out), options)
    return DONE if all(timing.converged for timing in timings) else SOLVER_FAILED


def _time_against_peers(options: argparse.Namespace) -> int:
    refused = ("cases", "reference", "against", "ranks")
    for name in refused:
        if getattr(options, name):
            raise InputError("--peers", f"{name} too", f"nothing of {', '.join(refused)} with it")
    found = against_peers.measure(repeats=options.repeats)
    write_output(peer_table.facts(found), peer_table.text(found), options)
    return DONE if all(one.converged(name) for one in found for name in one.taken) else SOLVER_FAILED
