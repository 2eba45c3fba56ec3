"""The verb ``check``: compare a candidate with its earlier results and with the reference, for continuous integration.

An inconclusive result has exit status 0, because the change under test is not responsible for the error bar of the reference. The
printed text and the Markdown file report such a result as inconclusive; the JUnit file reports it as skipped.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

from fem_reference.assessment import baseline, regression
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.cli import DONE, SOLVER_FAILED, VERDICT_FAIL, write, write_output
from fem_reference.cli._cases import checked_bench, choose, scene_of
from fem_reference.cli._parser import share
from fem_reference.report import regression_texts
from fem_reference.scenes import casefile
from fem_reference.studies import arguments, by_muscle, muscle_bars

HELP = "compare a candidate with its earlier results and with the reference, for continuous integration"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    either = "name of a candidate of the case, or a folder of frames"
    parser.add_argument("--candidate", required=True, metavar="NAME|DIR", help=either)
    share(parser, "--unit")
    one = "muscle to check, if the case has several; the reference solves all muscles together, a candidate only this muscle"
    parser.add_argument("--muscle", default="", metavar="NAME", help=one)
    past = "JSON file with the earlier results of the candidate"
    parser.add_argument("--baseline", type=Path, required=True, metavar="FILE", help=past)
    anew = "replace the results in the baseline with the current results; keep the tolerances and limits"
    parser.add_argument("--update", action="store_true", help=anew)
    parser.add_argument("--junit", type=Path, metavar="FILE", help="write all verdicts to FILE as JUnit XML")
    parser.add_argument(
        "--markdown", type=Path, metavar="FILE", help="write the worst verdicts to FILE, for a pull request"
    )
    share(parser, "--error-bar", "--ranks")


def run(options: argparse.Namespace) -> int:
    """Check a candidate against its baseline and the reference. With ``--update``, first update the baseline."""
    begin = time.perf_counter()
    case, muscle = scene_of(options), options.muscle
    arguments.check_muscle(muscle, case, "--muscle")
    if not muscle:
        casefile.muscle(case, "CASE")
    entry, place = choose(case, options.candidate, options.unit)
    whole = checked_bench(case, options, [(entry, place)])
    bench = whole.parts[muscle] if muscle else whole.of_muscle()
    scene, entry = bench.scene, by_muscle.of_part(whole.found(entry, place), place, muscle) if muscle else entry
    # Report errors in the baseline file before solving anything.
    (baseline.check if options.update else baseline.read)(options.baseline, scene, entry.name)
    candidate = bench.obtain(entry.name, entry, place)  # before the reference, because the candidate may be invalid
    solved = whole.reference()
    # The folder is that of the run of all muscles. The baseline stores its name, which contains a hash of the scene, the settings
    # and the code. If a neighbouring muscle has changed, the name differs from the stored name, and ``check`` reports this.
    reference = replace(by_muscle.split(whole, solved)[muscle], folder=solved.folder) if muscle else solved
    failed = [one for one in (reference, candidate) if one.outcome.status != "converged"]
    if failed:
        why = [f"{one.name}: {one.outcome.status}, {one.outcome.message}" for one in failed]
        facts = {"case": scene.name, "candidate": candidate.name, "verdict": "failed", "notes": why, "judgements": []}
        junit, markdown = regression_texts.lost(scene.name, candidate.name, why)
        write(options.junit, junit)
        write(options.markdown, markdown)
        write_output(facts, "\n".join([*why, "verdict: failed"]), options)
        return SOLVER_FAILED
    bars = muscle_bars.offered(whole, solved, muscle, asked=options.error_bar)
    current = CurrentMeasures.of(scene, bench.setup(), candidate, reference, bars)
    if options.update:
        baseline.update(options.baseline, current)
    result = regression.check(baseline.read(options.baseline, scene, candidate.name), current)
    write(options.junit, regression_texts.junit(result, time.perf_counter() - begin))
    write(options.markdown, regression_texts.markdown(result))
    write_output(regression_texts.facts(result), regression_texts.text(result), options)
    return VERDICT_FAIL if result.word == "fail" else DONE
