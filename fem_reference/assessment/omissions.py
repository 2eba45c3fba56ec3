"""Omissions of effects of a scene or features of a solver: the changes that they cause, and the time that they save."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

from fem_reference.metrics import described, metric

FORMAT = 1
# The measures of a run with an omission. Its reference is the complete run of the same solver.
MEASURES = tuple(".".join(key) for key in described("main") if metric(key[0]).OF != "field")
# An omission does not matter if all changes are below this fraction of their error bars.
NEGLIGIBLE = 0.1
# The parts of the solving time that runs may report, with their names in runs; the total is slightly longer than their sum.
PHASES = {"assembly": ("assembly",), "contact": ("contact",), "linear systems": ("factorisation", "krylov")}
COUNTS = ("unknowns", "newton_iterations", "load_steps")

Word = Literal["matters", "hardly", "does not matter", "not known"]


@dataclass(frozen=True)
class Omission:
    """The outcome of a run with an omission.

    ``left_out``: the names of the omitted effects or features: none, one, or all that can be omitted. ``status`` and ``message``:
    the outcome; a run that was not made has the status ``"refused"``. ``changes``: by ``metric.statistic``, the maximum magnitude
    over the frames of the change from the complete run; a statistic that is unknown in a frame is left out. ``costs``: as in the
    run. ``instead``: settings that had to be changed because of the omission. ``predicted``: by ``metric.statistic``, the change
    that an indicator predicts, for omissions that have one.
    """

    left_out: tuple[str, ...]
    status: str
    message: str
    changes: dict[str, float] = field(default_factory=dict)
    costs: dict[str, float] = field(default_factory=dict)
    instead: dict[str, Any] = field(default_factory=dict)
    predicted: dict[str, float] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """The processor time [s], without compilation in the case of the reference; NaN if unknown."""
        return self.costs.get("seconds_processor_solve", self.costs.get("seconds_processor", math.nan))

    def phase(self, name: str) -> float:
        """The processor time [s] of one of ``PHASES``: :attr:`seconds` times its fraction of the solving time; NaN if unknown."""
        spent = sum(self.costs.get(f"seconds_{part}", math.nan) for part in PHASES[name])
        return self.seconds * spent / (self.costs.get("seconds_solve") or math.nan)


@dataclass(frozen=True)
class Ablation:
    """The runs called ``name`` of a ``solver``: the complete run (``whole``) and its ``omissions``. ``kept``: the effects or
    features that are never omitted.
    """

    name: str
    solver: str
    kept: tuple[str, ...]
    whole: Omission
    omissions: tuple[Omission, ...]

    def relative(self, seconds: float) -> float:
        """A time [s] divided by the time of the complete run; NaN if either is unknown."""
        return seconds / (self.whole.seconds or math.nan)

    def count(self, omission: Omission, name: str) -> float:
        """One of the ``COUNTS`` of an omission divided by its value in the complete run; NaN if either is unknown."""
        return omission.costs.get(name, math.nan) / (self.whole.costs.get(name) or math.nan)


@dataclass(frozen=True)
class CaseOmissions:
    """The ablations of a case; the ablation of the reference is the first.

    ``units`` and ``bars``: by ``metric.statistic``, the unit and the maximum error bar over the frames. ``unknown``: the reason why
    there are no bars. ``origin``: the provenance of the measurements.
    """

    case: str
    title: str
    ablations: tuple[Ablation, ...]
    units: dict[str, str]
    bars: dict[str, float]
    unknown: str = ""
    origin: dict[str, str] = field(default_factory=dict)


def in_bars(changes: Mapping[str, float], bars: Mapping[str, float]) -> dict[str, float]:
    """Each of the ``changes`` divided by its error bar; NaN if the bar is unknown.

    >>> in_bars({"volume.deviation": 0.5, "surface_deviation.rms": 1.0}, {"volume.deviation": 0.25})
    {'volume.deviation': 2.0, 'surface_deviation.rms': nan}
    """
    known = {name: (value, bars.get(name, math.nan)) for name, value in changes.items()}
    return {name: value / bar if bar else math.inf if value else 0.0 for name, (value, bar) in known.items()}


def verdict(changes: Mapping[str, float], bars: Mapping[str, float]) -> Word:
    """Judge an omission: it matters if one of its ``changes`` exceeds its error bar, and does not if all are below a tenth of
    theirs.

    >>> bars = {"volume.deviation": 0.1, "surface_deviation.rms": 1.0}
    >>> [verdict({"volume.deviation": 0.005, "surface_deviation.rms": x}, bars) for x in (0.05, 0.5, 5.0)]
    ['does not matter', 'hardly', 'matters']
    """
    ratios = list(in_bars(changes, bars).values())
    if any(ratio > 1 for ratio in ratios):
        return "matters"
    if not ratios or any(map(math.isnan, ratios)):
        return "not known"
    return "does not matter" if all(ratio < NEGLIGIBLE for ratio in ratios) else "hardly"


def facts(found: CaseOmissions) -> dict[str, Any]:
    """The ablations of a case as valid JSON, with the verdict on every omission."""
    table = {"format": FORMAT, **asdict(found)}
    for ablation, one in zip(found.ablations, table["ablations"], strict=True):
        for omission, row in zip(ablation.omissions, one["omissions"], strict=True):
            row["verdict"] = verdict(omission.changes, found.bars)
    return table
