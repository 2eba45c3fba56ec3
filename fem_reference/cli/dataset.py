"""The verb ``dataset``: a data set of solved and checked muscles for machine learning."""

import argparse
from pathlib import Path

from fem_reference.cli import DONE, out, write_output
from fem_reference.cli._parser import positive, share
from fem_reference.studies import dataset
from fem_reference.studies.campaign import Workers

HELP = "build a data set for machine learning: random muscles and shipped cases, solved and checked, with hashes and splits"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for the folder and the sizes."""
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="a new folder, or one of an interrupted build")
    parser.add_argument("--muscles", type=positive, default=24, metavar="N", help="random muscles (default: 24)")
    parser.add_argument(
        "--poses", type=positive, default=12, metavar="N", help="poses of each muscle in addition to rest (default: 12)"
    )
    parser.add_argument("--seed", type=positive, default=1, metavar="N", help="seed of the random numbers (default: 1)")
    share(parser, "--workers", "--scheduler")


def run(options: argparse.Namespace) -> int:
    """Build the data set, and print its contents and the muscles that were left out."""
    wanted = dataset.Sizes(options.muscles, options.poses, options.seed)
    workers = Workers(options.workers, options.scheduler)
    found = dataset.build(options.folder, wanted, out(options) / "runs", workers)
    left = found["left_out"]
    assert isinstance(left, dict)
    facts = {key: found[key] for key in ("scenes", "frames", "left_out", "left_out_share")}
    lines = [f"{options.folder}: {found['scenes']} scenes, {found['frames']} frames; load.py in this folder reads them"]
    lines += [f"left out: {name}: {why}" for name, why in left.items()]
    write_output({"folder": str(options.folder), **facts}, "\n".join(lines), options)
    return DONE
