"""Measures of the current output of a candidate against the reference."""

from dataclasses import dataclass

import numpy as np

from fem_reference import metrics
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase


@dataclass(frozen=True, eq=False)
class CurrentMeasures:
    """The current output of a candidate, measured against the ``reference``; ``error_bars`` of the reference, None if unknown."""

    scene: MuscleCase
    candidate: Run
    reference: Run
    measures: tuple[Measure, ...]
    error_bars: ErrorBars | None

    @classmethod
    def of(
        cls, case: MuscleCase, setup: Setup, candidate: Run, reference: Run, error_bars: ErrorBars | None = None
    ) -> "CurrentMeasures":
        """Measure a candidate against its reference. Both must have the frames of the case."""
        measures = metrics.measure(candidate, reference, metrics.context_of(setup, reference))
        return cls(case, candidate, reference, measures, error_bars)

    @property
    def points(self) -> Floats:
        """Positions (f, n, 3) [mm] of the vertices of the candidate, or of its fibre points if it has no surface."""
        inside = self.candidate.fibre_positions
        return self.candidate.positions if self.candidate.has_surface or inside is None else inside

    @property
    def rest(self) -> Floats:
        """The :attr:`points` at rest (n, 3) [mm]."""
        fibres = self.candidate.fibres
        return self.candidate.surface.points if self.candidate.has_surface or fibres is None else fibres.points

    @property
    def reference_name(self) -> str:
        """The folder of the reference in the store, named by scene, settings and code; the solver if there is no folder."""
        folder = self.reference.folder
        return self.reference.solver if folder is None else folder.name

    @property
    def by_name(self) -> dict[str, Measure]:
        """The measures by ``metric.statistic``, without those that repeat another measure in per cent."""
        found = {f"{one.metric}.{one.statistic}": one for one in self.measures}
        return {name: one for name, one in found.items() if name.removesuffix("_percent") not in found.keys() - {name}}

    def values(self, name: str) -> Floats:
        """The values (f,) of a ``metric.statistic``; NaN if they are not finite, or if it was not measured for this candidate."""
        found = metrics.find(self.measures, *name.split("."))
        values = np.full(len(self.reference.numbers), np.nan) if found is None else found.values
        return np.where(np.isfinite(values), values, np.nan)

    def bars(self, name: str) -> Floats:
        """The error bars (f,) of a deviation by ``metric.statistic``, NaN if unknown; 0 for statistics of the run itself."""
        metric, statistic = name.split(".")
        if metrics.of_itself(metric):
            return np.zeros(len(self.reference.numbers))
        found = None if self.error_bars is None else self.error_bars.find("deviation", metric, statistic)
        return np.full(len(self.reference.numbers), np.nan) if found is None else found.values
