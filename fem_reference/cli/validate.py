"""The verb ``validate``: all that can be known of a case before it is solved."""

import argparse
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.cli._choosing import checked_bench, own_candidates, scene_of
from fem_reference.cli._parser import share
from fem_reference.cli._printing import DONE, lines, write_output
from fem_reference.problems import guess, of_case
from fem_reference.problems.muscle import Problem
from fem_reference.report.words import duration
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case
from fem_reference.studies import expected_cost

HELP = "check all of a case that can be checked before it is solved, and say what running it will cost"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options that this verb has; it writes nothing into ``--out``."""
    parser.set_defaults(writes=False)
    share(parser, "case", "--set")


def run(options: argparse.Namespace) -> int:
    """Read, set up and mesh a case, check the settings of every solver that it chooses, and say what there is."""
    scene = scene_of(options)
    if scene.negative_control is not None and scene.from_file:
        casefile.read(options.case, with_negative_control=True)
    bench = checked_bench(scene, options, own_candidates(scene))
    for choice, place in [(scene.reference, "reference"), *own_candidates(scene)]:
        solvers.require(choice.solver, bench.settings(choice, place), place, scene.task)
    built = bench.problem()
    facts = {"case": scene.name, "read": scene.place, "mesh": built.mesh_facts} | _facts(scene, built, bench)
    write_output(facts, "\n".join([*lines(facts), f"{scene.name} can be solved"]), options)
    return DONE


def _facts(scene: Case, built: Any, bench: Any) -> dict[str, Any]:
    """What more is known of the case of a muscle."""
    if not isinstance(built, Problem):
        return {}
    found = scene.decisions or of_case.explained(scene)
    known: dict[str, Any] = {}
    if motion := _motion(scene, built):
        known["motion"] = motion
    known["effects"] = {one.effect.title: str(one).partition(": ")[2] for one in found}
    settings: Any = bench.settings(scene.reference, "reference")
    if scene.reference.solver == "fenicsx":
        known["unknowns"] = expected_cost.unknowns(built, settings)
        seconds = duration(expected_cost.seconds("fenicsx", built, settings))
        known["cost"] = f"about {seconds} of processor time, within a factor of three, for {len(scene.numbers)} frames"
    return known


def _motion(scene: Case, built: Problem) -> str:
    """What the motion of the bones does to the muscle, in a sentence."""
    lengths = guess.spans(built, scene.numbers)
    if not len(lengths):
        return ""
    most = int(np.abs(lengths - lengths[0]).argmax())
    how = "longer" if lengths[most] > lengths[0] else "shorter"
    change = f"{100 * abs(lengths[most] / lengths[0] - 1):.0f} % {how}, in frame {scene.numbers[most]}"
    names = f"{built.attached[0].attachment} to {built.attached[-1].attachment}"
    return f"from {names} it is {lengths[0]:.4g} mm at rest, and at most {change}"
