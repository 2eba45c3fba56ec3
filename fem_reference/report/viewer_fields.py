"""Further data of the 3D view in few bytes: colours in addition to the distance to the same vertex, fibres, arrows and joints.

quantities  name, signed, and top, the maximum magnitude [mm]: value = sign * top * (level / 127)^2
runs        levels by quantity: (f, n) of one byte, as differences from the previous frame; most: the maximum magnitude by
            quantity and frame; points: positions of fibre points
bars        error bar [mm] of the reference by quantity and frame; null in a frame without one, absent without error bars
fibres      lines (k,): number of points of each line; rest: length [mm] of each segment, by line; low, high: range of stretches
touched     for each run that touches a bone, (f, n) of one byte: 1 within ``NEAR`` of a bone, except for attached vertices
forces      arrows of each run by frame: point of application [mm] and force on a bone [N], six numbers for each arrow
joints      for each bone that moves: name, unit, and angle or distance by frame
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem_reference.assessment import local_fields
from fem_reference.assessment.comparison import Comparison
from fem_reference.export import forces
from fem_reference.foundations.mesh import Floats, Polylines
from fem_reference.io.texts import finite
from fem_reference.metrics import MeasurementContext
from fem_reference.metrics.fibre_length import fibre_points
from fem_reference.problems.setup import Bone, Setup
from fem_reference.report.at_frames import motions
from fem_reference.runs.store import Run, at_numbers

FIBRES, POINTS = 30, 12  # the maximum number of fibres that are drawn, and of points of each fibre
NEAR = 0.2  # distance [mm] within which a vertex touches a bone
_LEVELS = 127
# For each quantity, the statistic of the surface's deviation that is its maximum.
_BARS = {"distance": "max", "surface": "hausdorff"}
_FAR = 1e6  # [mm]: a fibre with a coordinate beyond this value counts as unknown


@dataclass(frozen=True, eq=False)
class Fields:
    """The quantities of the drawn ``runs``, of which the first is the reference, at frame ``numbers``."""

    comparison: Comparison
    runs: list[Run]
    numbers: tuple[int, ...]

    @property
    def context(self) -> MeasurementContext:
        """The measurement context of all runs."""
        assert isinstance(self.comparison.context, MeasurementContext)  # the comparison is of a muscle
        return self.comparison.context

    @cached_property
    def lines(self) -> tuple[Polylines, NDArray[np.int64]]:
        """The drawn fibres, and the indices of their points among all fibre points."""
        offsets = self.context.fibres.offsets
        chosen = np.unique(np.linspace(0, len(offsets) - 2, min(FIBRES, len(offsets) - 1)).round().astype(int)).tolist()
        spans = [(offsets[i], offsets[i + 1]) for i in chosen]
        points = [
            np.unique(np.linspace(first, end - 1, min(POINTS, end - first)).round().astype(np.int64))
            for first, end in spans
        ]
        ends = np.cumsum([0, *(len(own) for own in points)])
        indices = np.concatenate([np.zeros(0, np.int64), *points])
        return Polylines(self.context.fibres.points[indices], ends), indices

    @np.errstate(over="ignore", invalid="ignore")
    def points(self, run: Run) -> Floats:
        """Positions (f, m, 3) [mm] of the drawn fibre points in a run, NaN in a frame in which they are not known."""
        found = np.array(fibre_points(run, self.context)[:, self.lines[1]])
        found[~(np.abs(found) < _FAR).all(axis=(1, 2))] = np.nan
        return at_numbers(run, found, self.numbers)

    @cached_property
    def gaps(self) -> dict[str, Floats | None]:
        """Distances (f, n) [mm] of vertices from the bones, by name of the run; NaN for exempt vertices, None if a bone has no
        inside.
        """
        found = {run.name: (run, local_fields.to_bones(run, self.context)) for run in self.runs}
        return {
            name: None if gaps is None else at_numbers(run, gaps, self.numbers) for name, (run, gaps) in found.items()
        }

    def touched(self, run: Run) -> NDArray[np.bool_] | None:
        """True (f, n) for each vertex that is not attached but within ``NEAR`` of a bone; None if distances are not known."""
        gaps = self.gaps[run.name]
        return None if gaps is None else np.less_equal(gaps, NEAR)  # False for NaN

    @cached_property
    def surfaces(self) -> dict[str, dict[str, Floats]]:
        """Values (f, n) [mm] of the signed distance and of the depth, by quantity and name of the run."""
        reference = self.runs[0]
        found: dict[str, dict[str, Floats]] = {"surface": {}, "depth": {}}
        for run in self.runs:
            if run is not reference:
                found["surface"][run.name] = at_numbers(run, local_fields.to_surface(run, reference), self.numbers)
            if (gaps := self.gaps[run.name]) is not None:
                found["depth"][run.name] = np.fmax(-gaps, 0)
        return {name: values for name, values in found.items() if values}

    def quantities(self) -> list[dict[str, Any]]:
        """The quantities that the reader can select, except the distance to the same vertex, which follows from positions."""
        return [
            {"name": name, "signed": name == "surface", "top": _top(list(values.values()))}
            for name, values in self.surfaces.items()
        ]

    def levels(self, run: Run) -> dict[str, bytes]:
        """The levels of a run as bytes, by quantity; an unknown value has the level 0."""
        found = {}
        for name, values in self.surfaces.items():
            if run.name in values:
                share = np.nan_to_num(values[run.name]) / (_top(list(values.values())) or 1.0)
                level = np.round(np.sign(share) * np.sqrt(np.minimum(np.abs(share), 1)) * _LEVELS).astype(np.int8)
                whole = level.view(np.uint8)
                found[name] = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1])).tobytes()
        return found

    def most(self, run: Run) -> dict[str, list[float]]:
        """The maximum magnitude [mm] in each frame of a run, by quantity."""
        own = {name: values[run.name] for name, values in self.surfaces.items() if run.name in values}
        return {name: [float(f"{_top([frame]):.4g}") for frame in values] for name, values in own.items()}

    def bars(self) -> dict[str, list[float | None]]:
        """The error bar of the maximum distance by quantity and frame; empty without error bars."""
        known = self.comparison.error_bars
        found: dict[str, list[float | None]] = {}
        if known is None:
            return found
        for name, statistic in _BARS.items():
            bar = known.find("deviation", "surface_deviation", statistic)
            if bar is not None:
                values = dict(zip(known.numbers, bar.values.tolist(), strict=True))
                found[name] = [finite(values.get(number, math.nan)) for number in self.numbers]
        return found

    def fibres(self, points: list[Floats]) -> dict[str, Any]:
        """The drawn fibres, and the range of stretches of their segments over all runs, without extremes. ``points``: the
        positions (f, m, 3) [mm] of fibre points in each run.
        """
        lines, ends = self.lines[0], self.lines[0].offsets
        # A segment connects a point of a line to the next point.
        inside = np.delete(np.arange(max(len(lines.points) - 1, 0)), ends[1:-1] - 1)

        def lengths(places: Floats) -> Floats:
            return np.asarray(np.linalg.norm(np.diff(places, axis=-2), axis=-1)[..., inside])

        rest = lengths(lines.points)
        stretches = np.concatenate([np.ones(1), *((lengths(own) / rest).ravel() for own in points)])
        known = stretches[np.isfinite(stretches)]
        # Percentiles prevent single segments from determining the scale.
        low, high = (float(np.percentile(known, share)) for share in (0.1, 99.9))
        scale = {"low": min(low, 1.0), "high": max(high, 1.0)}
        return {"lines": np.diff(ends).tolist(), "rest": np.round(rest, 5).tolist(), **scale}


def joints(bones: tuple[Bone, ...], numbers: tuple[int, ...]) -> list[dict[str, Any]]:
    """The rotation angle [degrees] or the translation [mm] of each bone that moves, by frame."""
    return [
        {
            "name": one.name,
            "unit": "°" if one.unit == "°" else f" {one.unit}",
            "values": [round(one.at(number), 2) for number in numbers],
        }
        for one in motions(bones)
    ]


def arrows(run: Run, setup: Setup, numbers: tuple[int, ...]) -> list[list[list[float]]]:
    """Point of application (3) [mm] and force (3) [N] on each bone, by frame. A force that is 0 or unknown has no arrow."""
    found = dict[int, list[list[float]]]()
    for i, number in enumerate(run.numbers):
        if number in numbers and (pull := forces.block(run, setup, i)) is not None:
            found[number] = np.round(np.hstack([pull.points, pull.of_points["force"]]), 4).tolist()
    return [found.get(number, []) for number in numbers]


@np.errstate(invalid="ignore")
def _top(values: list[Floats]) -> float:
    """The maximum finite magnitude; 0 without finite values."""
    return max((float(np.abs(one[np.isfinite(one)]).max(initial=0.0)) for one in values), default=0.0)
