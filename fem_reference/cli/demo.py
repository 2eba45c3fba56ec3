"""The verb ``demo``: the case hip_flexion with all its candidates."""

import argparse

from fem_reference.cli._cases import compared, own_candidates
from fem_reference.cli._parser import share
from fem_reference.scenes import casefile

MAIN_JOB = "hip_flexion"
HELP = "compare the candidates of the case hip_flexion with its reference"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "--ranks", "--name")


def run(options: argparse.Namespace) -> int:
    """Solve the case and all its candidates."""
    scene = casefile.read(MAIN_JOB)
    return compared(scene, options, own_candidates(scene))
