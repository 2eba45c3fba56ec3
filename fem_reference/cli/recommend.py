"""The verb ``recommend``: a solver and setting within a limit of error or time, from the results of studies."""

import argparse
import math
import re

from fem_reference.assessment.answers import answers
from fem_reference.assessment.judge import in_unit
from fem_reference.assessment.recommendation import known_settings, recommend
from fem_reference.cli import DONE, VERDICT_FAIL, out, write_output
from fem_reference.cli._cases import scene_of
from fem_reference.cli._parser import share
from fem_reference.foundations.errors import InputError
from fem_reference.report.recommendation_texts import answer_facts, answer_texts, facts, text
from fem_reference.report.study_page import MAIN
from fem_reference.scenes import casefile
from fem_reference.studies import cost
from fem_reference.studies.execution import Bench
from fem_reference.studies.features import features

# The notations for frames per second, and for a time per frame.
_RATES = ("fps", "Hz", "frames/s", "1/s")
_PER_FRAME = re.compile(r"\s*(?:/|per)\s*frame\s*$")
HELP = "recommend a solver and setting within a limit of error or time, from the results of studies"


def add_options(parser: argparse.ArgumentParser) -> None:
    share(parser, "case", "--set")
    error = "the maximum error that you accept, in the unit of the metric, such as '2 mm' or '1 %%'"
    parser.add_argument("--error", metavar="VALUE", help=error)
    time = "the longest time per frame that you accept, such as '5 ms' or '60 fps'"
    parser.add_argument("--time", metavar="VALUE", help=time)
    metric = f"the statistic whose error counts (default: {MAIN})"
    parser.add_argument("--metric", default=MAIN, metavar="METRIC.STATISTIC", help=metric)


def run(options: argparse.Namespace) -> int:
    """Recommend a setting or, without limits, answer the usual requests; exit status 1 if no setting meets a request."""
    scene, metric = casefile.muscle(scene_of(options)), options.metric
    studies = cost.stored(out(options))
    units = {name: unit for study in reversed(studies) for name, unit in study.units.items()}
    if metric not in units:
        raise InputError("--metric", f'"{metric}"', f"one of {', '.join(sorted(units))}")
    limits = dict[str, float]()
    if options.error is not None:
        limits["error"] = _number(options.error, options.error, units[metric], "--error")
    if options.time is not None:
        given = options.time.rstrip()
        rate = next((unit for unit in _RATES if given.endswith(unit)), None)
        each = _PER_FRAME.sub("", given) if rate is None else given.removesuffix(rate)
        value = _number(options.time, each, "1" if rate else "s", "--time")
        limits["time"] = 1 / value if rate else value
    own = features(scene, Bench(scene, out(options) / "runs").setup())
    if not limits:
        every = answers(known_settings(own, scene.name, studies, metric).settings)
        lines = answer_texts(every, units[metric])
        write_output({"metric": metric, "answers": answer_facts(every)}, "\n".join(lines), options)
        return DONE if all(one.best for one in every[:-1]) else VERDICT_FAIL
    found = recommend(own, scene.name, studies, metric, limits)
    said = text(found, scene.name, metric, units[metric], limits.get("error", math.inf))
    write_output(facts(found, metric), said, options)
    return DONE if found.best else VERDICT_FAIL


def _number(given: str, text: str, unit: str, place: str) -> float:
    """A positive quantity from its ``text``, which is a part of the ``given`` value; messages quote the ``given`` value."""
    try:
        value = in_unit(text, unit)
    except ValueError as error:
        raise InputError(place, f'"{given}"', str(error)) from error
    if not value > 0 or not math.isfinite(1 / value):
        raise InputError(place, f'"{given}"', "more than 0")
    return value
