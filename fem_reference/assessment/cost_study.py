"""Studies of the cost of accuracy: for each case, points of error and cost, as shown on pages and stored in files."""

import math
import operator
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from fem_reference import metrics
from fem_reference.assessment.claims import Claim
from fem_reference.assessment.fronts import TETRAHEDRA, Amount, Point
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.io import texts

FORMAT = 1
# The minimum and the maximum magnitude of a feature that is not 0, in its unit, and the maximum magnitude of the number of
# refinements.
_LEAST, _MOST, _FINEST = 1e-9, 1e15, 20
# The features by which recommendations compare cases, and the features that must be positive because they are divisors.
FEATURES = ("size", "triangles", "motion", "contact", "bulk_to_shear", "fibres_to_shear", "tet_size", "refinements")
_ABOVE_ZERO = ("size", "triangles", "tet_size")
_WANT = "a study written by the verb study"


@dataclass(frozen=True, eq=False)
class CaseStudy:
    """The points of a case, with their errors and costs.

    ``truth``: a description of the solution from which errors are measured. ``units`` and ``bars``: the units of errors and the
    error bars of the truth, by ``metric.statistic``. ``claims``: error bars of coarser references, with the errors of these
    references. ``triangles``: the number of triangles of the surface. ``travel`` [mm]: the maximum displacement of the truth.
    ``features``: features of the case, as far as its scene states them (:mod:`studies.features`). ``truth_key``: the folder of the
    truth's run in a store, empty if it is not known.
    """

    case: str
    title: str
    truth: str
    points: tuple[Point, ...]
    units: dict[str, str]
    bars: dict[str, Amount]
    claims: tuple[Claim, ...]
    triangles: int
    travel: Amount
    features: dict[str, Amount] = field(default_factory=dict)
    truth_key: str = ""

    @property
    def counted(self) -> tuple[Point, ...]:
        """The points, with each error at least the error bar of the truth, because smaller errors cannot be distinguished."""
        return self._with_errors(max)

    @property
    def certain(self) -> tuple[Point, ...]:
        """The points with upper bounds of their errors: the error plus the bar of the truth; for the truth itself its bar."""
        return self._with_errors(operator.add)

    def _with_errors(self, of: Callable[[float, float], float]) -> tuple[Point, ...]:
        """The points with each error replaced by ``of(error, bar)``; the errors of the truth itself are its error bars."""
        names = {name for point in self.points for name in point.errors}
        own = {name: bar for name, bar in self.bars.items() if name in names}
        others = (
            {name: of(value, self.bars.get(name, 0.0)) for name, value in point.errors.items()} for point in self.points
        )
        return tuple(
            replace(point, errors=own if point.is_truth else errors)
            for point, errors in zip(self.points, others, strict=True)
        )


@dataclass(frozen=True, eq=False)
class Study:
    """Studies of ``cases``; ``missing``: by case, the reason for its omission; ``origin``: the provenance of the measurements."""

    cases: tuple[CaseStudy, ...]
    missing: dict[str, str] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)

    @property
    def points(self) -> tuple[Point, ...]:
        """All points of all cases."""
        return tuple(point for case in self.cases for point in case.points)


def facts(case: CaseStudy, origin: dict[str, str]) -> dict[str, Any]:
    """The study of a case as valid JSON."""
    return {"format": FORMAT, **asdict(case), "origin": origin}


def load(path: Path) -> list[CaseStudy]:
    """The studies in a file written by :func:`facts`, of one case or of several cases. Raises InputError with the invalid key."""
    found = texts.read_json(path, _WANT)
    if isinstance(found, list) and found:
        return [_read(one, f"{path}: [{i}]") for i, one in enumerate(found)]
    return [_read(found, f"{path}")]


def _read(table: Any, place: str) -> CaseStudy:
    if not isinstance(table, dict):
        raise InputError(place, repr(table), _WANT)
    if table.get("format") != FORMAT:
        raise InputError(f"{place}: format", table.get("format", "nothing"), str(FORMAT))
    study = parse(CaseStudy, table, place)
    _check(study, place)
    return study


def _check(study: CaseStudy, place: str) -> None:
    """Raise InputError, with a key inside ``place``, if a study lacks a feature, or has an unknown unit or unusable points."""
    _check_features(study, place)
    known = metrics.units()
    for name, unit in study.units.items():
        if unit != known.get(name, unit) or unit not in known.values():
            want = known.get(name) or f"one of {', '.join({*known.values()})}"
            raise InputError(f"{place}: units.{name}", f'"{unit}"', want)
    for i, point in enumerate(study.points):
        for name in point.errors:
            if name not in study.units:
                raise InputError(f"{place}: points[{i}].errors.{name}", "an error without a unit", f"units.{name}")
        _check_scene(point.choice.get("scene", {}), f"{place}: points[{i}].choice.scene")


def _check_features(study: CaseStudy, place: str) -> None:
    """Raise InputError, with a key inside ``place``, if a study lacks a feature, or a feature has an impossible value."""
    for name in FEATURES:
        if name not in study.features:
            raise InputError(f"{place}: features.{name}", "nothing", "this number: run the verb study again")
        value = study.features[name]
        if name in _ABOVE_ZERO and not value > 0:
            raise InputError(f"{place}: features.{name}", f"{value:g}", "more than 0")
        if value and not _LEAST <= abs(value) <= _MOST:
            raise InputError(f"{place}: features.{name}", f"{value:g}", f"0, or a number from {_LEAST:g} to {_MOST:g}")
    if not abs(study.features["refinements"]) <= _FINEST:
        raise InputError(f"{place}: features.refinements", f"{study.features['refinements']:g}", f"at most {_FINEST}")


def _check_scene(scene: Any, place: str) -> None:
    """Raise InputError if the scene keys that a point changes are not a table, or do not define a valid size of tetrahedra."""
    if not isinstance(scene, dict):
        raise InputError(place, repr(scene), "a table of keys")
    for key in TETRAHEDRA if {*TETRAHEDRA} & {*scene} else ():
        if key not in scene:
            raise InputError(f"{place}.{key}", "nothing", f"this key, as {' and '.join(TETRAHEDRA)} go together")
        try:
            size = float(str(scene[key]).removesuffix(" mm"))
        except ValueError:
            size = math.nan
        if not size >= 0:
            raise InputError(f"{place}.{key}", f'"{scene[key]}"', 'a size such as "8 mm", or a number of refinements')
