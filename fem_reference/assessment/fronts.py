"""Fronts of accuracy against cost: the measured settings that no other setting beats, and the cost of halving the error.

Solvers are compared at the same error or at the same cost, never at the same settings (work-precision diagrams: Hairer, Norsett,
Wanner 1993, Solving Ordinary Differential Equations I, II.10).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Annotated, Any

import numpy as np
from pydantic import Field

# The costs of a point: by name, a title and a unit. The first cost is the default.
COSTS: dict[str, tuple[str, str]] = {
    "seconds_per_frame": ("time of a frame", "s"),
    "seconds": ("total time, with set-up", "s"),
    "seconds_processor": ("processor time", "s"),
    "unknowns": ("unknowns", ""),
    "newton_iterations": ("Newton iterations", ""),
    "factorisations": ("factorisations", ""),
    "factorisation_flops": ("operations of the factorisations", ""),
    "krylov_iterations": ("Krylov iterations", ""),
    "projections": ("projections of a constraint", ""),
    "peak_memory_mb": ("peak memory", "MB"),
}
# The name of the cost that states the fraction of the machine that other processes use, and the fraction above which a run counts
# as slowed down.
LOAD, LOADED = "load_by_others", 0.1
# The keys of a scene that define its tetrahedra.
TETRAHEDRA = ("muscle.tet_size", "muscle.refinements")
# The type of an error, a bar or a cost.
Amount = Annotated[float, Field(ge=0, le=1e15, allow_inf_nan=False)]
# A slope is computed only from at least this many points, whose errors must span more than this factor.
_LEAST_POINTS, _LEAST_SPAN = 2, 1.3


@dataclass(frozen=True)
class Point:
    """A run of a ``solver`` with certain settings on a ``case``.

    ``knob`` and ``value``: the key that was varied ("" for the settings of the case or the defaults) and its value as text.
    ``choice``: everything that is needed to repeat the run. ``status`` and ``message``: the outcome. ``errors``: the maximum
    deviations from the truth, by ``metric.statistic``. ``costs``: the known costs of ``COSTS`` by name, and the seconds of each
    phase.
    """

    case: str
    solver: str
    name: str
    knob: str
    value: str
    choice: dict[str, Any]
    status: str
    message: str
    errors: dict[str, Amount] = field(default_factory=dict)
    costs: dict[str, Amount] = field(default_factory=dict)

    @property
    def is_default(self) -> bool:
        """True if no setting was varied."""
        return not self.knob

    @property
    def is_truth(self) -> bool:
        """True for the reference of the case, from which the errors of all other points are measured."""
        return self.name == "reference" and self.is_default

    @property
    def label(self) -> str:
        """The words that distinguish the point from the other points of its solver."""
        name = "" if self.name in (self.solver, "reference") else f"{self.name}, "
        return f"{name}{self.knob} = {self.value}" if self.knob else f"{self.name}, as it is"

    @property
    def load(self) -> float:
        """The fraction of the machine that other processes used during the run; NaN if it is unknown."""
        return self.costs.get(LOAD, math.nan)

    def at(self, error: str, cost: str) -> tuple[float, float] | None:
        """The error and the cost of a converged point; None if it did not converge, or if either is unknown or not positive."""
        pair = self.errors.get(error, math.nan), self.costs.get(cost, math.nan)
        return pair if self.status == "converged" and min(pair) > 0 and all(map(math.isfinite, pair)) else None


def pareto(points: Iterable[Point], error: str, cost: str) -> tuple[Point, ...]:
    """The points whose error is smaller than that of every cheaper point, the cheapest first."""
    known = [(pair[1], pair[0], i, point) for i, point in enumerate(points) if (pair := point.at(error, cost))]
    found, best = list[Point](), math.inf
    for _, value, _, point in sorted(known):
        if value < best:
            found.append(point)
            best = value
    return tuple(found)


@dataclass(frozen=True)
class Price:
    """The price of accuracy with a ``solver``.

    ``factor``: the factor by which the cost on the front grows if the error is halved, NaN if more cost does not reduce the error.
    ``best`` and ``worst``: the smallest and the largest error on the front, which has ``count`` points. ``nearest``: the point with
    the smallest error.
    """

    solver: str
    factor: float
    best: float
    worst: float
    count: int
    nearest: Point

    @property
    def is_measured(self) -> bool:
        """True if the errors of the front span at least a factor of two, so that :attr:`factor` is not an extrapolation."""
        return self.worst >= 2 * self.best


def price(points: Iterable[Point], solver: str, error: str, cost: str) -> Price | None:
    """The price of accuracy with a ``solver``, from a least-squares line through its front in logarithms; None without points."""
    front = pareto((point for point in points if point.solver == solver), error, cost)
    pairs = [pair for point in front if (pair := point.at(error, cost))]
    if not pairs:
        return None
    errors, costs = np.array(pairs).T
    factor = math.nan
    if len(pairs) >= _LEAST_POINTS and errors.max() > _LEAST_SPAN * errors.min():
        slope = np.polyfit(np.log(errors), np.log(costs), 1)[0]
        factor = float(2.0**-slope)
    return Price(solver, factor, float(errors.min()), float(errors.max()), len(pairs), front[-1])


def solvers(points: Iterable[Point]) -> tuple[str, ...]:
    """The solvers of the points, in order of appearance."""
    return tuple(dict.fromkeys(point.solver for point in points))


@dataclass(frozen=True)
class Match:
    """For each solver, the best point whose error or cost (``same``) is at most ``at``; the best of all comes first."""

    same: str
    at: float
    best: dict[str, Point]


def match(points: Iterable[Point], error: str, cost: str, *, same: str, at: float) -> Match:
    """The best point of each solver among the points whose error or cost (``same``) is at most ``at``. Of equally good points, the
    point with the smallest ``same`` is taken.
    """
    i = 0 if same == error else 1
    known = [(pair, point) for point in points if (pair := point.at(error, cost)) and pair[i] <= at]
    best = dict[str, Point]()
    for _, point in sorted(known, key=lambda one: (one[0][1 - i], one[0][i])):
        best.setdefault(point.solver, point)
    return Match(same, at, best)


def levels(points: Iterable[Point], error: str, cost: str, *, same: str, count: int = 5) -> tuple[float, ...]:
    """Errors or costs (``same``) at which points can be compared, over the range of the points: at most ``count`` values, each 1, 2
    or 5 times a power of ten.
    """
    values = [pair[0 if same == error else 1] for point in points if (pair := point.at(error, cost))]
    if not values:
        return ()
    powers = range(math.floor(math.log10(min(values))), math.ceil(math.log10(max(values))) + 1)
    round_ones = [digit * 10.0**power for power in powers for digit in (1, 2, 5)]
    within = [value for value in round_ones if min(values) <= value <= 1.001 * max(values)] or [max(values)]
    step = max(1, math.ceil(len(within) / count))
    return tuple(within[::-1][::step][::-1])
