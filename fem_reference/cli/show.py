"""The verb ``show``: what a case is made of."""

import argparse

from fem_reference.cli import DONE, write_output
from fem_reference.cli._cases import checked_bench, lines, own_candidates, scene_of
from fem_reference.cli._parser import share
from fem_reference.report.overview import case_facts

HELP = "what a case is made of; with --out also its meshes for ParaView"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    share(parser, "case", "--set")


def run(options: argparse.Namespace) -> int:
    """Say what a case is made of."""
    scene = scene_of(options)
    bench = checked_bench(scene, options, own_candidates(scene))
    facts = case_facts(scene, bench.setup())
    if options.out is not None:
        built, folder = bench.problem(), options.out / scene.name
        folder.mkdir(parents=True, exist_ok=True)
        built.write_meshes(folder)
        facts |= {"mesh": built.mesh_facts, "folder": str(folder)}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE
