"""The verb ``recommend``: which solver and setting to take for an error or a time, out of what studies measured."""

import argparse
import math
import re
from pathlib import Path

from fem_reference.assessment.cost_study import CaseStudy, load_all
from fem_reference.assessment.judge import in_unit
from fem_reference.assessment.recommendation import Expected, Recommendation, recommend
from fem_reference.cli._choosing import scene_of
from fem_reference.cli._parser import add_case
from fem_reference.cli._printing import DONE, VERDICT_FAIL, out, write_output
from fem_reference.cli.study import PAGE
from fem_reference.foundations.errors import InputError
from fem_reference.report.study_page import MAIN, title_of
from fem_reference.report.words import duration, listed, number
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench
from fem_reference.studies.features import features

# How frames a second are written, and what may follow the time of a frame.
_RATES = ("fps", "Hz", "frames/s", "1/s")
_PER_FRAME = re.compile(r"\s*(?:/|per)\s*frame\s*$")
HELP = "which solver and setting to take for an error or a time, out of what studies measured"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options that this verb has."""
    add_case(parser)
    error = "the greatest error that you can do with, in the unit of the metric, such as '2 mm' or '1 %%'"
    parser.add_argument("--error", metavar="VALUE", help=error)
    parser.add_argument(
        "--time", metavar="VALUE", help="the longest time for a frame that you can wait, such as '5 ms' or '60 fps'"
    )
    parser.add_argument(
        "--metric", default=MAIN, metavar="METRIC.STATISTIC", help=f"what the error is of (default: {MAIN})"
    )


def run(options: argparse.Namespace) -> int:
    """Recommend a setting; the exit status is 1 where none meets what is asked."""
    scene = casefile.muscle(scene_of(options))
    studies = read(out(options))
    known = {name for study in studies for name in study.units}
    if options.metric not in known:
        raise InputError("--metric", f'"{options.metric}"', f"one of {', '.join(sorted(known))}")
    unit = next(study.units[options.metric] for study in studies if options.metric in study.units)
    limits = dict(_limits(options, unit))
    bench = Bench(scene, out(options) / "runs")
    found = recommend(features(scene, bench.setup()), scene.name, studies, options.metric, limits)
    write_output(facts(found, options.metric), _text(found, scene.name, options.metric, unit, limits), options)
    return DONE if found.best else VERDICT_FAIL


def read(folder: Path) -> list[CaseStudy]:
    """The studies below ``folder``, of a case that of its own name before those with another; InputError where there is none."""
    paths = sorted(folder.glob(f"*/{PAGE}.json"))
    studies = [(study, path.parent.name) for path in paths for study in load_all(path)]
    found = {study.case: study for study, name in sorted(studies, key=lambda one: one[0].case == one[1])}
    if not found:
        raise InputError(
            "--out", f'"{folder}", where no study is', "a folder with studies: fem-reference study CASE makes one"
        )
    return list(found.values())


def _limits(options: argparse.Namespace, unit: str) -> list[tuple[str, float]]:
    if options.error is None and options.time is None:
        raise InputError("recommend", "nothing asked for", "--error or --time")
    found = list[tuple[str, float]]()
    if options.error is not None:
        found.append(("error", _number(options.error, options.error, unit, "--error")))
    if options.time is not None:
        found.append(("time", _time(options.time)))
    return found


def _time(text: str) -> float:
    """The time of a frame [s], from that or from frames a second."""
    rate = next((unit for unit in _RATES if text.rstrip().endswith(unit)), None)
    if rate is None:
        return _number(text, _PER_FRAME.sub("", text), "s", "--time")
    return 1 / _number(text, text.rstrip().removesuffix(rate), "1", "--time")


def _number(given: str, text: str, unit: str, place: str) -> float:
    """A quantity above zero; ``given``: all of what was written, for messages."""
    try:
        value = in_unit(text, unit)
    except ValueError as error:
        raise InputError(place, f'"{given}"', str(error)) from error
    if not value > 0 or not math.isfinite(1 / value):
        raise InputError(place, f'"{given}"', "more than 0")
    return value


def facts(found: Recommendation, metric: str) -> dict[str, object]:
    """A recommendation as valid JSON."""
    best, near = found.best, found.nearest
    return {
        "metric": metric,
        "recommended": None if best is None else best.point.choice,
        "error": None if best is None else best.error,
        "bar": None if best is None or not found.measured else best.bar,
        "seconds_per_frame": None if best is None else best.time,
        "nearest": None
        if near is None
        else {"choice": near.point.choice, "error": near.error, "bar": near.bar, "seconds_per_frame": near.time},
        "settings_considered": found.count,
        "measured_on": list(found.of),
        "margin_error": found.margins.error,
        "margin_time": found.margins.time,
    }


def _text(found: Recommendation, case: str, metric: str, unit: str, limits: dict[str, float]) -> str:
    most_alike = "the studied case" if len(found.of) == 1 else "the studied cases"
    measured = (
        "measured on it" if found.measured else f"expected from {listed(list(found.of))}, {most_alike} most like it"
    )
    one, lines = found.best or found.nearest, list[str]()
    if found.best is None:
        lines.append(f"none of {found.count} settings meets what is asked on {case} ({measured})")
    if one is None:
        return lines[0]
    near = "" if found.best else "the nearest: "
    lines.append(f"{near}{one.point.solver}: {_settings(one)}")
    error = f"{title_of(metric)} at most {number(one.error)} {unit}{_known(one, unit, measured=found.measured)}"
    lines.append(f"{error}, {duration(one.time)} a frame, {measured}")
    if found.best is None and found.measured:
        lines += _reason(one, unit, limits)
    if not found.measured:
        lines.append(
            f"margins in it: {number(found.margins.error)} times the error, {number(found.margins.time)} times the time"
        )
    return "\n".join(lines)


def _known(one: Expected, unit: str, *, measured: bool) -> str:
    """The parts of an error: measured on the case itself, and the bar of the truth."""
    if not measured:
        return " with margins and the bars of the truths"
    if not one.bar > 0:
        return " (as measured: the truth has no error bar)"
    if one.point.is_truth:
        return " (the truth itself, by its error bar)"
    return f" ({number(one.error - one.bar)} {unit} measured, and {number(one.bar)} {unit}, the error bar of the truth)"


def _reason(one: Expected, unit: str, limits: dict[str, float]) -> list[str]:
    """Why the nearest setting does not meet the ``limits``, where it is the bar of the truth that is added."""
    limit = limits.get("error", math.inf)
    if one.bar >= limit:
        return [
            f"the truth is known no better than {number(one.bar)} {unit}: nothing can be said to be nearer than that"
        ]
    if one.error > limit >= one.error - one.bar:
        return [
            f"without the bar it would be within the {number(limit)} {unit}: the truth is not known well enough to say so"
        ]
    return []


def _settings(one: Expected) -> str:
    choice = {name: value for name, value in one.point.choice.items() if name not in ("solver", "scene", "name")}
    changed = one.point.choice.get("scene", {})
    return ", ".join(f"{name} = {value}" for name, value in (*changed.items(), *choice.items())) or one.point.label
