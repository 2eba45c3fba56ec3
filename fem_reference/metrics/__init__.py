"""Metrics: one file each, named as in scene files and JSON. A metric does not know the solver of a run.

Contract (tests/contracts/test_every_metric.py): a run against itself gives zero, a known change gives a known value, NaN stays NaN,
and units are stated. Each metric describes its ``STATISTICS``. It states the part of a run that it measures (``OF``: surface, lines
or field) and its standard (``AGAINST``): the reference (or the rest state), the exact solution, or the run itself.
"""

import importlib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any, Literal, Protocol, cast, overload

import numpy as np

from fem_reference.foundations import modules
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, vertex_areas
from fem_reference.geometry.exemption import Exemption
from fem_reference.geometry.extension import Extension
from fem_reference.problems.fibre_ends import FibreEnds, attached_ends
from fem_reference.problems.of_case import CaseSetup
from fem_reference.problems.setup import Bone, Joint, Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Part, Standard

# Places where pages show a statistic. ``main``: notebooks and the page of omitted effects; ``table``: a comparison's first table;
# ``headline``: its summary; ``curve``: plots of changes from rest; ``angle``: plots over a joint's angle; ``solvers``: tables of
# solvers; ``scenes``: the table of all scenes; ``rank``: rankings of solvers; ``claim``: error bars compared with true errors.
Shown = Literal["main", "table", "headline", "curve", "angle", "solvers", "scenes", "rank", "claim"]


@dataclass(frozen=True)
class Statistic:
    """The description of a statistic, stated by its metric.

    ``title`` and ``part``: headings of the group of columns and of the column. ``headline``: a phrase with ``{}`` for the value.
    ``curve``: the title of the plot of changes from rest. ``share_of``: the quantity that is 100 %. ``shown``: by place, the rank
    of the statistic in the order there, the lowest first. ``local``: True if its error converges like that of the worst point.
    ``lone``: True for the value of a single fibre or of the force on a bone, which is not a mean. ``pooled``: True if the
    statistics of its metric belong to one field in one unit. A difference that is small by chance is then replaced by the rms of
    the differences of all these statistics.
    """

    unit: str
    title: str = ""
    part: str = ""
    headline: str = ""
    curve: str = ""
    share_of: str = ""
    shown: Mapping[Shown, int] = field(default_factory=dict)
    local: bool = False
    lone: bool = False
    pooled: bool = False

    @property
    def label(self) -> str:
        """The title and the part in one text."""
        return f"{self.title}, {self.part}" if self.part else self.title

    @property
    def full_unit(self) -> str:
        """The unit, and for per cent also the quantity that is 100 %."""
        return f"{self.unit} of {self.share_of}" if self.share_of else self.unit


@dataclass(frozen=True, eq=False)
class Measure:
    """One statistic of one metric: ``values`` (f,) in ``unit`` at frame ``numbers`` (f,), which count from 0 if not given.
    ``where`` (f,): the worst point in each frame, in words. ``error_bars`` (f,): the bars of the reference, None if it has none.
    """

    metric: str
    statistic: str
    unit: str
    values: Floats
    where: tuple[str, ...] = ()
    numbers: tuple[int, ...] = ()
    error_bars: Floats | None = None

    @property
    def worst(self) -> "Worst":
        """The frame with the largest magnitude; NaN counts as the largest."""
        return self._at(np.where(np.isnan(self.values), np.inf, np.abs(self.values)))

    @property
    def worst_number(self) -> "Worst | None":
        """The frame with the largest magnitude among those with a finite value, None if there are none."""
        known = np.isfinite(self.values)
        return self._at(np.where(known, np.abs(self.values), -1.0)) if known.any() else None

    def _at(self, magnitudes: Floats) -> "Worst":
        i = int(np.argmax(magnitudes))
        return Worst(
            value=float(self.values[i]),
            frame=self.numbers[i] if self.numbers else i,
            error_bar=None if self.error_bars is None else float(self.error_bars[i]),
            unit=self.unit,
            where=self.where[i] if self.where else "",
            index=i,
        )


@dataclass(frozen=True)
class Worst:
    """A measure in its worst frame: the number of the ``frame`` and its ``index``, the ``value`` and the ``error_bar`` of the
    reference (None if it has none) in ``unit``, and the position in words (``where``).
    """

    value: float
    frame: int
    error_bar: float | None
    unit: str
    where: str
    index: int


@dataclass(frozen=True, eq=False)
class MeasurementContext:
    """The data that all measurements of a case share. ``areas`` (n,) [mm2]: the area around each vertex of the surface at rest.
    ``fibres``: the fibres at rest. ``extension``: the operator that carries the displacement of a surface to the points of the
    fibres. ``travel`` [mm]: the maximum displacement of the reference's surface over all frames. ``bones``: the bones. ``exempt``:
    the part of the surface that is exempt from contact. ``joints``: the joints. ``ends``: the ends of the fibres, None without
    attachments.
    """

    areas: Floats
    fibres: Polylines
    extension: Extension
    travel: float
    bones: tuple[Bone, ...]
    exempt: Exemption
    joints: tuple[Joint, ...] = ()
    ends: FibreEnds | None = None

    @classmethod
    def of(
        cls,
        reference: Run,
        fibres: Polylines,
        bones: tuple[Bone, ...],
        exempt: Exemption | None = None,
        joints: tuple[Joint, ...] = (),
    ) -> "MeasurementContext":
        """The measurement context for a ``reference`` run; by default nothing is exempt from contact."""
        rest = reference.surface
        return cls(
            areas=vertex_areas(rest.points, rest.triangles),
            fibres=fibres,
            extension=Extension.to(fibres.points, rest),
            travel=float(np.nanmax(np.linalg.norm(reference.positions - rest.points, axis=2))),
            bones=bones,
            exempt=Exemption.of(rest) if exempt is None else exempt,
            joints=joints,
        )


@dataclass(frozen=True)
class FieldContext:
    """The data that all measurements of a scalar case share: the formula of the ``exact`` solution, None if it is not known."""

    exact: str | None


Context = MeasurementContext | FieldContext


@overload
def context_of(setup: Setup, reference: Run) -> MeasurementContext: ...
@overload
def context_of(setup: CaseSetup, reference: Run) -> Context: ...
def context_of(setup: CaseSetup, reference: Run) -> Context:
    """The :data:`Context` for runs of a case; InputError if the ``reference`` of a muscle lacks its surface or its fibres."""
    if "field" in reference.carries:
        return FieldContext(setup.exact)
    if not reference.has_surface:
        raise InputError(f"{reference.name}: surface", "a run of lines alone", "a reference that moves the surface")
    if reference.fibres is None:
        place = f"{reference.name}: fibres"
        raise InputError(place, "a run without an interior", "a reference that carries the fibres")
    own = cast("Setup", setup)  # for a single muscle; several muscles are measured one by one
    context = MeasurementContext.of(reference, reference.fibres, own.bones, own.exempt, own.joints)
    return replace(context, ends=attached_ends(own.attached, context.exempt, reference.fibres))


class Metric(Protocol):
    """The contents of the module of a metric."""

    STATISTICS: dict[str, Statistic]
    OF: Part
    AGAINST: Standard

    def measure(self, run: Run, reference: Run, context: Any, /) -> tuple[Measure, ...]:
        """All statistics of ``run`` against ``reference``, frame by frame."""


def metric(name: str) -> Metric:
    """The metric ``name``."""
    return cast(Metric, importlib.import_module(f"{__name__}.{name}"))


def names(against: Collection[Standard] | None = None) -> list[str]:
    """The names of all metrics, or of the metrics measured ``against`` one of these standards."""
    return [name for name in modules.names(__path__) if against is None or metric(name).AGAINST in against]


@cache
def described(where: Shown | None = None) -> dict[tuple[str, str], Statistic]:
    """The statistics by metric and name: all, or those shown at one place (``where``), in the order of that place."""
    found = {(name, one): each for name in names() for one, each in metric(name).STATISTICS.items()}
    if where is None:
        return found
    chosen = {key: each for key, each in found.items() if where in each.shown}
    return dict(sorted(chosen.items(), key=lambda entry: entry[1].shown[where]))


def in_tables() -> tuple[str, ...]:
    """The metrics of the first table of a comparison."""
    return tuple(dict.fromkeys(name for name, _ in described("table")))


def units(of: Collection[Part] | None = None, against: Collection[Standard] | None = None) -> dict[str, str]:
    """The units by ``metric.statistic``: of all metrics, or of metrics ``of`` these parts and ``against`` these standards."""
    chosen = [name for name in names(against) if of is None or metric(name).OF in of]
    return {f"{name}.{one}": each.unit for (name, one), each in described().items() if name in chosen}


def of_itself(name: str) -> bool:
    """True if the metric ``name`` describes a run alone and does not depend on a reference."""
    return metric(name).AGAINST != "reference"


def measure(run: Run, reference: Run, context: Context, wanted: Iterable[str] | None = None) -> tuple[Measure, ...]:
    """All statistics of all metrics (or of the metrics ``wanted``) of ``run`` against ``reference``, frame by frame. Both runs must
    have the same frames. Metrics of a part that the run does not carry are left out.
    """
    chosen = map(metric, names() if wanted is None else wanted)
    return tuple(
        replace(statistic, numbers=run.numbers)
        for found in chosen
        if found.OF in run.carries
        for statistic in found.measure(run, reference, context)
    )


def measures(name: str, values: Mapping[str, Floats], where: Collection[str] = ()) -> tuple[Measure, ...]:
    """The measures of the metric ``name``. ``values`` (f,): its values by statistic; ``where`` (f,): the worst points, if known."""
    stated = metric(name).STATISTICS
    return tuple(
        Measure(name, one, stated[one].unit, each, tuple(where) or ("",) * len(each)) for one, each in values.items()
    )


def find(measures: Iterable[Measure], metric: str, statistic: str) -> Measure | None:
    """The measure of this metric and statistic, None if there is none."""
    return next((found for found in measures if (found.metric, found.statistic) == (metric, statistic)), None)


def at_rest(run: Run) -> Run:
    """The rest state of ``run`` and of its fibres, repeated over its frames: the standard for its change from rest."""
    frames = len(run.numbers)
    still = np.broadcast_to(run.surface.points, (frames, *run.surface.points.shape))
    fibres = None if run.fibres is None else np.broadcast_to(run.fibres.points, (frames, *run.fibres.points.shape))
    parts = run.surface, still, run.fibres, fibres
    return Run("rest", "rest", run.outcome, run.numbers, *parts, has_surface=run.has_surface)


def change(run: Run, context: MeasurementContext, wanted: Iterable[str] | None = None) -> tuple[Measure, ...]:
    """All statistics of the change from rest of a ``run`` by the reference's solver, measured on the fibres of this run. If
    overlaps with bones are removed at the start, the fibres of two runs differ at rest. To measure both on the same fibres, the
    surface of one run would have to carry the fibres of the other.
    """
    own = context if run.fibres is None else replace(context, fibres=run.fibres)
    return measure(run, at_rest(run), own, wanted)


def as_surface(run: Run) -> Run:
    """The ``run`` without its interior, so that its surface carries the measured fibres, as for a candidate."""
    return replace(run, fibres=None, fibre_positions=None)


def at_vertices(run: Run, vertices: Ints) -> tuple[str, ...]:
    """The numbers of the ``vertices`` (f,) of a field's mesh and their positions, in words."""
    places = (", ".join(f"{x:.4g}" for x in run.points[vertex]) for vertex in vertices)
    return tuple(f"vertex {vertex} at ({place})" for vertex, place in zip(vertices, places, strict=True))


def rms(deviations: Floats, weights: Floats) -> Floats:
    """The root (f,) of the weighted mean square of each row of ``deviations`` (f, n), with ``weights`` (n,)."""
    return np.asarray(np.sqrt(deviations**2 @ weights / weights.sum()))


def percentile(values: Floats, weights: Floats, share: float) -> float:
    """The smallest of ``values`` (n,) up to which at least the fraction ``share`` of the weight lies; NaN unless all are finite."""
    if not np.isfinite(values).all():
        return float("nan")
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(below, share * below[-1])]])
