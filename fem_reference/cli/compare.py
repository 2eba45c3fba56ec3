"""The verb ``compare``: candidates against the reference."""

import argparse

from fem_reference.cli._choosing import choose, scene_of, with_limits
from fem_reference.cli._judging import judge
from fem_reference.cli._parser import UNIT, add_case, add_error_bar, add_name, add_negative_control, add_ranks

HELP = "measure candidates against the reference and write the page"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_case(parser)
    either = "a candidate of the case or a folder of frames; may be repeated"
    parser.add_argument("--candidate", action="append", metavar="NAME|DIR", help=either)
    parser.add_argument("--unit", help=UNIT)
    limit = (
        "judge every candidate: how far a statistic may deviate, such as surface_deviation.max='5 mm'; may be repeated"
    )
    parser.add_argument("--limit", action="append", default=[], metavar="METRIC.STATISTIC=VALUE", help=limit)
    add_error_bar(parser)
    add_negative_control(parser)
    add_name(parser)
    add_ranks(parser)


def run(options: argparse.Namespace) -> int:
    """Measure candidates against the reference."""
    scene = with_limits(scene_of(options), options.limit)
    wanted = options.candidate or [candidate.name for candidate in scene.candidate]
    return judge(scene, options, [choose(scene, text, options.unit) for text in wanted])
