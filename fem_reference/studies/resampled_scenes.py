"""A scene whose muscle has a surface of fewer or more triangles, for solvers whose cost and accuracy are those of the surface."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.coarsening import resampled
from fem_reference.geometry.distance import distances
from fem_reference.geometry.extension import Extension
from fem_reference.io import files
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import Attachment, MuscleCase, VertexList


def resample(case: MuscleCase, setup: Setup, power: int, folder: Path) -> MuscleCase:
    """The case on a surface of ``4**power`` times as many triangles; its files go into ``folder``, named by what they contain.

    A vertex is attached where the nearest of the original surface is.
    """
    surface = resampled(setup.surface, power)
    named = hashlib.sha256(surface.points.tobytes() + surface.triangles.tobytes()).hexdigest()[:16]
    place = (folder / named).absolute()
    place.mkdir(parents=True, exist_ok=True)
    files.write_surface(place / "surface.vtp", surface, surface.points)
    nearest = nearest_vertices(setup.surface, surface.points)
    attached = {entry.attachment: np.flatnonzero(np.isin(nearest, entry.vertices)) for entry in setup.attached}
    for name, vertices in attached.items():
        files.write_text(place / f"{name}.csv", "".join(f"{vertex}\n" for vertex in vertices))
    muscle = case.muscle.model_copy(update={"surface": str(place / "surface.vtp"), "unit": 1.0})
    attachments = tuple(_listed(entry, place) for entry in case.attachment)
    # No file names these surfaces, so that they may be where they are.
    return case.model_copy(update={"muscle": muscle, "attachment": attachments, "from_file": False})


def _listed(entry: Attachment, place: Path) -> Attachment:
    listed = VertexList(file=str(place / f"{entry.name}.csv"))
    return entry.model_copy(update={"vertices": listed, "within": None, "outline": None})


def nearest_vertices(surface: Surface, points: Floats) -> Floats:
    """The nearest vertex of the nearest triangle to each of ``points`` (n, 3), (n,)."""
    found = distances(points, surface)
    corners = surface.triangles[found.triangle]
    return np.asarray(np.take_along_axis(corners, found.barycentric.argmax(axis=1)[:, None], axis=1)[:, 0])


def carried(run: Run, surface: Surface) -> Run:
    """A ``run`` on another surface, carried to ``surface``, whose vertices follow by the extension that fibres follow by."""
    if len(run.surface.points) == len(surface.points) and np.allclose(run.surface.points, surface.points):
        return run
    extension = Extension.to(surface.points, run.surface)
    positions = np.stack([extension.apply(moved) for moved in run.positions])
    return replace(run, surface=surface, positions=positions)
