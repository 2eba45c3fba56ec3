"""The verb ``show``: the parts of a case."""

import argparse

from fem_reference.cli import DONE, write_output
from fem_reference.cli._cases import checked_bench, lines, own_candidates, scene_of
from fem_reference.cli._parser import share
from fem_reference.report.overview import case_facts

HELP = "show the parts of a case; with --out write its meshes for ParaView"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")


def run(options: argparse.Namespace) -> int:
    """Print the parts of a case."""
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
