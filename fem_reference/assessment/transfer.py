"""Transfer of good settings from some cases to another: each case is left out in turn."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.settings import is_elsewhere, setting


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
        if len(cases) > 1 and everywhere:
            found += [_left_out(solver, everywhere, cases, case, defaults) for case in cases]
    return tuple(replace(one, chosen=labels[one.chosen, one.left_out]) for one in found)


def _left_out(
    solver: str,
    settings: dict[str, dict[str, float]],
    cases: Sequence[str],
    left_out: str,
    defaults: dict[tuple[str, str], float],
) -> Transfer:
    others = [case for case in cases if case != left_out]
    chosen = min(settings, key=lambda label: fmean(math.log(settings[label][case]) for case in others))
    best = min(values[left_out] for values in settings.values())
    default = defaults.get((solver, left_out), math.nan)
    return Transfer(solver, left_out, chosen, settings[chosen][left_out], best, default)
