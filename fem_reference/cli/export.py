"""The verb ``export``: a case for a solver that is not ours."""

import argparse
from pathlib import Path

from fem_reference.cli._choosing import scene_of
from fem_reference.cli._parser import add_case
from fem_reference.cli._printing import DONE, lines, out, write_output
from fem_reference.export import FORMATS, export
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench

HELP = "write all that a solver needs which is not ours, in open formats"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb: where to, and in which formats."""
    add_case(parser)
    parser.add_argument(
        "--to", type=Path, required=True, metavar="DIR", help="a folder that is not there yet, or empty"
    )
    forms = "open formats alone (default), or FEBio's own besides"
    parser.add_argument("--format", choices=FORMATS, default="open", help=forms)


def run(options: argparse.Namespace) -> int:
    """Write a case for a solver that is not ours."""
    scene = casefile.muscle(scene_of(options))
    bench = Bench(scene, out(options) / "runs")
    written = export(scene, bench.problem, options.to, options.format)
    facts = {"case": scene.name, "folder": str(options.to), "files": written}
    write_output(facts, "\n".join(lines(facts)), options)
    return DONE
