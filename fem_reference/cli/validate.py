"""The verb ``validate``: all checks of a case before it is solved."""

import argparse
from typing import Any

from fem_reference import solvers
from fem_reference.cli import DONE, write_output
from fem_reference.cli._cases import checked_bench, lines, own_candidates, scene_of
from fem_reference.cli._parser import share
from fem_reference.problems import of_case
from fem_reference.report.words import duration
from fem_reference.scenes import casefile
from fem_reference.studies.features import expected

HELP = "make all checks of a case that are possible before it is solved, and estimate the cost of solving it"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options; the verb writes nothing into ``--out``."""
    parser.set_defaults(writes=False)
    share(parser, "case", "--set")


def run(options: argparse.Namespace) -> int:
    """Read, set up and mesh a case, check the settings of its solvers, and print the facts."""
    scene = scene_of(options)
    if scene.negative_control is not None and scene.from_file:
        casefile.read(options.case, with_negative_control=True)
    bench = checked_bench(scene, options, own_candidates(scene))
    for choice, place in [(scene.reference, "reference"), *own_candidates(scene)]:
        solvers.find(choice.solver, place, scene.task).require(bench.settings(choice, place))
    body = bench.problem().body
    facts: dict[str, Any] = {"case": scene.name, "read": scene.place, "mesh": bench.problem().mesh_facts}
    facts |= of_case.known(scene, bench.setup())
    if scene.reference.solver == "fenicsx" and body is not None:
        cost = expected(body, bench.settings(scene.reference, "reference"))
        time = f"about {duration(cost.seconds)} of processor time, within a factor of three, for {len(scene.numbers)} frames"
        facts |= {"unknowns": cost.unknowns, "cost": f"{time}; {cost.megabytes / 1000:.1f} GB of memory"}
    write_output(facts, "\n".join([*lines(facts), f"{scene.name} can be solved"]), options)
    return DONE
