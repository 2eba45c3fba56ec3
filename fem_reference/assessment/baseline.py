"""The baseline of a candidate: a JSON file with its earlier measures and positions, and the allowed changes since then."""

import json
import logging
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from fem_reference import metrics
from fem_reference.assessment.differences import greatest
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record, parse
from fem_reference.foundations.version import __version__
from fem_reference.geometry.distance import farthest_points
from fem_reference.io import files, texts
from fem_reference.metrics import Measure
from fem_reference.scenes.muscle import MuscleCase

log = logging.getLogger(__name__)

FORMAT = 1
# The number of stored decimal places: of a statistic, by its unit, and of a coordinate [mm].
PLACES = {"mm": 4, "%": 4, "deg": 4, "mm3": 1, "N": 4, "N mm": 2, "kPa": 4}
POSITION_PLACES = 2
# The maximum distance [mm] between a position and its rounded value.
POSITION_ROUNDING = math.sqrt(3) * 0.5 * 10**-POSITION_PLACES
# The number of sampled vertices, which take about 1.3 kB per frame. Motion of other vertices is visible only in the statistics.
SAMPLED = 64
# The tolerance of positions [mm] in a new baseline, far below visible differences. It must be larger if machines differ more.
MOVED = 0.1
# The tolerance of a statistic is at most this fraction of its maximum over the frames.
SHARE = 0.02
# The allowed value is slightly above the measured value, to allow for rounding.
_ROUNDING = 1 + 1e-6
README = (
    "tolerance: the allowed distance of a value from the value stored here; within: its allowed distance from the reference, in "
    "the same unit (null: not known). Both may be edited; 'check --update' replaces the values and keeps both limits. A statistic "
    "whose entry is removed is not judged."
)


class StoredStatistic(Record):
    """One statistic in ``unit``: ``values`` per frame, ``tolerance`` for a change, and ``within``, the limit on their magnitude."""

    tolerance: float = Field(ge=0)
    unit: str
    values: tuple[float | None, ...]
    within: float | None = Field(ge=0)

    @property
    def numbers(self) -> Floats:
        """The values (f,), NaN where there is none."""
        return np.array(self.values, float)


class Positions(Record):
    """Positions ``values`` (f, s, 3) [mm] of sampled ``vertices`` (s,) of ``CurrentMeasures.points``; their ``tolerance`` [mm]."""

    tolerance: float = Field(ge=0)
    values: tuple[tuple[tuple[float, float, float] | None, ...], ...]
    vertices: tuple[Annotated[int, Field(ge=0)], ...] = Field(min_length=1)

    def points(self, count: int, place: str) -> Floats:
        """The values (f, s, 3), NaN where there is none; InputError at ``place`` if a vertex number is not below ``count``."""
        if max(self.vertices) >= count:
            raise InputError(f"{place}: positions.vertices", max(self.vertices), f"0 to {count - 1}")
        return np.array([[(math.nan,) * 3 if one is None else one for one in frame] for frame in self.values])


class Baseline(Record):
    """The contents of the file: its subject (``case``, ``scene`` key, ``candidate``), its provenance (``reference`` run and
    version of ``fem_reference``), the ``frames`` (f,), and the measures by ``metric.statistic``.
    """

    candidate: str
    case: str
    fem_reference: str
    format: Literal[1]
    frames: tuple[int, ...]
    measures: dict[str, StoredStatistic]
    positions: Positions
    readme: str
    reference: str
    scene: str


def check(path: Path, case: MuscleCase, candidate: str) -> None:
    """Raise InputError if an update of ``path`` would overwrite a damaged file, or a file of another case or candidate."""
    if path.exists():
        _check_whose(path, _read(path), case, candidate)


def read(path: Path, case: MuscleCase, candidate: str) -> Baseline:
    """The baseline in ``path``; InputError if it is missing, damaged, or of another case, scene or candidate."""
    baseline = _read(path)
    _check_whose(path, baseline, case, candidate)
    if baseline.scene != case.key:
        got = f"{baseline.scene[:16]}..., while {case.place} is {case.key[:16]}..."
        want = "the key of this scene (it has changed since then; --update stores the current measures)"
        raise InputError(f"{path}: scene", got, want)
    if baseline.frames != case.numbers:
        raise InputError(
            f"{path}: frames", f"{len(baseline.frames)} numbers that differ from the scene's", "its frame numbers"
        )
    return baseline


def update(path: Path, current: CurrentMeasures) -> Baseline:
    """Write the current values into ``path``. Every tolerance, and every ``within`` that is a number, stay as in the file, so that
    accuracy cannot be lost in small steps; statistics removed from the file are not added again.
    """
    check(path, current.scene, current.candidate.name)
    before = _read(path) if path.exists() else None
    kept = {} if before is None else before.measures
    vertices = farthest_points(current.rest, SAMPLED)
    baseline = Baseline(
        candidate=current.candidate.name,
        case=current.scene.name,
        fem_reference=__version__,
        format=1,
        frames=current.candidate.numbers,
        measures={
            name: _stored(one, current.bars(name), kept.get(name))
            for name, one in current.by_name.items()
            if before is None or name in kept
        },
        positions=Positions(
            tolerance=MOVED if before is None else before.positions.tolerance,
            values=tuple(tuple(_rounded(point) for point in frame[vertices]) for frame in current.points),
            vertices=tuple(vertices.tolist()),
        ),
        readme=README,
        reference=current.reference_name,
        scene=current.scene.key,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    files.write_text(path, text(baseline.model_dump(mode="json")) + "\n")
    log.info("baseline: %s, %d statistics of %d frames", path, len(baseline.measures), len(baseline.frames))
    return baseline


def _read(path: Path) -> Baseline:
    place, want = f"{path}", "the baseline of a candidate (--update writes it)"
    table = texts.read_json(path, want)
    if not isinstance(table, dict) or table.get("format") != FORMAT:
        got = table.get("format", "nothing") if isinstance(table, dict) else "no table"
        raise InputError(f"{place}: format", got, f"{FORMAT}, {want}")
    baseline = parse(Baseline, table, f"{place}: baseline")
    _check_shape(place, baseline)
    return baseline


def _check_shape(place: str, baseline: Baseline) -> None:
    """Raise InputError unless all lists that belong together are equally long, and every statistic exists."""
    known, frames = metrics.units(), len(baseline.frames)
    for name, stored in baseline.measures.items():
        key = f"{place}: measures.{name}"
        if known.get(name) != stored.unit:
            want = "an existing statistic" + (f", in {known[name]}" if name in known else "")
            raise InputError(key, f'a statistic in "{stored.unit}"', want)
        if len(stored.values) != frames:
            raise InputError(f"{key}.values", f"{len(stored.values)} values", f"{frames}, one per frame")
    positions = baseline.positions
    if len(positions.values) != frames or {len(row) for row in positions.values} != {len(positions.vertices)}:
        want = f"{len(positions.vertices)} vertices in each of {frames} frames"
        raise InputError(f"{place}: positions.values", "a different number of positions", want)


def _check_whose(path: Path, baseline: Baseline, case: MuscleCase, candidate: str) -> None:
    """Raise InputError if a baseline belongs to another case or candidate."""
    for key, got, want in (("case", baseline.case, case.name), ("candidate", baseline.candidate, candidate)):
        if got != want:
            raise InputError(f"{path}: {key}", f'"{got}"', f'"{want}", which is being checked')


def _stored(one: Measure, bars: Floats, before: StoredStatistic | None) -> StoredStatistic:
    """A statistic with its limits from ``before``, or else from its error bars."""
    tolerance, within = limits(one, bars)
    if before is not None:
        tolerance, within = before.tolerance, within if before.within is None else before.within
    digits = PLACES[one.unit]
    values = tuple(round(value, digits) + 0.0 if math.isfinite(value) else None for value in one.values.tolist())
    return StoredStatistic(tolerance=tolerance, unit=one.unit, values=values, within=within)


def limits(one: Measure, bars: Floats) -> tuple[float, float | None]:
    """The limits of a statistic in a new baseline, from the error bars (f,) of its deviation: the tolerance for changes, and the
    maximum distance from the reference (None if not known).

    Tolerance: the maximum bar, as smaller changes do not matter, but at most ``SHARE`` of the maximum value, as stored values are
    exact even if the reference is uncertain. Distance: the maximum sum of a value and its bar; for a measure of the run itself,
    which has no bar, the maximum value plus its tolerance.
    """
    least = 10.0 * 10.0 ** -PLACES[one.unit]
    values, bar, itself = np.abs(one.values), greatest(bars), metrics.of_itself(one.metric)
    share = SHARE * greatest(values)
    tolerance = _up(np.nanmax([least, share if itself else np.fmin(share, bar)]))
    if math.isnan(bar) or math.isnan(share):
        return tolerance, None
    known = greatest(values + (tolerance if itself else bars))
    return tolerance, _up(max(least, _ROUNDING * known))


def _up(value: float) -> float:
    """Three significant digits, rounded up.

    >>> _up(0.123456), _up(20.0), _up(0.0)
    (0.124, 20.0, 0.0)
    """
    if value == 0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return float(f"{math.ceil(value / step) * step:.6g}")


def _rounded(point: Floats) -> tuple[float, float, float] | None:
    if not np.isfinite(point).all():
        return None
    x, y, z = (round(float(value), POSITION_PLACES) + 0.0 for value in point)
    return x, y, z


def text(value: Any, indent: str = "") -> str:
    """JSON with sorted keys, one line for each key and each entry of a list of lists, so that a change affects few lines."""
    inside = f"{indent} "
    if isinstance(value, dict):
        rows: Iterable[str] = (f"{json.dumps(key)}: {text(value[key], inside)}" for key in sorted(value))
        return _block("{}", rows, indent)
    if isinstance(value, list) and value and isinstance(value[0], list):
        return _block("[]", (json.dumps(row, separators=(",", ":"), allow_nan=False) for row in value), indent)
    return json.dumps(value, allow_nan=False)


def _block(brackets: str, rows: Iterable[str], indent: str) -> str:
    return f"{brackets[0]}\n{indent} " + f",\n{indent} ".join(rows) + f"\n{indent}{brackets[1]}"
