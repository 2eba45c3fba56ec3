"""Sizes of differences between two runs; for a difference that is small by chance, averages over frames or statistics are used."""

import math

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, enclosed_volume
from fem_reference.runs.store import Run

# Prefixes of statistics that are the value at a single point, each with the prefix of the corresponding average over points.
_OF_ONE_PLACE = {"p95": "rms", "max": "rms", "hausdorff": "distance_rms"}
_LEAST = 0.5  # the changes of an average are taken to differ by at least this fraction of the deviation; less is due to chance
_MOVED = 0.01  # if a surface has moved by less than this fraction of its maximum motion, ratios to the motion have no meaning


def greatest(values: Floats) -> float:
    """The maximum of the finite ``values`` (f,), NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.max()) if len(finite) else math.nan


def ratio(differences: Floats, scale: Floats) -> float:
    """The rms of ``differences`` (f,) divided by the rms of ``scale`` (f,), over frames with both values; NaN for a scale of 0."""
    known = np.isfinite(differences) & np.isfinite(scale)
    squares = float(scale[known] @ scale[known])
    return math.sqrt(float(differences[known] @ differences[known]) / squares) if squares > 0 else math.nan


def typical(differences: Floats, apart: Floats, moved: Floats | None = None) -> Floats:
    """The typical size (f,) of the signed ``differences`` (f,) of a statistic between two runs.

    ``apart`` (f,) [mm]: the distance between the surfaces of the runs. The size is at least this distance times the average ratio
    of difference to distance over the frames: a difference that crosses zero in a frame does not prove a small error there.
    If the surfaces are equal, the size is the magnitude of the difference.

    ``moved`` (f,) [mm]: the motion of the surfaces. If it is given, the distance is taken to be at least the motion times the
    median ratio of distance to motion, because two meshes agree better by chance in some poses.
    """
    size = apart
    if moved is not None:
        known = np.isfinite(apart) & (moved > _MOVED * np.nanmax(moved, initial=0.0))
        size = np.maximum(apart, float(np.median(apart[known] / moved[known])) * moved) if known.any() else size
    return np.maximum(np.abs(differences), np.nan_to_num(ratio(differences, apart)) * size)


def together(parts: dict[str, Floats], there: NDArray[np.bool_]) -> tuple[Floats, dict[str, float]]:
    """The error bar (f,) of independent sources of error (the root sum of squares of their ``parts`` (f,)); and the maximum of each
    part over the frames in which ``there`` (f,) is True, or over all frames if it is never True.
    """
    greatest = {name: float((part[there] if there.any() else part).max()) for name, part in parts.items()}
    return np.sqrt(np.sum([part**2 for part in parts.values()], axis=0)), greatest


def typical_changes(changes: list[Floats], deviations: list[Floats], names: list[tuple[str, str]]) -> list[Floats]:
    """The typical sizes (f,) of differences between two runs in their changes from rest, for each metric and statistic in
    ``names``.

    ``changes`` (f,): the signed differences. ``deviations`` (f,): the deviations of the runs from each other. A size is at least
    the deviation times the average ratio of difference to deviation, over the frames and over the statistics of the metric. For
    averages over points it is at least half the deviation.

    By the triangle inequality, the changes of a point in two runs differ by at most its deviation. They differ by less, because
    most of the deviation is not along the displacement, or cancels. A single statistic does not show by how much less: its
    difference may be small by chance, especially at the worst point. A quantile or a maximum belongs to a single point, whichever
    that is: nothing cancels there, and no quantile of the deviation bounds the difference. So this difference is taken to be at
    least the rms distance over the points.
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
    """Errors (f,) of the volume enclosed by the surface of a ``run``, by statistic; empty for a run without tetrahedra.

    The surface is embedded in tetrahedra and lies partly outside them, so the error is the difference between the relative changes
    of the enclosed volume and of the volume of the tetrahedra. This difference may cross zero, so the error is at least the motion
    ``moved`` (f,) [mm] of the surface times the average ratio of error to motion.
    """
    inside = run.scalars.get("volume_ratio")
    if inside is None:
        return {}
    rest, triangles = enclosed_volume(run.surface.points, run.surface.triangles), run.surface.triangles
    outside = np.array([enclosed_volume(positions, triangles) for positions in run.positions]) / rest
    size = typical(outside - inside, moved)
    return {"deviation": 100 * size, "deviation_volume": rest * size}
