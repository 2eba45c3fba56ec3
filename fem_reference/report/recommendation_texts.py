"""A recommended setting, as text and as JSON."""

import math
from collections.abc import Iterable

from fem_reference.assessment.answers import Answer
from fem_reference.assessment.fronts import LOADED
from fem_reference.assessment.recommendation import Expected, Recommendation
from fem_reference.report.words import duration, listed, number, title_of, under_load

# Entries of a point's choice that a sentence does not list among the settings.
_UNSAID = ("solver", "scene", "name", "program")


def facts(found: Recommendation, metric: str) -> dict[str, object]:
    """A recommendation as valid JSON."""
    best, near = found.best, found.nearest
    one = best or near
    return {
        "metric": metric,
        "recommended": best and best.point.choice,
        "error": best and best.error,
        "bar": best.bar if best and found.measured else None,
        "seconds_per_frame": best and best.time,
        "nearest": near
        and {"choice": near.point.choice, "error": near.error, "bar": near.bar, "seconds_per_frame": near.time},
        "settings_considered": found.count,
        "measured_on": list(found.of),
        "margin_error": found.margins.error,
        "margin_time": found.margins.time,
        "load_by_others": None if one is None or math.isnan(one.point.load) else one.point.load,
        "timed_under_load": sum(load > LOADED for load in found.loads),
    }


def text(found: Recommendation, case: str, metric: str, unit: str, limit: float) -> str:
    """The recommended setting or, if no setting meets the request, the nearest setting; with its error, its time and the evidence.
    ``limit``: the requested limit of the error; ``unit``: the unit of errors.
    """
    alike = "the studied case" if len(found.of) == 1 else "the studied cases"
    measured = "measured on it" if found.measured else f"expected from {listed(list(found.of))}, {alike} most like it"
    one, lines = found.best or found.nearest, list[str]()
    if found.best is None:
        lines.append(f"none of {found.count} settings meets the request on {case} ({measured})")
    if one is None:
        return lines[0]
    lines.append(f"{'' if found.best else 'the nearest: '}{one.point.solver}: {_settings(one)}")
    error = f"{title_of(metric)} at most {number(one.error)} {unit}{_parts(one, unit, measured=found.measured)}"
    lines.append(f"{error}, {duration(one.time)} a frame, {measured}")
    if found.best is None and found.measured:
        lines += _reason(one, unit, limit)
    if not found.measured:
        margins = found.margins
        lines.append(
            f"including margins: {number(margins.error)} times the error, {number(margins.time)} times the time"
        )
    if warning := under_load(found.loads, LOADED):
        own = f" (this one: {100 * one.point.load:.0f} %)" if one.point.load > LOADED else ""
        lines.append(f"{warning}{own}")
    return "\n".join(lines)


def answer_texts(found: Iterable[Answer], unit: str) -> list[str]:
    """A sentence for each answer: the request, the setting, its error in ``unit`` with the error bar of the truth, and its time."""
    return [f"{asked_for(one, unit)}: {_answer(one, unit)}" for one in found]


def answer_facts(found: Iterable[Answer]) -> list[dict[str, object]]:
    """The answers as valid JSON."""
    return [
        {
            "limits": dict(one.limits),
            "recommended": one.best and one.best.point.choice,
            "error": one.best and one.best.error,
            "seconds_per_frame": one.best and one.best.time,
        }
        for one in found
    ]


def asked_for(one: Answer, unit: str) -> str:
    """The request of an answer in words."""
    if "error" in one.limits:
        return f"Within {number(one.limits['error'])} {unit}"
    return (
        f"At {number(1 / one.limits['time'])} frames a second" if "time" in one.limits else "At the knee of the front"
    )


def setting_text(one: Expected, unit: str) -> str:
    """A setting with its error and its time."""
    label = one.point.label
    named = label if label.startswith(one.point.solver) else f"{one.point.solver} ({label})"
    return f"{named}, {number(one.error)} {unit}, {duration(one.time)} a frame"


def _answer(one: Answer, unit: str) -> str:
    if one.best is not None:
        return setting_text(one.best, unit)
    if one.nearest is None:
        return "no setting; more points are needed"
    return f"no setting; the nearest is {setting_text(one.nearest, unit)}"


def _parts(one: Expected, unit: str, *, measured: bool) -> str:
    """The parts of an error in words: the part that was measured on the case itself, and the error bar of the truth."""
    if not measured:
        return " with margins and the bars of the truths"
    if not one.bar > 0:
        return " (as measured: the truth has no error bar)"
    if one.point.is_truth:
        return " (the error bar of the truth itself)"
    return f" ({number(one.error - one.bar)} {unit} measured, and {number(one.bar)} {unit}, the error bar of the truth)"


def _reason(one: Expected, unit: str, limit: float) -> list[str]:
    """A line about the error bar of the truth, if this is why the nearest setting does not meet the ``limit`` of the error."""
    if one.bar >= limit:
        known = f"{number(one.bar)} {unit}"
        return [f"the error bar of the truth is {known}: no smaller error can be proven"]
    if one.error > limit >= one.error - one.bar:
        within = f"{number(limit)} {unit}"
        return [f"without the bar, the error would be within {within}: the bar of the truth is too large to decide"]
    return []


def _settings(one: Expected) -> str:
    choice = {name: value for name, value in one.point.choice.items() if name not in _UNSAID}
    changed = one.point.choice.get("scene", {})
    return ", ".join(f"{name} = {value}" for name, value in (*changed.items(), *choice.items())) or one.point.label
