"""The baseline of a candidate: a JSON file with earlier measures and positions of the candidate, and the allowed changes."""

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
# The number of decimal places that are stored: for a statistic, by its unit, and for a coordinate [mm].
PLACES = {"mm": 4, "%": 4, "deg": 4, "mm3": 1, "N": 4, "N mm": 2, "kPa": 4}
POSITION_PLACES = 2
# The maximum distance [mm] between a position and its rounded value.
POSITION_ROUNDING = math.sqrt(3) * 0.5 * 10**-POSITION_PLACES
# The number of sampled vertices, which take about 1.3 kB per frame. If only other vertices move, this shows only in the statistics.
SAMPLED = 64
# The tolerance of positions [mm] in a new baseline, far below visible differences. It must be increased if the results of different
# machines differ by more.
MOVED = 0.1
# The tolerance of a statistic is at most this fraction of its maximum over the frames.
SHARE = 0.02
# New limits of the distance from the reference are larger by this factor, to allow for rounding.
_ROUNDING = 1 + 1e-6
README = (
    "tolerance: the allowed distance of a value from the value stored here; within: its allowed distance from the reference, in "
    "the same unit (null: not known). Both may be edited; 'check --update' replaces the values and keeps both limits. A statistic "
    "whose entry is removed is not judged."
)


class StoredStatistic(Record):
    """A statistic in ``unit``, with its ``values`` in each frame, null for a value that is not finite. ``tolerance``: the allowed
    change of a value. ``within``: the allowed magnitude of a value, null if it is not known.
    """

    tolerance: float = Field(ge=0)
    unit: str
    values: tuple[float | None, ...]
    within: float | None = Field(ge=0)

    @property
    def numbers(self) -> Floats:
        """The values (f,), with NaN in place of None."""
        return np.array(self.values, float)


class Positions(Record):
    """Positions ``values`` (f, s, 3) [mm] of sampled vertices, and the ``tolerance`` [mm] for their change. ``vertices`` (s,): the
    indices of the sampled vertices in ``CurrentMeasures.points``.
    """

    tolerance: float = Field(ge=0)
    values: tuple[tuple[tuple[float, float, float] | None, ...], ...]
    vertices: tuple[Annotated[int, Field(ge=0)], ...] = Field(min_length=1)

    def points(self, count: int, place: str) -> Floats:
        """The positions (f, s, 3) [mm], NaN for None. Raises InputError at ``place`` if a vertex number is not below ``count``."""
        if max(self.vertices) >= count:
            raise InputError(f"{place}: positions.vertices", max(self.vertices), f"0 to {count - 1}")
        return np.array([[(math.nan,) * 3 if one is None else one for one in frame] for frame in self.values])


class Baseline(Record):
    """The contents of a baseline file.

    ``case``, ``scene`` and ``candidate``: the subject of the baseline; the scene is given by its key. ``reference`` and
    ``fem_reference``: the run of the reference and the version of the package with which the measures were made. ``frames`` (f,):
    the frame numbers. ``measures``: the statistics by ``metric.statistic``.
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
    """Raise InputError if an update of ``path`` would overwrite a damaged file, or the baseline of another case or candidate."""
    if path.exists():
        _check_whose(path, _read(path), case, candidate)


def read(path: Path, case: MuscleCase, candidate: str) -> Baseline:
    """The baseline in ``path``. Raises InputError if it is missing, damaged, or of another case, scene or candidate."""
    baseline = _read(path)
    _check_whose(path, baseline, case, candidate)
    if baseline.scene != case.key:
        got = f"{baseline.scene[:16]}..., while {case.place} is {case.key[:16]}..."
        want = "the key of this scene (it has changed since then; --update stores the current measures)"
        raise InputError(f"{path}: scene", got, want)
    if baseline.frames != case.numbers:
        raise InputError(
            f"{path}: frames",
            f"{len(baseline.frames)} frame numbers that differ from the scene's",
            "the scene's frame numbers",
        )
    return baseline


def update(path: Path, current: CurrentMeasures) -> Baseline:
    """Write the current values into ``path`` and return the new baseline.

    Every tolerance, and every ``within`` that is a number, is kept as it is in the file, so that accuracy cannot be lost in small
    steps. Statistics that were removed from the file are not added again.
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
    """Raise InputError unless all lists that belong together have the same length and every statistic exists."""
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
    """The statistic ``one`` as it is stored. Its limits are kept from ``before``; limits that are missing there follow from the
    error ``bars`` (f,).
    """
    tolerance, within = limits(one, bars)
    if before is not None:
        tolerance, within = before.tolerance, within if before.within is None else before.within
    digits = PLACES[one.unit]
    values = tuple(round(value, digits) + 0.0 if math.isfinite(value) else None for value in one.values.tolist())
    return StoredStatistic(tolerance=tolerance, unit=one.unit, values=values, within=within)


def limits(one: Measure, bars: Floats) -> tuple[float, float | None]:
    """The tolerance for changes of a statistic in a new baseline, and its maximum distance from the reference, None if this is not
    known.

    ``bars`` (f,): the error bars of the deviation. The tolerance is the maximum bar, because smaller changes do not matter, but at
    most ``SHARE`` of the maximum value, because stored values are exact even if the reference is uncertain. The maximum distance is
    the maximum sum of a value and its bar. A measure of the run itself has no bar: its tolerance is ``SHARE`` of the maximum value,
    and its maximum distance is the maximum value plus this tolerance.
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
    """The ``value`` rounded up to three significant digits.

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
    """JSON with sorted keys; each key, and each entry of a list of lists, has its own line, so that a change affects few lines."""
    inside = f"{indent} "
    if isinstance(value, dict):
        rows: Iterable[str] = (f"{json.dumps(key)}: {text(value[key], inside)}" for key in sorted(value))
        return _block("{}", rows, indent)
    if isinstance(value, list) and value and isinstance(value[0], list):
        return _block("[]", (json.dumps(row, separators=(",", ":"), allow_nan=False) for row in value), indent)
    return json.dumps(value, allow_nan=False)


def _block(brackets: str, rows: Iterable[str], indent: str) -> str:
    return f"{brackets[0]}\n{indent} " + f",\n{indent} ".join(rows) + f"\n{indent}{brackets[1]}"
