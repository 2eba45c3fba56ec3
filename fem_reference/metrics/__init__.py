"""Metrics: one file each, named as in scene files and JSON. A metric does not know the solver of a run.

Contract (tests/test_metrics.py): zero against itself, a known change gives a known value, NaN stays NaN, units stated. One
metric, penetration, is of the run alone: against itself too it is what it is.
"""

import importlib
import pkgutil
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Polylines, vertex_areas
from fem_reference.geometry.extension import Extension
from fem_reference.problems.muscle import RigidBody
from fem_reference.runs.store import Run


@dataclass(frozen=True, eq=False)
class Measure:
    """One statistic of one metric: ``values`` per frame (f,) in ``unit``; ``where`` (f,) says in words where each is worst."""

    metric: str
    statistic: str
    unit: str
    values: Floats
    where: tuple[str, ...] = ()

    @property
    def worst(self) -> int:
        """Index of the frame with the greatest magnitude; a frame that is not a number counts as worst of all."""
        magnitudes = np.abs(self.values)
        return int(np.argmax(np.where(np.isnan(magnitudes), np.inf, magnitudes)))


@dataclass(frozen=True, eq=False)
class MeasurementContext:
    """What every run of a scene is measured with, the same for all: ``areas`` (n,) [mm2] around the surface's vertices at rest,
    the ``fibres`` at rest and the ``extension`` that carries a surface's displacement to their points, ``travel`` [mm], the
    greatest displacement of the reference's surface over its frames, and the ``bones``, with the vertices that are ``free`` (n,)
    of them.
    """

    areas: Floats
    fibres: Polylines
    extension: Extension
    travel: float
    bones: tuple[RigidBody, ...]
    free: NDArray[np.bool_]

    @classmethod
    def of(
        cls, reference: Run, fibres: Polylines, bones: tuple[RigidBody, ...], free: NDArray[np.bool_] | None = None
    ) -> "MeasurementContext":
        """The measurement context of a reference run; without ``free`` (n,), every vertex is free."""
        rest = reference.surface
        return cls(
            areas=vertex_areas(rest.points, rest.triangles),
            fibres=fibres,
            extension=Extension.to(fibres.points, rest),
            travel=float(np.nanmax(np.linalg.norm(reference.positions - rest.points, axis=2))),
            bones=bones,
            free=np.ones(len(rest.points), bool) if free is None else free,
        )


def names() -> list[str]:
    """The metrics there are."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def units() -> dict[str, str]:
    """The unit of every ``metric.statistic`` there is."""
    modules = {name: importlib.import_module(f"{__name__}.{name}") for name in names()}
    return {f"{name}.{statistic}": unit for name, module in modules.items() for statistic, unit in module.UNITS.items()}


def of_itself(name: str) -> bool:
    """Whether the metric ``name`` says something of a run alone, whatever it is measured against."""
    return getattr(importlib.import_module(f"{__name__}.{name}"), "OF_ITSELF", False)


def of_lines(name: str) -> bool:
    """Whether the metric ``name`` is of the fibres alone, so that it needs no surface."""
    return getattr(importlib.import_module(f"{__name__}.{name}"), "OF_LINES", False)


def measure(
    run: Run, reference: Run, context: MeasurementContext, wanted: Iterable[str] | None = None
) -> tuple[Measure, ...]:
    """Every statistic of every metric (or of those ``wanted``) of ``run`` against ``reference``, frame by frame; both must have
    the same frames. Of a run without a surface only what needs none.
    """
    chosen = [name for name in (names() if wanted is None else wanted) if run.has_surface or of_lines(name)]
    modules = (importlib.import_module(f"{__name__}.{name}") for name in chosen)
    return tuple(statistic for module in modules for statistic in module.measure(run, reference, context))


def find(measures: Iterable[Measure], metric: str, statistic: str) -> Measure | None:
    """The measure of that name, None where it was not taken."""
    return next((found for found in measures if (found.metric, found.statistic) == (metric, statistic)), None)


def at_rest(run: Run) -> Run:
    """The rest state of ``run``, fibres too, repeated over its frames: against it, a run reports its change from rest."""
    frames = len(run.numbers)
    still = np.broadcast_to(run.surface.points, (frames, *run.surface.points.shape))
    fibres = None if run.fibres is None else np.broadcast_to(run.fibres.points, (frames, *run.fibres.points.shape))
    return Run("rest", "rest", run.outcome, run.numbers, run.surface, still, run.fibres, fibres)


def rms(deviations: Floats, weights: Floats) -> Floats:
    """Root of the weighted mean square of each row of ``deviations`` (f, n), (f,)."""
    return np.asarray(np.sqrt(deviations**2 @ weights / weights.sum()))


def percentile(values: Floats, weights: Floats, share: float) -> float:
    """The least of ``values`` (n,) that ``share`` of the weight does not exceed; NaN where one is not finite."""
    if not np.isfinite(values).all():
        return float("nan")
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(below, share * below[-1])]])
