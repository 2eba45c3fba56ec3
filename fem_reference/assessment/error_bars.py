"""Error bars of every statistic in each frame, from further runs of the reference with coarser numerics.

There are two kinds of bars. The bar of a candidate's deviation from the reference is the deviation of the reference's runs from
each other: by the triangle inequality, another reference changes the candidate's deviation by at most this amount. The bar of the
reference's change from rest is the difference between the changes of its runs, or a typical fraction of the deviation between these
runs if this is larger. The bars of a body are differences between its states in two solutions.
"""

import json
import math
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import BeforeValidator, PlainValidator, TypeAdapter

from fem_reference.assessment.differences import carried, together, typical, typical_changes
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.io import files, texts
from fem_reference.io.texts import plain
from fem_reference.metrics import Measure, MeasurementContext, as_surface, change, described, measure, names, of_itself
from fem_reference.runs.store import Frame, Run

Of = Literal["change", "deviation"]
FILE = "error_bar.json"
FORMAT = 2
# The safety factor of a grid convergence index (Roache 1998, Verification and Validation in Computational Science, ch. 5).
SAFETY = 1.25
# An additional factor for a single fibre: its error is not averaged with those of other fibres, and two mesh sizes are weaker
# evidence than three (Roache's safety factor for two sizes is 3). It was chosen so that bars cover the differences from finer
# solutions (docs/error_bars.md).
LONE_FIBRE = 1.2
# The ratio of a first-order error to the change of the result when the source of the error is halved. For the cells of a body,
# first order is the lowest order of convergence, with any element, away from the rims of constraints (docs/error_bars.md).
VARIATION = 2.0
# The order of convergence of errors with the size of the tetrahedra, in general and at the worst point. At rims of attachments,
# where displacement grows with the square root of the distance from the rim, the order is 1, or 2 with a mesh graded towards rims;
# at all other points it is 2 or more. The general order is in between, as runs with three sizes confirm (docs/error_bars.md).
ORDER, ORDER_OF_WORST = 1.5, 1.0
# The relative change of a force or moment if the same springs are distributed over facets instead of points of the surface: 5.3 and
# 8.8 % of the force on the femur at 1 rad, for gluteus_medius and gluteus_maximus.
SPREAD = 0.09
TETRAHEDRA, CARRIED = "tetrahedra", "surface in tetrahedra"
# Numbers as stored in a file, in which None stands for a number that is not finite.
_Number = Annotated[float, BeforeValidator(lambda value: math.nan if value is None else value)]
_Numbers = Annotated[
    Floats, PlainValidator(lambda values: np.array(TypeAdapter(list[_Number]).validate_python(values)))
]
# For each kind of bar, the differences (f,) of every statistic between two runs.
_Differences = dict[Of, list[Floats]]


@dataclass(frozen=True, eq=False)
class ErrorBar:
    """The error bar of a statistic, either ``of`` the reference's change from rest or ``of`` a candidate's deviation from the
    reference.

    ``values`` (f,): the possible error of the statistic due to the reference, in ``unit``, NaN if unknown. ``parts``: the maximum
    contribution of each source of error over the frames.

    ``model`` (f,): the change of the statistic under another model of spring attachments: with exact attachments if there is
    such a run, and for a force or moment at least ``SPREAD`` of its value. NaN where that run has no solution; None
    without springs, or if no other model was solved. This is not an error of the present model, so it is not part of ``values``.
    """

    of: Of
    metric: str
    statistic: str
    unit: str
    values: _Numbers
    parts: dict[str, _Number]
    model: _Numbers | None = None

    @property
    def widest(self) -> int:
        """The index of the frame with the widest bar; an unknown bar counts as the widest."""
        return int(np.argmax(np.where(np.isnan(self.values), np.inf, self.values)))


@dataclass(frozen=True, eq=False)
class ErrorBars:
    """The error bars of a reference over frame ``numbers`` (f,). ``sizes`` [mm]: the sizes of the tetrahedra in the reference and
    in the coarser run. ``order``: the order of convergence that is generally assumed.
    """

    numbers: tuple[int, ...]
    sizes: tuple[float, float]
    order: float
    bars: tuple[ErrorBar, ...]

    def find(self, of: Of, metric: str, statistic: str) -> ErrorBar | None:
        """The bar of a statistic's change or deviation (``of``); None if there is none."""
        wanted = (of, metric, statistic)
        return next((bar for bar in self.bars if (bar.of, bar.metric, bar.statistic) == wanted), None)

    @property
    def of_deviations(self) -> tuple[Measure, ...]:
        """The error bars of deviations from the reference, as measures."""
        bars = (bar for bar in self.bars if bar.of == "deviation")
        return tuple(Measure(bar.metric, bar.statistic, bar.unit, bar.values) for bar in bars)


@dataclass(frozen=True, eq=False)
class Pair:
    """Runs of the reference over the same frames: ``fine`` is the reference itself, ``coarse`` has larger tetrahedra.

    ``varied``: for each source of error, by name, a run like ``coarse`` with this source halved. ``exact``: a run like ``coarse``
    with exact attachments instead of springs. ``sizes`` [mm]: the sizes of the tetrahedra in ``fine`` and ``coarse``. ``safety``:
    the ratio of bars to the expected error. ``springs``: True if any attachment is by springs.
    """

    fine: Run
    coarse: Run
    sizes: tuple[float, float]
    varied: dict[str, Run]
    exact: Run | None = None
    safety: float = SAFETY
    springs: bool = False

    def share(self, metric: str, statistic: str) -> float:
        """The ratio of the fine run's error bar to the difference between the two runs, as in a grid convergence index."""
        stated = described()[metric, statistic]
        order = ORDER_OF_WORST if stated.local else ORDER
        safety = self.safety * (LONE_FIBRE if stated.lone else 1.0)
        return float(safety / ((self.sizes[1] / self.sizes[0]) ** order - 1))


def error_bars(pair: Pair, context: MeasurementContext) -> ErrorBars:
    """The error bars of changes and deviations for every statistic, except statistics of a run itself, which are exact."""
    comparing = [name for name in names() if not of_itself(name)]
    surface = cache(as_surface)

    @cache
    def measured(run: Run, other: Run | None) -> tuple[Measure, ...]:
        return change(run, context, comparing) if other is None else measure(run, other, context, comparing)

    def differences(run: Run, other: Run) -> _Differences:
        """The differences between the changes of two runs from rest, each computed with the fibres in the interior of that run, and
        the deviations of the surface of ``other`` from the surface of ``run``.
        """
        against_run, against_itself = (measured(surface(other), surface(one)) for one in (run, other))
        changes = _less(measured(run, None), measured(other, None))
        return {"change": changes, "deviation": _less(against_run, against_itself)}

    statistics = measured(surface(pair.fine), surface(pair.fine))
    own = measured(pair.fine, None)
    moved = _rms_of_surface(statistics, [one.values for one in measured(surface(pair.fine), None)])
    sizes = {TETRAHEDRA: _sizes(differences(pair.coarse, pair.fine), statistics, moved)}
    sizes |= {name: _sizes(differences(run, pair.coarse), statistics) for name, run in pair.varied.items()}
    outside = carried(pair.fine, moved)
    exact = None if pair.exact is None else differences(pair.exact, pair.coarse)
    bars = []
    for of in get_args(Of):
        for i, one in enumerate(statistics):
            left = dict.fromkeys(sizes, VARIATION) | {TETRAHEDRA: pair.share(one.metric, one.statistic)}
            parts = {name: left[name] * size[of][i] for name, size in sizes.items()}
            if one.metric == "volume" and one.statistic in outside:
                parts[CARRIED] = SAFETY * outside[one.statistic]
            model = _model(one, None if exact is None else exact[of][i], own[i].values if pair.springs else None)
            there = np.isfinite(one.values)  # a moment arm has no value without a force
            bars.append(ErrorBar(of, one.metric, one.statistic, one.unit, *together(parts, there), model))
    return ErrorBars(pair.fine.numbers, pair.sizes, ORDER, tuple(bars))


def _model(one: Measure, exact: Floats | None, own: Floats | None) -> Floats | None:
    """The change (f,) of the statistic ``one`` under another model of springs. ``exact`` (f,): its change with exact attachments,
    if known. ``own`` (f,): its value in the reference; a force or moment also changes with springs that are distributed
    differently.
    """
    forces = one.metric == "joint_moment" and one.statistic != "arm"
    spread = SPREAD * np.abs(own) if forces and own is not None else None
    known = [np.abs(one) for one in (exact, spread) if one is not None]
    return np.maximum.reduce(known) if known else None


def _sizes(differences: _Differences, statistics: tuple[Measure, ...], moved: Floats | None = None) -> _Differences:
    """The typical sizes of ``differences`` between two runs, by statistic. ``moved`` (f,) [mm]: the motion of the surfaces."""
    apart = _rms_of_surface(statistics, differences["deviation"])
    deviations = [typical(found, apart, moved) for found in differences["deviation"]]
    kinds = [(one.metric, one.statistic) for one in statistics]
    changes = typical_changes(differences["change"], deviations, kinds)
    spreads = dict(zip(kinds, deviations, strict=True))
    sizes: _Differences = {"change": changes, "deviation": deviations}
    return {of: _pooled(_averaged(size, kinds, spreads), kinds) for of, size in sizes.items()}


def _averaged(
    sizes: list[Floats], kinds: list[tuple[str, str]], spreads: dict[tuple[str, str], Floats]
) -> list[Floats]:
    """The ``sizes`` (f,) of differences by metric and statistic (``kinds``). For a signed mean over fibres the size is at least the
    rms of the fibres' deviations in ``spreads``: errors of neighbouring fibres are similar, and cancel between two runs only by
    chance.
    """
    found = []
    for size, (metric, statistic) in zip(sizes, kinds, strict=True):
        of_fibres = "mean" in statistic and described()[metric, statistic].local
        spread = spreads.get((metric, statistic.replace("mean", "rms")), size)
        found.append(np.maximum(size, spread) if of_fibres else size)
    return found


def _pooled(sizes: list[Floats], kinds: list[tuple[str, str]]) -> list[Floats]:
    """The ``sizes`` (f,) of differences by metric and statistic (``kinds``); for pooled statistics at least their rms."""
    pooled: dict[str, list[Floats]] = {}
    for size, kind in zip(sizes, kinds, strict=True):
        if described()[kind].pooled:
            pooled.setdefault(kind[0], []).append(size)
    least = {metric: np.sqrt(np.mean(np.square(some), axis=0)) for metric, some in pooled.items()}
    return [np.maximum(size, least.get(metric, size)) for size, (metric, _) in zip(sizes, kinds, strict=True)]


def _rms_of_surface(statistics: tuple[Measure, ...], values: list[Floats]) -> Floats:
    """The rms distance (f,) [mm] of the surface, taken from the ``values`` of all ``statistics``."""
    return values[[(one.metric, one.statistic) for one in statistics].index(("surface_deviation", "rms"))]


def _less(measures: tuple[Measure, ...], others: tuple[Measure, ...]) -> list[Floats]:
    """The values (f,) of ``measures`` minus the values of ``others``, for each statistic."""
    return [one.values - other.values for one, other in zip(measures, others, strict=True)]


def save(bars: ErrorBars, folder: Path, of: dict[str, str]) -> None:
    """Store the error ``bars`` in the ``folder`` of their run. ``of``: the run and a hash of the metrics that measured it."""
    table = {"format": FORMAT, "of": of, "numbers": bars.numbers, "sizes_mm": bars.sizes, "order": bars.order}
    files.write_text(folder / FILE, json.dumps(plain(table | {"bars": bars.bars}), indent=1, allow_nan=False))


def load(folder: Path, of: dict[str, str]) -> ErrorBars | None:
    """The bars stored in ``folder``; None without bars for the run and metrics in ``of``. InputError if the file is damaged."""
    place = folder / FILE
    if not place.exists():
        return None
    try:
        table = texts.read_json(place, "the error bar of a stored run (--error-bar computes it again)")
        if table["format"] != FORMAT or table["of"] != of:
            return None
        bars = TypeAdapter(ErrorBars).validate_python(table | {"sizes": table["sizes_mm"]})
        for bar in bars.bars:
            if any(one is not None and one.shape != (len(bars.numbers),) for one in (bar.values, bar.model)):
                raise ValueError(f"the bar of {bar.metric}.{bar.statistic}")
        return bars
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(place, repr(error), "the error bar of a stored run (--error-bar computes it again)") from error


@dataclass(frozen=True, eq=False)
class BodyBars:
    """Error bars of a body at ``frames`` (f,): distances from its states in the limit of fine cells, NaN if unknown.

    ``points`` (f, n) [mm]: bars of the positions. ``energy`` (f,) [N mm]: bars of the energy. ``forces`` (f,) [N] and ``moments``
    (f,) [N mm]: for each constraint or bone, by name, the magnitude of the bar of the vector. ``displacement`` (f,): the bar of the
    displacement divided by the displacement, both rms over the nodes. ``sharper``: the more accurate solution, in words.
    """

    frames: tuple[float, ...]
    points: Floats
    forces: dict[str, Floats]
    moments: dict[str, Floats]
    energy: Floats
    displacement: Floats
    sharper: str


def body_bars(states: tuple[Frame, ...], finer: tuple[Frame, ...], shared: Ints, sharper: str) -> BodyBars:
    """The error bars of the ``states`` of a body, the rest state first.

    ``finer``: the states of a more accurate solution, which may have stopped earlier. ``shared`` (n,): the index of each point of
    the body in that solution, -1 for a missing point. ``sharper``: the differences in numerics, in words.
    """
    there = {state.number: state for state in finer}
    pairs = [(state, _beside(state, there.get(state.number), shared)) for state in states]
    left = SAFETY * VARIATION

    def vectors(kind: str) -> dict[str, Floats]:
        names = getattr(states[0], kind)
        ends = {name: [[getattr(one, kind)[name] for one in pair] for pair in pairs] for name in names}
        return {name: left * np.linalg.norm(np.diff(ways, axis=1)[:, 0], axis=1) for name, ways in ends.items()}

    points = left * np.array([np.linalg.norm(one.points - other.points, axis=1) for one, other in pairs])
    energy = left * np.array([abs(one.scalars["energy"] - other.scalars["energy"]) for one, other in pairs])
    moved = np.array([np.linalg.norm(one.points - states[0].points) for one in states])
    wrong = np.sqrt(np.sum(np.where(shared < 0, 0.0, points) ** 2, axis=1))
    share = np.divide(wrong, moved, out=np.where(wrong > 0, np.inf, wrong), where=moved > 0)
    frames = tuple(state.number for state in states)
    return BodyBars(frames, points, vectors("forces"), vectors("moments"), energy, share, sharper)


def _beside(state: Frame, other: Frame | None, shared: Ints) -> Frame:
    """The ``other`` state at the points of ``state``; NaN at missing points, and everywhere if there is no other state."""
    if other is None:
        lost = np.full(3, np.nan)
        blank: dict[str, Any] = {kind: dict.fromkeys(getattr(state, kind), lost) for kind in ("forces", "moments")}
        return replace(state, points=np.full_like(state.points, np.nan), scalars={"energy": np.nan}, **blank)
    return replace(other, points=np.where(shared[:, None] < 0, np.nan, other.points[shared]))
