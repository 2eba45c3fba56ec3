"""Sizes of differences between two runs; if a difference is small by chance, its average over frames or statistics counts."""

import math

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, enclosed_volume
from fem_reference.runs.store import Run

# Prefixes of statistics that are the value at one point, each with the prefix of the average over points.
_OF_ONE_PLACE = {"p95": "rms", "max": "rms", "hausdorff": "distance_rms"}
_LEAST = 0.5  # averages of changes differ by at least this fraction of the runs' distance: a smaller difference is due to chance
_MOVED = 0.01  # below this fraction of a surface's maximum motion, ratios to the motion have no meaning


def greatest(values: Floats) -> float:
    """The maximum of the finite ``values`` (f,), NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else math.nan


def ratio(differences: Floats, scale: Floats) -> float:
    """The ratio of the root mean squares of ``differences`` (f,) and ``scale`` (f,), in frames with both; NaN if the scale is 0."""
    known = np.isfinite(differences) & np.isfinite(scale)
    squares = float(scale[known] @ scale[known])
    return math.sqrt(float(differences[known] @ differences[known]) / squares) if squares > 0 else math.nan


def typical(differences: Floats, apart: Floats, moved: Floats | None = None) -> Floats:
    """The size (f,) of signed ``differences`` (f,) of a statistic between two runs whose surfaces are ``apart`` (f,) [mm]: at least
    the distance times the average ratio of difference to distance over the frames. A difference that crosses zero does not
    show that the error is small in that frame. If the surfaces are equal, the size is that of the difference.

    If the motion ``moved`` (f,) [mm] of the surfaces is given, the distance is taken to be at least the motion times the median
    ratio of distance to motion: in some poses two meshes agree better by chance.
    """
    size = apart
    if moved is not None:
        known = np.isfinite(apart) & (moved > _MOVED * np.nanmax(moved, initial=0.0))
        size = np.maximum(apart, float(np.median(apart[known] / moved[known])) * moved) if known.any() else size
    return np.maximum(np.abs(differences), np.nan_to_num(ratio(differences, apart)) * size)


def together(parts: dict[str, Floats], there: NDArray[np.bool_]) -> tuple[Floats, dict[str, float]]:
    """The bar (f,) of independent sources, the root sum of squares of their ``parts`` (f,), and the maximum of each part over
    the frames ``there`` (f,), or over all frames if there are none.
    """
    greatest = {name: float((part[there] if there.any() else part).max()) for name, part in parts.items()}
    return np.sqrt(np.sum([part**2 for part in parts.values()], axis=0)), greatest


def typical_changes(changes: list[Floats], deviations: list[Floats], names: list[tuple[str, str]]) -> list[Floats]:
    """The sizes (f,) of signed differences of ``changes`` (f,) from rest between two runs, by metric and statistic (``names``): at
    least the ``deviations`` (f,) of the runs from each other times the average ratio of difference to deviation, over the frames
    and the statistics of the metric, and at least half the deviation for averages over points.

    By the triangle inequality, changes of the same points differ by at most their deviation. They differ by less, as most of the
    deviation is not along the displacement, or cancels. A single statistic does not show by how much less: its difference may be
    small by chance, especially at the worst point. A quantile or a maximum belongs to one point, whichever it is: nothing
    cancels there, and no quantile of the deviation bounds it. So its difference is at least the rms distance over points.
    """
    metrics = [metric for metric, _ in names]
    shares = [ratio(found, deviation) for found, deviation in zip(changes, deviations, strict=True)]
    means = dict[str, float]()
    for name in set(metrics):
        known = [
            share for metric, share in zip(metrics, shares, strict=True) if metric == name and math.isfinite(share)
        ]
        means[name] = math.sqrt(sum(share**2 for share in known) / len(known)) if known else 0.0
    by_name, sizes = dict(zip(names, deviations, strict=True)), []
    for (metric, statistic), found, deviation in zip(names, changes, deviations, strict=True):
        kind = statistic.partition("_")[0]
        share = means[metric] if kind in _OF_ONE_PLACE else max(means[metric], _LEAST)
        size = np.maximum(np.abs(found), share * deviation)
        average = statistic.replace(kind, _OF_ONE_PLACE.get(kind, kind))
        sizes.append(np.maximum(size, by_name.get((metric, average), size)) if kind in _OF_ONE_PLACE else size)
    return sizes


def carried(run: Run, moved: Floats) -> dict[str, Floats]:
    """Errors (f,) of the volume that the surface of a ``run`` encloses, by statistic. The surface is embedded in tetrahedra, and
    lies partly outside them: the error is the difference of the changes of both volumes. Empty for a run without tetrahedra.

    The error may cross zero: it is at least its average ratio to the surface's motion ``moved`` (f,) [mm] times this motion.
    """
    inside = run.scalars.get("volume_ratio")
    if inside is None:
        return {}
    rest, triangles = enclosed_volume(run.surface.points, run.surface.triangles), run.surface.triangles
    outside = np.array([enclosed_volume(positions, triangles) for positions in run.positions]) / rest
    size = typical(outside - inside, moved)
    return {"deviation": 100 * size, "deviation_volume": rest * size}
