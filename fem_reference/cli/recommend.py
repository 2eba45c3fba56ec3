"""The verb ``recommend``: which solver and setting to take for an error or a time, out of what studies measured."""

import argparse
from pathlib import Path

from fem_reference.assessment.cost_study import CaseStudy, load
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

HELP = "which solver and setting to take for an error or a time, out of what studies measured"


def add_options(parser: argparse.ArgumentParser) -> None:
    """The options that this verb has."""
    add_case(parser)
    error = "the greatest error that you can do with, in the unit of the metric, such as '2 mm' or '1 %%'"
    parser.add_argument("--error", metavar="VALUE", help=error)
    parser.add_argument(
        "--time", metavar="VALUE", help="the longest time for a frame that you can wait, such as '5 ms/frame'"
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
    limits = dict(_limits(options, studies[0].units[options.metric]))
    bench = Bench(scene, out(options) / "runs")
    found = recommend(features(scene, bench.setup()), scene.name, studies, options.metric, limits)
    write_output(facts(found, options.metric), _text(found, scene.name, options.metric, studies[0].units), options)
    return DONE if found.best else VERDICT_FAIL


def read(folder: Path) -> list[CaseStudy]:
    """The studies below ``folder``, of a case that of its own name before those with another; InputError where there is none."""
    paths = sorted(folder.glob(f"*/{PAGE}.json"))
    studies = [(load(path), path.parent.name) for path in paths]
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
        found.append(("error", _number(options.error, unit, "--error")))
    if options.time is not None:
        found.append(("time", _number(options.time.removesuffix("/frame"), "s", "--time")))
    return found


def _number(text: str, unit: str, place: str) -> float:
    try:
        value = in_unit(text, unit)
    except ValueError as error:
        raise InputError(place, f'"{text}"', str(error)) from error
    if not value > 0:
        raise InputError(place, f'"{text}"', "more than 0")
    return value


def facts(found: Recommendation, metric: str) -> dict[str, object]:
    """A recommendation as valid JSON."""
    best = found.best
    return {
        "metric": metric,
        "recommended": None if best is None else best.point.choice,
        "error": None if best is None else best.error,
        "seconds_per_frame": None if best is None else best.time,
        "settings_considered": found.count,
        "measured_on": list(found.of),
        "margin_error": found.margins.error,
        "margin_time": found.margins.time,
    }


def _text(found: Recommendation, case: str, metric: str, named: dict[str, str]) -> str:
    most_alike = "the studied case" if len(found.of) == 1 else "the studied cases"
    measured = (
        "measured on it" if found.measured else f"expected from {listed(list(found.of))}, {most_alike} most like it"
    )
    if found.best is None:
        return f"none of {found.count} settings meets what is asked on {case} ({measured})"
    lines = [f"{found.best.point.solver}: {_settings(found.best)}"]
    error = f"{title_of(metric)} at most {number(found.best.error)} {named[metric]} with the bar of the truth"
    lines.append(f"{error}, {duration(found.best.time)} a frame, {measured}")
    if not found.measured:
        lines.append(
            f"margins in it: {number(found.margins.error)} times the error, {number(found.margins.time)} times the time"
        )
    return "\n".join(lines)


def _settings(one: Expected) -> str:
    choice = {name: value for name, value in one.point.choice.items() if name not in ("solver", "scene", "name")}
    changed = one.point.choice.get("scene", {})
    return ", ".join(f"{name} = {value}" for name, value in (*changed.items(), *choice.items())) or one.point.label
