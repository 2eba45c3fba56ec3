"""The verb ``compare``: candidates against the reference."""

import argparse
from pathlib import Path

from fem_reference import solvers
from fem_reference.cli._against import against
from fem_reference.cli._choosing import choose, scene_of, with_limits
from fem_reference.cli._judging import judge
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError

HELP = "measure candidates against the reference and write the page"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    share(parser, "case", "--set")
    either = "a candidate of the case or a folder of frames; may be repeated"
    parser.add_argument("--candidate", action="append", metavar="NAME|DIR", help=either)
    ours = "a solver of ours as a candidate, with its standard settings where the case has none; may be repeated"
    parser.add_argument("--solver", action="append", default=[], metavar="NAME", help=ours)
    past = "what the candidate was, and write the page of what changed: a baseline of check, a stored run, a folder of frames"
    parser.add_argument("--against", type=Path, metavar="BASELINE", help=past)
    share(parser, "--unit")
    limit = (
        "judge every candidate: how far a statistic may deviate, such as surface_deviation.max='5 mm'; may be repeated"
    )
    parser.add_argument("--limit", action="append", default=[], metavar="METRIC.STATISTIC=VALUE", help=limit)
    share(parser, "--error-bar", "--negative-control", "--name", "--ranks")


def run(options: argparse.Namespace) -> int:
    """Measure candidates against the reference."""
    scene = with_limits(scene_of(options), options.limit)
    known = solvers.names(scene.task)
    for name in options.solver:
        if name not in known:
            raise InputError("--solver", f'"{name}"', f"one of {', '.join(known)}")
    wanted = [*(options.candidate or []), *options.solver] or [candidate.name for candidate in scene.candidate]
    chosen = [choose(scene, text, options.unit) for text in wanted]
    return judge(scene, options, chosen) if options.against is None else against(scene, options, chosen)
