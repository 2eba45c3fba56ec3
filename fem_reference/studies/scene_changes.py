"""Cases with one thing changed: tetrahedra, contact, distances to bones, load steps, or the triangles of the surface."""

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference.effects.contact import among
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.coarsening import resampled
from fem_reference.geometry.distance import distances
from fem_reference.geometry.extension import Extension
from fem_reference.io import files
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase, VertexList


def on_tetrahedra(case: MuscleCase, **changes: float) -> MuscleCase:
    """The case with other keys of its muscle: ``tet_size`` [mm], ``refinements``."""
    return case.model_copy(update={"muscle": case.muscle.model_copy(update=changes)})


def with_contact(case: MuscleCase, **changes: float) -> MuscleCase:
    """The case with other parameters of its contact."""
    contact = among(case.effects)
    effects = (one.model_copy(update=changes) if one is contact else one for one in case.effects)
    return case.model_copy(update={"effect": tuple(effects)})


def with_distances(case: MuscleCase, factor: float, *keys: str) -> MuscleCase:
    """The case with ``keys`` of the distances to the surfaces of bones times ``factor``; closed forms are exact."""
    bones = (
        bone.model_copy(update={key: factor * getattr(bone, key) for key in keys}) if bone.surface else bone
        for bone in case.bone
    )
    return case.model_copy(update={"bone": tuple(bones)})


def without_states(choice: SolverChoice) -> SolverChoice:
    """The ``choice`` of a run that is only measured, one of many: the reference keeps no states of it."""
    return choice.model_copy(update={"store_state": False}) if choice.solver == "fenicsx" else choice


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
    attachments = []
    for entry, attached in zip(case.attachment, setup.attached, strict=True):
        path = place / f"{entry.name}.csv"
        vertices = np.flatnonzero(np.isin(nearest, attached.vertices))
        files.write_text(path, "".join(f"{vertex}\n" for vertex in vertices))
        listed = {"vertices": VertexList(file=str(path)), "within": None, "outline": None}
        attachments.append(entry.model_copy(update=listed))
    muscle = case.muscle.model_copy(update={"surface": str(place / "surface.vtp"), "unit": 1.0})
    # No file names these surfaces, so that they may be where they are.
    return case.model_copy(update={"muscle": muscle, "attachment": tuple(attachments), "from_file": False})


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
