"""Settings of solvers across cases whose tetrahedra differ in size, and the transfer of good ones to a case that is left out."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import fmean

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import TETRAHEDRA, Point


def setting(point: Point, study: CaseStudy) -> str:
    """A key that identifies a setting across cases; tetrahedra count by their size relative to the case's own reference."""
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
    """True where a setting can be used on another case: only mesh keys of a scene are transferable."""
    return not set(point.choice.get("scene", {})) - {*TETRAHEDRA, "triangles"}


def tetrahedra(point: Point, study: CaseStudy) -> tuple[float, float]:
    """The size of a point's tetrahedra relative to the case's own before refinement, and its difference in refinements."""
    scene = point.choice["scene"]
    size = float(str(scene["muscle.tet_size"]).removesuffix(" mm"))
    return size / study.features["tet_size"], study.features["refinements"] - scene["muscle.refinements"]


def _settings(point: Point) -> str:
    own = {name: value for name, value in point.choice.items() if name not in ("scene", "solver", "name")}
    return ", ".join(f"{name} = {value}" for name, value in sorted(own.items(), key=str))


@dataclass(frozen=True)
class Transfer:
    """Settings of a ``solver`` chosen on all cases but one (``left_out``) and applied to that: their ``error`` there, the
    ``best`` error of any of the same settings there, and that of the ``default`` (NaN where there is none).
    """

    solver: str
    left_out: str
    chosen: str
    error: float
    best: float
    default: float

    @property
    def loss(self) -> float:
        """The error over the least possible, minus one: 0 where the chosen settings are the best there too."""
        return self.error / self.best - 1


def transfers(studies: Iterable[CaseStudy], error: str) -> tuple[Transfer, ...]:
    """For every solver and case, the settings with the least mean logarithm of the error over the other cases, among those
    measured on every case; an error below the bar of a truth counts as the bar.
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
            chosen = _chosen(everywhere, cases, left_out)
            errors = everywhere[chosen][left_out], min(values[left_out] for values in everywhere.values())
            default = defaults.get((solver, left_out), math.nan)
            found.append(Transfer(solver, left_out, labels[chosen, left_out], *errors, default))
    return tuple(found)


def _chosen(settings: dict[str, dict[str, float]], cases: Iterable[str], left_out: str) -> str:
    """The key of the settings with the least mean logarithm of the error over all ``cases`` but the one ``left_out``."""
    others = [case for case in cases if case != left_out]
    return min(settings, key=lambda label: fmean(math.log(settings[label][case]) for case in others))
