"""The runs in three dimensions, and in pictures at their worst frames."""

import base64
import math
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.report import gallery, pictures
from fem_reference.report.sections import Section


@dataclass(frozen=True)
class Figure:
    """Two pictures of a run at a frame, ``top`` the greatest distance [mm] on its colour bar or None."""

    name: str
    number: int
    sources: tuple[str, str]
    top: float | None


def _facts(comparison: Comparison) -> dict[str, Any]:
    """The pictures, or what is missing."""
    figures, missing = _figures(comparison)
    return {"figures": figures, "missing": missing, "ticks": ticks}


def ticks(top: float) -> list[tuple[float, float]]:
    """Round values from 0 to ``top`` with their share of it, and ``top`` itself.

    >>> ticks(4.6)
    [(0.0, 0.0), (0.217, 1.0), (0.435, 2.0), (0.652, 3.0), (1.0, 4.6)]
    """
    if not top > 0:
        return [(0.0, 0.0)]
    power = 10.0 ** math.floor(math.log10(top / 2))
    step = next(power * factor for factor in (1, 2, 5, 10) if top / (power * factor) <= 6)
    values = [k * step for k in range(int(top / step) + 1) if k * step < 0.86 * top]
    return [(round(value / top, 3), value) for value in values] + [(1.0, top)]


def ramp() -> str:
    """The colour map of the pictures as the stops of a CSS gradient."""
    return ", ".join(to_hex(colour) for colour in mpl.colormaps[pictures.COLOURS](np.linspace(0, 1, 17)))


def _figures(comparison: Comparison) -> tuple[list[Figure], str]:
    """The pictures, or none and what is missing."""
    wanted = gallery.shots(comparison)
    try:
        drawn = gallery.draw(comparison.setup, comparison.reference.surface, wanted)
    except MissingSoftware as error:
        return [], str(error)
    figures = []
    for shot, (first, second) in zip(wanted, drawn, strict=True):
        top = None if shot.distances is None else gallery.top(wanted)
        figures.append(Figure(shot.name, shot.number, (picture_source(first), picture_source(second)), top))
    return figures, ""


def picture_source(picture: bytes) -> str:
    """A picture as what stands in ``src``."""
    return f"data:image/webp;base64,{base64.b64encode(picture).decode()}"


SECTION = Section(40, _facts)
