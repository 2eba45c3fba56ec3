"""Frames in words: a frame number of the case with the time and the motions of the bones, if these are known."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_reference.problems.setup import Bone
from fem_reference.report.words import number
from fem_reference.scenes.case import Case


@dataclass(frozen=True)
class Column:
    """A quantity that depends on the frame: its ``name``, its ``unit``, and the function ``at`` from frame numbers to values."""

    name: str
    unit: str
    at: Callable[[int], float]


def columns(case: Case, setup: Any) -> list[Column]:
    """The time [s], if the case has an interval, and the motions of the bones of the set-up."""
    interval = getattr(getattr(case, "frames", None), "interval", None)
    found = [] if interval is None else [Column("time", "s", lambda frame: frame * float(interval))]
    return found + motions(getattr(setup, "bones", ()))


def motions(bones: Iterable[Bone]) -> list[Column]:
    """The rotation angle [°] or the translation [mm] of each moving bone."""
    found = list[Column]()
    for bone in bones:
        motion = bone.motion
        if motion is not None and motion.centre is not None:
            found.append(Column(bone.name, "°", _at(motion.frames, [math.degrees(angle) for angle in motion.amounts])))
        elif motion is not None:
            found.append(Column(bone.name, "mm", _at(motion.frames, list(motion.amounts))))
    return found


def label(case: Case, setup: Any, frame: int) -> str:
    """A frame in words: its number, and in brackets its time and the motions of the bones."""
    known = [
        f"{one.name} {number(one.at(frame))}{'' if one.unit == '°' else ' '}{one.unit}" for one in columns(case, setup)
    ]
    return f"frame {frame}" + (f" ({', '.join(known)})" if known else "")


def _at(frames: tuple[float, ...], values: list[float]) -> Callable[[int], float]:
    return lambda frame: float(np.interp(frame, frames, values))
