"""Recommendation of the cheapest or most accurate setting, as measured on the case itself or on the most similar cases; and the
transfer of settings, with the size of tetrahedra scaled, to a case that was left out when they were chosen.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import TETRAHEDRA, Point
from fem_reference.foundations.errors import InputError

TIME = "seconds_per_frame"
Features = Mapping[str, float]  # the features of a case, by name
# The number of most similar cases that are used for a case that has no study.
_ALIKE = 3
# Margins are chosen so that this fraction of the values measured on left-out cases stays below the values expected from other
# cases.
_MET = 0.95
# The features that determine similarity.
_COMPARED = ("motion_to_size", "contact", "bulk_to_shear", "fibres_to_shear")


@dataclass(frozen=True)
class Expected:
    """A setting with its expected ``error`` and ``time`` per frame [s]. ``of``: the cases on which it was measured. If it was
    measured on the case itself, ``bar`` is the known error bar of the truth, which is part of the error.
    """

    point: Point
    error: float
    time: float
    of: tuple[str, ...]
    bar: float = 0.0

    @property
    def counted(self) -> float:
        """The error for ranking: the error without the bar of the truth, but at least this bar."""
        return max(self.error - self.bar, self.bar)

    def misses(self, limits: Mapping[str, float]) -> float:
        """The larger of the ratios of error and time to their ``limits``."""
        own = {"error": self.error, "time": self.time}
        return max(own[name] / limit for name, limit in limits.items())


@dataclass(frozen=True)
class Margins:
    """Factors for errors and times that are expected from the most similar cases; 1 if they were measured on the case itself."""

    error: float = 1.0
    time: float = 1.0


@dataclass(frozen=True, eq=False)
class Recommendation:
    """The recommended setting (``best``) out of ``count`` settings, None if no setting meets the limits.

    ``nearest``: if none meets them, the setting that exceeds them least. ``margins``: the factors in the expected errors and times.
    ``of``: the cases on which the settings were measured. ``measured``: True if they were measured on the case itself. ``loads``:
    for each setting, the fraction of the machine that other processes used.
    """

    best: Expected | None
    nearest: Expected | None
    count: int
    margins: Margins
    of: tuple[str, ...]
    measured: bool
    loads: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class KnownSettings:
    """All ``settings`` for a case, with ``margins``; ``of`` and ``measured`` as in :class:`Recommendation`."""

    settings: tuple[Expected, ...]
    margins: Margins
    of: tuple[str, ...]
    measured: bool


def recommend(
    features: Features, case: str, studies: Sequence[CaseStudy], metric: str, limits: Mapping[str, float]
) -> Recommendation:
    """The setting for a ``case`` that :func:`chosen` selects by ``limits`` from :func:`known_settings`."""
    known = known_settings(features, case, studies, metric)
    best, nearest = chosen(known.settings, limits)
    loads = tuple(one.point.load for one in known.settings)
    return Recommendation(best, nearest, len(known.settings), known.margins, known.of, known.measured, loads)


def chosen(known: Sequence[Expected], limits: Mapping[str, float]) -> tuple[Expected | None, Expected | None]:
    """The best setting within the ``limits``, None if there is none; and, only if there is none, the setting that exceeds them
    least. With a limit ``"error"`` the cheapest setting is the best; with only a limit ``"time"`` [s] per frame, the most accurate.
    """
    most = {"error": math.inf, "time": math.inf} | dict(limits)
    fitting = [one for one in known if one.error <= most["error"] and one.time <= most["time"]]
    rank = (lambda one: (one.time, one.error)) if "error" in limits else (lambda one: (one.counted, one.time))
    best = min(fitting, key=rank, default=None)
    return best, None if best else min(known, key=lambda one: one.misses(limits), default=None)


def known_settings(features: Features, case: str, studies: Sequence[CaseStudy], metric: str) -> KnownSettings:
    """The settings for a ``case`` with these ``features``, from the ``studies`` that have the ``metric``. An error is the measured
    error plus the error bar of the truth, as in the tables of a study.
    """
    studies = [study for study in studies if metric in study.units]
    own = [study for study in studies if study.case == case and _is_same(features, study.features)]
    others = [] if own else _comparable(features, case, studies, metric)
    margins = Margins() if own else _margins(others, metric)
    known = _measured(own[0], metric) if own else list(_expected(features, others, metric, margins))
    of = (case,) if own else tuple(study.case for study in alike(features, others))
    return KnownSettings(tuple(known), margins, of, bool(own))


def _comparable(features: Features, case: str, studies: Sequence[CaseStudy], metric: str) -> Sequence[CaseStudy]:
    """The ``studies`` comparable with a case with these ``features``. Errors in mm scale with motion, so the bones must move."""
    if _is_share(metric):
        return studies
    if not features["motion"] > 0:
        raise InputError(
            case, "bones that do not move", "a study of the case itself: fem-reference study CASE makes one"
        )
    found = [study for study in studies if study.features["motion"] > 0]
    if not found:
        raise InputError("studies", "none of a case whose bones move", f"such a study, or a study of {case} itself")
    return found


def _is_same(one: Features, other: Features) -> bool:
    """True if the features of a case have not changed since it was studied."""
    return all(math.isclose(value, other.get(name, math.nan), rel_tol=1e-6) for name, value in one.items())


def alike(features: Features, studies: Iterable[CaseStudy]) -> list[CaseStudy]:
    """The studies of the cases most similar to a case with these ``features``, the most similar first. The distance is the sum of
    the absolute logarithms of the ratios of features; cases with and without contact are far apart.
    """

    def distance(study: CaseStudy) -> float:
        pairs = [(_compared(features, name), _compared(study.features, name)) for name in _COMPARED]
        return sum(abs(math.log2((1e-3 + a) / (1e-3 + b))) for a, b in pairs)

    return sorted(studies, key=distance)[:_ALIKE]


def _compared(features: Features, name: str) -> float:
    if name == "motion_to_size":
        return features["motion"] / features["size"]
    return min(features[name], 1.0) if name == "contact" else features[name]


def _measured(study: CaseStudy, metric: str) -> list[Expected]:
    """The settings measured on a case, including the truth itself; the error bar of the truth is part of each error."""
    bar, pairs = study.bars.get(metric, 0.0), zip(study.points, study.certain, strict=True)
    known = [(point, pair) for point, certain in pairs if (pair := certain.at(metric, TIME))]
    return [Expected(point, error, time, (study.case,), bar) for point, (error, time) in known]


def _expected(features: Features, studies: Sequence[CaseStudy], metric: str, margins: Margins) -> Iterable[Expected]:
    """The settings that were measured on each of the most similar cases, with the largest error, scaled by motion, and the longest
    time, scaled by the number of triangles.
    """
    chosen = alike(features, studies)
    by_key = [
        {setting(one.point, study): one for one in _measured(study, metric) if is_elsewhere(one.point)}
        for study in chosen
    ]
    for key in set.intersection(*map(set, by_key)) if by_key else ():
        found = [(study, known[key]) for study, known in zip(chosen, by_key, strict=True)]
        error = max(one.error * scale(features, study.features, metric) for study, one in found)
        time = max(one.time * features["triangles"] / study.features["triangles"] for study, one in found)
        yield Expected(
            _translated(found[0][1].point, chosen[0], features),
            margins.error * error,
            margins.time * time,
            tuple(study.case for study in chosen),
        )


def scale(features: Features, other: Features, metric: str) -> float:
    """The factor from an error on the ``other`` case to one on this case. Errors in mm scale with motion; percentages do not."""
    return 1.0 if _is_share(metric) else features["motion"] / other["motion"]


def _is_share(metric: str) -> bool:
    return metric.startswith("volume.") or metric.endswith("_percent")


def _translated(point: Point, study: CaseStudy, features: Features) -> Point:
    """A ``point`` of a study with its tetrahedra scaled to another case; the size is doubled for each refinement below zero."""
    scene = dict(point.choice.get("scene", {}))
    if not set(TETRAHEDRA) <= set(scene):
        return point
    factor, fewer = tetrahedra(point, study)
    refinements = round(features["refinements"] - fewer)
    size = factor * features["tet_size"] * 2 ** max(0, -refinements)
    own = (f"{size:.6g} mm", max(0, refinements))
    return replace(point, choice=point.choice | {"scene": scene | dict(zip(TETRAHEDRA, own, strict=True))})


def _margins(studies: Sequence[CaseStudy], metric: str) -> Margins:
    """Margins from leaving out each study in turn: quantiles of its measured values divided by those expected from the others."""
    errors, times = list[float](), list[float]()
    for study in studies:
        others = [other for other in studies if other is not study]
        measured = {setting(one.point, study): one for one in _measured(study, metric)}
        for one in _expected(study.features, others, metric, Margins()):
            if (here := measured.get(setting(one.point, study))) is not None:
                errors.append(here.error / one.error)
                times.append(here.time / one.time)
    if not errors:
        return Margins(2.0, 2.0)  # a single study does not show how cases differ
    return Margins(*(max(1.0, float(np.quantile(ratios, _MET))) for ratios in (errors, times)))


def setting(point: Point, study: CaseStudy) -> str:
    """A key that identifies a setting across cases, with the size of tetrahedra relative to the case's own reference."""
    scene = point.choice.get("scene", {})
    if not is_elsewhere(point):
        return f"{study.case}: {point.label}"
    if "triangles" in scene:
        return f"{point.solver}: {scene['triangles']} as many triangles, {_settings(point)}"
    if scene:
        factor, fewer = tetrahedra(point, study)
        return f"{point.solver}: tetrahedra {factor:.3g}, {fewer:g} refinements fewer, {_settings(point)}"
    return f"{point.solver}: {_settings(point)}"


def is_elsewhere(point: Point) -> bool:
    """True if a setting can be used on another case: of its scene keys, only those of the mesh can be transferred."""
    return not set(point.choice.get("scene", {})) - {*TETRAHEDRA, "triangles"}


def tetrahedra(point: Point, study: CaseStudy) -> tuple[float, float]:
    """The size of a point's unrefined tetrahedra divided by its case's, and how many fewer refinements it has than its case."""
    scene = point.choice["scene"]
    size = float(str(scene["muscle.tet_size"]).removesuffix(" mm"))
    return size / study.features["tet_size"], study.features["refinements"] - scene["muscle.refinements"]


def _settings(point: Point) -> str:
    own = {name: value for name, value in point.choice.items() if name not in ("scene", "solver", "name")}
    return ", ".join(f"{name} = {value}" for name, value in sorted(own.items(), key=str))


@dataclass(frozen=True)
class Transfer:
    """A setting of a ``solver`` that was ``chosen`` on all cases except ``left_out``, and then applied to that case. On that case,
    ``error`` is its error, ``best`` the smallest error of all compared settings, and ``default`` the error of the default
    setting, NaN if there is none.
    """

    solver: str
    left_out: str
    chosen: str
    error: float
    best: float
    default: float

    @property
    def loss(self) -> float:
        """The ratio of the error to the ``best`` error, minus one: 0 if the chosen setting is the best on that case too."""
        return self.error / self.best - 1


def transfers(studies: Iterable[CaseStudy], error: str) -> tuple[Transfer, ...]:
    """For every solver and left-out case, the setting with the smallest mean logarithm of the error over the other cases, out of
    the settings measured on every case. An error below the bar of a truth counts as this bar.
    """
    by_solver: dict[str, dict[str, dict[str, float]]] = {}
    defaults: dict[tuple[str, str], float] = {}
    labels: dict[tuple[str, str], str] = {}
    for study in studies:
        for point in study.counted:
            value = point.errors.get(error, math.nan)
            if point.status != "converged" or not value > 0 or not is_elsewhere(point):
                continue
            key = setting(point, study)
            labels[key, study.case] = point.label
            by_solver.setdefault(point.solver, {}).setdefault(key, {})[study.case] = value
            if point.is_default:
                defaults.setdefault((point.solver, study.case), value)
    found = list[Transfer]()
    for solver, settings in by_solver.items():
        cases = sorted({case for values in settings.values() for case in values})
        everywhere = {label: values for label, values in settings.items() if len(values) == len(cases)}
        for left_out in cases if len(cases) > 1 and everywhere else ():
            others = [case for case in cases if case != left_out]
            means = {key: fmean(math.log(values[case]) for case in others) for key, values in everywhere.items()}
            chosen = min(means, key=lambda key: means[key])
            errors = everywhere[chosen][left_out], min(values[left_out] for values in everywhere.values())
            default = defaults.get((solver, left_out), math.nan)
            found.append(Transfer(solver, left_out, labels[chosen, left_out], *errors, default))
    return tuple(found)
