"""The contents of the 3D view, unpacked as the texts of ``viewer`` and ``viewer_fields`` say."""

import base64
import gzip
from dataclasses import replace

import numpy as np

from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.problems.setup import AttachedVertices
from tests.report.comparisons import NAN, NUMBERS


def unpacked(text: str, kind: str) -> np.ndarray:
    return np.frombuffer(gzip.decompress(base64.b64decode(text)), kind).astype(np.int64)


def positions(printed: dict, box: dict, frames: int) -> np.ndarray:
    """The positions (frames, n, 3) [mm] of a run, unpacked as the module's text says."""
    low, high = unpacked(printed["positions"], "u1").reshape(2, -1)
    zigzag = low + 256 * high
    steps = np.where(zigzag % 2, -(zigzag + 1) // 2, zigzag // 2).reshape(frames, -1, 3)
    return box["low"] + box["step"] * (np.cumsum(steps, axis=0) % 65536)


def top(data: dict) -> float:
    """The greatest distance [mm] to the same vertex."""
    return next(one["top"] for one in data["quantities"] if one["name"] == "distance")


def levels(data: dict, run: int, name: str, frames: int) -> np.ndarray:
    """The values (frames, n) [mm] of a quantity, unpacked as ``viewer_fields`` says."""
    (scale,) = (one["top"] for one in data["quantities"] if one["name"] == name)
    steps = unpacked(data["runs"][run]["levels"][name], "u1").reshape(frames, -1)
    level = np.cumsum(steps, axis=0).astype(np.uint8).view(np.int8) / 127.0
    return np.sign(level) * scale * level**2


def with_bars(comparison, bar: float):
    values = np.array([0.0, bar, bar, bar, NAN])
    known = [
        ErrorBar("deviation", "surface_deviation", statistic, "mm", share * values, {})
        for statistic, share in (("max", 1.0), ("hausdorff", 0.5))
    ]
    return replace(comparison, error_bars=ErrorBars(NUMBERS, (1.0, 2.0), 1.0, tuple(known)))


def acted_on(comparison):
    """The comparison with three vertices attached to its bone, which the body may touch."""
    setup = comparison.setup
    attached = AttachedVertices("foot", setup.bones[0], np.array([5, 3, 8]))
    context = replace(comparison.context, bones=setup.bones)
    return replace(comparison, setup=replace(setup, attached=(attached,)), context=context)
