"""Sizes of differences between two runs: what one frame or one statistic of them says by chance counts as it does on average."""

import math
from collections.abc import Iterable

import numpy as np

from fem_reference.foundations.mesh import Floats, enclosed_volume
from fem_reference.runs.store import Run

# What names of statistics begin with that are the value of one place, and the average over places beside each.
_OF_ONE_PLACE = {"p95": "rms", "max": "rms", "hausdorff": "distance_rms"}
_MOVED = 0.01  # of what a surface moves at most: where it has moved by less, shares of that say nothing


def ratio(differences: Floats, scale: Floats) -> float:
    """The root mean square of ``differences`` (f,) over that of ``scale`` (f,), of the frames where both are known; NaN where the
    scale is 0.
    """
    known = np.isfinite(differences) & np.isfinite(scale)
    squares = float(scale[known] @ scale[known])
    return math.sqrt(float(differences[known] @ differences[known]) / squares) if squares > 0 else math.nan


def typical(differences: Floats, apart: Floats, moved: Floats | None = None) -> Floats:
    """The size (f,) of signed ``differences`` (f,) of a statistic between two runs whose surfaces are ``apart`` (f,) [mm]: at least
    what it is for surfaces so far apart on average over the frames. A difference that crosses zero says nothing about the error
    there; where the surfaces are the same it is 0.

    Of surfaces that have ``moved`` (f,) [mm], where that is given, it counts as at least the share of it that it is in the median
    frame: two meshes that agree better in some poses than in others do so by chance.
    """
    size = apart if moved is None else np.maximum(apart, _median_share(apart, moved) * moved)
    return np.maximum(np.abs(differences), np.nan_to_num(ratio(differences, apart)) * size)


def _median_share(apart: Floats, moved: Floats) -> float:
    """The distance ``apart`` (f,) of surfaces over that they have ``moved`` (f,), in the median frame where they have; 0 without
    any.
    """
    known = np.isfinite(apart) & (moved > _MOVED * np.nanmax(moved, initial=0.0))
    return float(np.median(apart[known] / moved[known])) if known.any() else 0.0


def typical_changes(changes: list[Floats], deviations: list[Floats], names: list[tuple[str, str]]) -> list[Floats]:
    """The sizes (f,) of signed differences of ``changes`` (f,) from rest between two runs, by metric and statistic (``names``): at
    least the share of the ``deviations`` (f,) of these runs from each other that they are on average, over the frames and the
    statistics of their metric.

    By the triangle inequality a change of the same places differs by no more than their deviation, and by less as most of that is
    not along the displacement or cancels. How much less, one statistic alone does not show: its difference may be small by chance,
    that of the worst place above all. A quantile or a greatest value is that of one place, wherever it is: nothing cancels there,
    and no quantile of the deviation bounds it, so that it is known no better than any one place is, in the root mean square.
    """
    metrics = [metric for metric, _ in names]
    shares = [ratio(found, deviation) for found, deviation in zip(changes, deviations, strict=True)]
    means = {name: _rms_of_known(zip(metrics, shares, strict=True), name) for name in set(metrics)}
    by_name, sizes = dict(zip(names, deviations, strict=True)), []
    for (metric, statistic), found, deviation in zip(names, changes, deviations, strict=True):
        size = np.maximum(np.abs(found), means[metric] * deviation)
        kind = statistic.partition("_")[0]
        average = statistic.replace(kind, _OF_ONE_PLACE.get(kind, kind))
        sizes.append(np.maximum(size, by_name.get((metric, average), size)) if kind in _OF_ONE_PLACE else size)
    return sizes


def _rms_of_known(shares: Iterable[tuple[str, float]], wanted: str) -> float:
    """The root mean square of the shares of the metric ``wanted`` that are known, 0 without any."""
    known = [share for metric, share in shares if metric == wanted and math.isfinite(share)]
    return math.sqrt(sum(share**2 for share in known) / len(known)) if known else 0.0


def carried(run: Run, moved: Floats) -> dict[str, Floats]:
    """Errors (f,), by statistic of the volume, of that of a ``run``'s surface, which its tetrahedra carry and which lies partly
    outside them: by what its volume and that of the tetrahedra themselves change otherwise. Of a run without tetrahedra nothing.

    It may cross zero: it counts as at least the share of what the surface has ``moved`` (f,) [mm] that it is on average.
    """
    inside = run.scalars.get("volume_ratio")
    if inside is None:
        return {}
    rest, triangles = enclosed_volume(run.surface.points, run.surface.triangles), run.surface.triangles
    outside = np.array([enclosed_volume(positions, triangles) for positions in run.positions]) / rest
    size = typical(outside - inside, moved)
    return {"deviation": 100 * size, "deviation_volume": rest * size}
