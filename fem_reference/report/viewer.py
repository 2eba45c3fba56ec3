"""The 3D view of a comparison: every frame of every run, packed into the page with the library that draws it in a browser.

``viewer.js`` unpacks a JSON object. Arrays in this object are little-endian, compressed (gzip) and encoded in base64:

    library    text of each file of three.js
    frames     numbers (f,) of the frames drawn;  colours, both, warm  stops of the colour bars: for magnitudes, for signed values
               and for fibres
    low, step  position = low + step * integer from 0 to 65535 [mm]
    triangles  integers (m, 3), of 4 bytes, the same for every run
    runs       name, worst (maximum distance to the reference [mm] and index of its frame), reached (f,), off (f,): number of
               vertices outside the box, and positions: integers (f, n, 3) of 2 bytes as differences from the previous
               frame, in zigzag encoding (0, -1, 1, -2, ... as 0, 1, 2, 3, ...), all low bytes before all high bytes
    bones      name, triangles, positions (1, n, 3) in the same form with its own low and step, poses (f, 16) by rows
    force      the maximum drawn force [N];  attached  indices of the vertices attached to bones
    and, as described in ``viewer_fields``: forces, quantities, levels and fibre points of the runs, bars, fibres, joints
    camera     middle (3,), half height of the picture [mm], directions (2, 3) towards the camera
"""

import base64
import gzip
import json
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.setup import Bone
from fem_reference.report import gallery, pictures
from fem_reference.report.viewer_fields import NEAR, Fields, arrows, joints
from fem_reference.runs.store import Run, at_numbers

THREE = Path(__file__).parent / "three"
# The maximum number of bytes of all positions and levels before compression. Compression and base64 together hardly change it.
BUDGET = 10_400_000
BONE_TRIANGLES = 8000
_LEVELS = 65535


@dataclass(frozen=True, eq=False)
class _Box:
    """A box in which coordinates are rounded, from ``low`` (3,) [mm] in steps of ``step`` [mm]."""

    low: Floats
    step: float

    @classmethod
    def around(cls, low: Floats, high: Floats) -> "_Box":
        return cls(low, max(float((high - low).max()) / _LEVELS, 1e-9))

    def whole(self, points: Floats) -> NDArray[np.uint16]:
        """The nearest integers of ``points``: 0 for NaN, and the edge of the box for points outside the box."""
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.clip(np.round((points - self.low) / self.step), 0, _LEVELS)
        return np.nan_to_num(steps, nan=0.0).astype(np.uint16)

    def facts(self) -> dict[str, Any]:
        return {"low": self.low.tolist(), "step": self.step}


def view(comparison: Comparison, budget: int = BUDGET) -> dict[str, Any]:
    """The contents of the template of the 3D view.

    ``data``: the data for the script. ``candidates``, ``quantities``: their names. ``numbers``: frame numbers. ``every``: the
    stride of drawn frames, above 1 if positions would exceed ``budget`` bytes. ``error``: the maximum error of a coordinate [mm].
    ``warm``: the colours of fibres; ``stretches``: the labels of their scale. ``force``: the maximum drawn force [N], 0 without
    forces. ``attached``, ``touched``: True if there are vertices that are attached to a bone or touch a bone; ``near``: the
    distance [mm] within which a vertex touches. ``version``, ``licence``: those of the library.
    """
    shown = [comparison.reference, *(run for run in comparison.candidates if run.has_surface)]
    every = _every(shown, budget)
    data, card = _data(comparison, shown, every), tomllib.loads((THREE / "card.toml").read_text(encoding="utf-8"))
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return {
        "data": text.replace("<", "\\u003c"),  # so that no name in it can end the script
        "candidates": [run.name for run in shown[1:]],
        "quantities": [one["name"] for one in data["quantities"]],
        "numbers": data["frames"],
        "every": every,
        "error": data["step"] / 2,
        "warm": data["warm"],
        "stretches": _ends(data["fibres"]),
        "force": data["force"],
        "attached": bool(data["attached"]),
        "touched": any("touched" in run for run in data["runs"]),
        "near": NEAR,
        "version": card["version"],
        "licence": (THREE / "LICENSE").read_text(encoding="utf-8"),
    }


def _data(comparison: Comparison, shown: list[Run], every: int) -> dict[str, Any]:
    """The object that the docstring of the module describes, for the runs ``shown``, of which the first is the reference."""
    reference, numbers = comparison.reference, comparison.reference.numbers[::every]
    frames = {run.name: _frames(run, numbers) for run in shown}
    # Not empty, even if no frame was reached.
    own = np.concatenate([reference.surface.points[None], frames[reference.name]])
    box = _box(own, list(frames.values()))
    fields = Fields(comparison, shown, numbers)
    runs, top = _runs(frames, reference.name, box)
    points = [fields.points(run) for run in shown]
    for run, row, own_points in zip(shown, runs, points, strict=True):
        row["levels"] = {name: _packed(levels) for name, levels in fields.levels(run).items()}
        row["most"] = fields.most(run)
        if (touched := fields.touched(run)) is not None and touched.any():
            row["touched"] = _packed(touched.astype(np.uint8).tobytes())
        row["forces"] = arrows(run, comparison.setup, numbers)
        row["points"] = _positions(_last_finite(own_points), box)
    distance = [{"name": "distance", "signed": False, "top": top}] if len(shown) > 1 else []
    return {
        "library": _library(),
        "frames": numbers,
        "colours": _stops(pictures.COLOURS),
        "both": _stops("coolwarm"),
        "warm": _stops("plasma"),
        "quantities": distance + fields.quantities(),
        "force": max(
            (float(np.linalg.norm(one[3:])) for row in runs for there in row["forces"] for one in there), default=0.0
        ),
        "attached": np.unique(comparison.setup.attached_vertices).tolist(),
        "bars": fields.bars(),
        "fibres": fields.fibres(points),
        "joints": joints(comparison.setup.bones, numbers),
        "triangles": _packed(reference.surface.triangles.astype("<u4").tobytes()),
        "bones": [_bone(bone, numbers) for bone in comparison.setup.bones],
        "camera": _camera(comparison, own),
        **box.facts(),
        "runs": runs,
    }


def _ends(fibres: dict[str, Any]) -> tuple[tuple[float, float], ...]:
    """The positions [%] and values of labels on the scale of stretches: at both ends, and at rest unless this is near an end."""
    low, high = fibres["low"], fibres["high"]
    rest = 100 * (1 - low) / ((high - low) or 1.0)
    middle = ((rest, 1.0),) if 12 < rest < 88 else ()
    return ((0.0, low), *middle, (100.0, high))


def _every(shown: list[Run], budget: int) -> int:
    """The stride of frames that keeps the positions of all runs within ``budget`` bytes, with at least two frames."""
    count, vertices = len(shown[0].numbers), len(shown[0].surface.points)
    frame = len(shown) * vertices * (3 * 2 + 2)  # a vertex: three coordinates of two bytes, two quantities of one byte
    strides = range(1, max(count, 2))
    return next((every for every in strides if -(-count // every) * frame <= budget), strides[-1])


def _frames(run: Run, numbers: tuple[int, ...]) -> Floats:
    """Positions (f, n, 3) of a run at frame ``numbers``; NaN throughout a frame in which any position is not finite."""
    known = np.isfinite(run.positions).all(axis=(1, 2), keepdims=True)
    return at_numbers(run, np.where(known, run.positions, np.nan), numbers)


def _box(reference: Floats, runs: list[Floats]) -> _Box:
    """The box around all frames. As vertices of a run may scatter, the box extends beyond that of the reference by at most the
    diagonal of the latter on each side.
    """
    low, high = _bounds(reference)
    reach = float(np.linalg.norm(high - low))
    lows, highs = zip(*(_bounds(frames) for frames in [reference, *runs] if np.isfinite(frames).any()), strict=True)
    return _Box.around(np.maximum(np.min(lows, axis=0), low - reach), np.minimum(np.max(highs, axis=0), high + reach))


def _bounds(frames: Floats) -> tuple[Floats, Floats]:
    return np.nanmin(frames, axis=(0, 1)), np.nanmax(frames, axis=(0, 1))


def _stops(name: str) -> list[str]:
    return [to_hex(colour) for colour in mpl.colormaps[name](np.linspace(0, 1, 33))]


def _runs(frames: dict[str, Floats], reference: str, box: _Box) -> tuple[list[dict[str, Any]], float]:
    """The facts of every run, and the end of the colour scale: the maximum distance to the reference over frames inside the box."""
    rows, top = [], 0.0
    for name, positions in frames.items():
        inside = ((positions >= box.low - box.step) & (positions <= box.low + (_LEVELS + 1) * box.step)).all(axis=2)
        reached = np.isfinite(positions).all(axis=(1, 2))
        with np.errstate(over="ignore"):
            distances = np.linalg.norm(positions - frames[reference], axis=2)
        known = np.where(np.isfinite(distances) & inside, distances, 0.0).max(axis=1)
        rows.append(
            {
                "name": name,
                "worst": [float(known.max()), int(known.argmax())],
                "reached": reached.tolist(),
                "off": np.where(reached, (~inside).sum(axis=1), 0).tolist(),
                "positions": _positions(_last_finite(positions), box),
            }
        )
        top = max(top, float(known[inside.all(axis=1)].max(initial=0.0)))
    return rows, top


def _last_finite(frames: Floats) -> Floats:
    """The ``frames``, in which a frame that was not reached is replaced by the last reached frame before it to save bytes."""
    reached = np.isfinite(frames).all(axis=(1, 2))
    last = np.maximum.accumulate(np.where(reached, np.arange(len(frames)), 0))
    return np.asarray(frames[last])


def _positions(frames: Floats, box: _Box) -> str:
    """Positions (f, n, 3) in the form that the docstring of the module describes."""
    whole = box.whole(frames)
    steps = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1])).view(np.int16)
    zigzag = ((steps << 1) ^ (steps >> 15)).view(np.uint16)
    return _packed((zigzag & 255).astype(np.uint8).tobytes() + (zigzag >> 8).astype(np.uint8).tobytes())


def _bone(bone: Bone, numbers: tuple[int, ...]) -> dict[str, Any]:
    points, triangles = pictures.thinned(bone.surface.points, bone.surface.triangles, BONE_TRIANGLES)
    box = _Box.around(points.min(axis=0), points.max(axis=0))
    return {
        "name": bone.name,
        "triangles": _packed(triangles.astype("<u4").tobytes()),
        "positions": _positions(points[None], box),
        "poses": [bone.pose(number).ravel().tolist() for number in numbers],
        **box.facts(),
    }


def _camera(comparison: Comparison, frames: Floats) -> dict[str, Any]:
    """The camera of the pictures, with a field of view that contains the reference in all ``frames`` (f, n, 3)."""
    low, high = _bounds(frames)
    middle = (low + high) / 2
    return {
        "middle": middle.tolist(),
        "half": 1.06 * float(np.nanmax(np.linalg.norm(frames - middle, axis=2))),
        "directions": gallery.directions(comparison.setup.surface, comparison.setup.bones).tolist(),
    }


@cache
def _library() -> dict[str, str]:
    return {path.name: _packed(path.read_bytes()) for path in sorted(THREE.glob("*.js"))}


def _packed(values: bytes) -> str:
    return base64.b64encode(gzip.compress(values, 9, mtime=0)).decode()
