"""Pictures of a comparison: the choice of frames and views, and the job for the program that draws the pictures."""

import logging
import math
import pickle
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.local_fields import to_same_vertex
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.foundations.subprocesses import command, environment, scratch_folder
from fem_reference.metrics import at_rest, find
from fem_reference.problems.setup import Bone, Setup
from fem_reference.report import pictures
from fem_reference.report.embedded import picture_source
from fem_reference.runs.store import Run

log = logging.getLogger(__name__)

PACKAGES = "libegl1 libegl-mesa0 libgl1-mesa-dri"
SECONDS = 600  # time limit of the drawing program
# Principal moments count as equal if their relative difference is below this value, which is far above round-off. The cameras
# then look along coordinate axes.
_TIES = 1e-11


@dataclass(frozen=True, eq=False)
class Shot:
    """A run at a frame ``number``: the ``points`` (n, 3) [mm] and, once they are drawn, two pictures (``sources``).

    For a candidate, ``distances`` (n,) [mm] are the distances of its vertices from the same vertices of the reference, and
    ``outline`` (n, 3) contains the points of the reference.
    """

    name: str
    number: int
    points: Floats
    distances: Floats | None = None
    outline: Floats | None = None
    sources: tuple[str, ...] = ()


def shots(comparison: Comparison) -> list[Shot]:
    """Shots of the reference at rest and at its maximum displacement, and of each candidate at its worst drawable frame."""
    reference = comparison.reference
    travel = to_same_vertex(reference, at_rest(reference)).max(axis=1)
    furthest = int(np.argmax(np.where(np.isfinite(travel), travel, -1.0)))
    numbers = sorted({0, furthest})
    chosen = [Shot(reference.name, reference.numbers[i], reference.positions[i]) for i in numbers]
    return chosen + [shot for run in comparison.candidates for shot in _worst(comparison, run)]


def of_comparison(comparison: Comparison) -> tuple[list[Shot], str]:
    """The shots of a comparison with their pictures, and an empty message; if software is missing, no shots and a message."""
    return figures(comparison.setup, comparison.reference.surface, shots(comparison))


def figures(setup: Setup, surface: Surface, wanted: list[Shot]) -> tuple[list[Shot], str]:
    """The shots ``wanted`` with their pictures, and an empty message; if software is missing, no shots and a message."""
    try:
        drawn = draw(setup, surface, wanted)
    except MissingSoftware as error:
        return [], str(error)
    pairs = zip(wanted, drawn, strict=True)
    return [replace(shot, sources=tuple(map(picture_source, pair))) for shot, pair in pairs], ""


def draw(setup: Setup, surface: Surface, wanted: list[Shot]) -> list[tuple[bytes, bytes]]:
    """Draw two WebP pictures of each shot. Raises MissingSoftware if the drawing program fails."""
    with scratch_folder() as folder:
        job = folder / "job.pickle"
        job.write_bytes(pickle.dumps(_job(setup, surface, wanted)))
        _run(program(job, folder))
        names = [[folder / f"{shot}_{view}.webp" for view in (0, 1)] for shot in range(len(wanted))]
        if not all(path.is_file() for pair in names for path in pair):
            raise _missing("it wrote no pictures")
        return [(first.read_bytes(), second.read_bytes()) for first, second in names]


def top(wanted: list[Shot]) -> float:
    """The end of the colour scale of all pictures [mm]: the maximum distance in any picture."""
    return max((float(shot.distances.max()) for shot in wanted if shot.distances is not None), default=0.0)


def ticks(top: float) -> list[tuple[float, float]]:
    """Ticks of a scale: round values from 0 to ``top``, and ``top`` itself, each preceded by its ratio to ``top``.

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
    import matplotlib as mpl
    from matplotlib.colors import to_hex

    return ", ".join(to_hex(colour) for colour in mpl.colormaps[pictures.COLOURS](np.linspace(0, 1, 17)))


def directions(surface: Surface, bones: tuple[Bone, ...]) -> Floats:
    """Unit vectors (2, 3) towards the cameras, along the shortest and the middle principal axis of the surface.

    The first view shows the largest silhouette, and the second is rotated by 90 degrees about the long axis. Both cameras are on
    the side away from the bones' vertices. An axis along which bones with analytic shapes hide the surface is used last.
    """
    middle = surface.points.mean(axis=0)
    spread = np.cov((surface.points - middle).T)
    _, axes = np.linalg.eigh(spread + _TIES * np.trace(spread) * np.diag([0, 1, 2]))
    others = np.vstack([bone.surface.points for bone in bones])
    radius = np.linalg.norm(surface.points - middle, axis=1).max()
    near = others[np.linalg.norm(others - middle, axis=1) < 1.5 * radius]
    away = middle - (near if len(near) else others).mean(axis=0)
    views = axes.T * np.where(axes.T @ away < 0, -1.0, 1.0)[:, None]
    hidden = [_hidden(surface.points, view * radius, bones) for view in views]
    return np.asarray(views[np.argsort(hidden, kind="stable")[:2]])


def _hidden(points: Floats, view: Floats, bones: tuple[Bone, ...]) -> bool:
    """True if bones with analytic shapes hide most of ``points`` (n, 3) from a viewer at a distance of four times ``view`` (3,)."""
    behind = np.zeros(len(points), bool)
    for solid in (bone.solid for bone in bones if bone.solid is not None):
        for step in np.arange(1, 17) / 4:
            behind |= solid.sample(points + step * view).distance < 0
    return bool(behind.mean() > 0.5)


def _worst(comparison: Comparison, run: Run) -> Iterator[Shot]:
    """The shot of a candidate at its worst frame; nothing if no frame is finite."""
    distances = to_same_vertex(run, comparison.reference)
    drawable = np.isfinite(distances).all(axis=1)
    if not drawable.any():
        return
    deviation = find(comparison.deviations[run.name], "surface_deviation", "rms")
    badness = distances.max(axis=1) if deviation is None else np.abs(deviation.values)
    i = int(np.argmax(np.where(drawable, badness, -1.0)))
    yield Shot(run.name, run.numbers[i], run.positions[i], distances[i], comparison.reference.positions[i])


def _job(setup: Setup, surface: Surface, wanted: list[Shot]) -> dict[str, Any]:
    """The job for the drawing program, as the module ``pictures`` describes it."""
    shots = [
        {"points": shot.points, "distances": shot.distances, "outline": shot.outline}
        | {"poses": [bone.pose(shot.number) for bone in setup.bones]}
        for shot in wanted
    ]
    return {
        "top": top(wanted),
        "triangles": surface.triangles,
        "directions": directions(setup.surface, setup.bones),
        "bones": [(bone.surface.points, bone.surface.triangles) for bone in setup.bones],
        "shots": shots,
    }


def program(job: Path, folder: Path) -> list[str]:
    """The command line of the program that draws ``job`` into ``folder``."""
    return command(pictures.__file__, str(job), str(folder))


def _run(words: list[str]) -> None:
    settings = environment()
    if sys.platform == "linux":
        settings.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    try:
        done = subprocess.run(
            words, env=settings, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise _missing(str(error)) from error
    if done.returncode:
        log.info("the drawing program wrote: %s", done.stderr)
        raise _missing(f"it ended with code {done.returncode}")


def _missing(what: str) -> MissingSoftware:
    return MissingSoftware(
        f"No pictures: the drawing program failed ({what}). It needs an OpenGL library; "
        f"on Debian or Ubuntu: apt-get install {PACKAGES}"
    )
