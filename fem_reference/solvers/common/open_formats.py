"""Export of a problem to common formats (PLY, VTU, MSH, VTK, CSV, JSON), with lengths in mm and indices from 0."""

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path
from typing import Any

from fem_reference.effects import Effect, name_of, region_of
from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.version import __version__
from fem_reference.geometry.embedding import embed
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS
from fem_reference.io import files
from fem_reference.io.soup import rows
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone

UNITS = {"length": "mm", "force": "N", "pressure": "MPa", "time": "s", "mass": "tonne", "angle": "rad"}
CONVENTIONS = {
    "axes": "those of the surfaces of the case, right-handed",
    "indices": "from 0",
    "poses": "4 x 4, row by row: the matrix times the column [x, y, z, 1] at rest is the position at the frame",
}


def write(problem: MuscleProblem, folder: Path, of: Mapping[str, str]) -> None:
    """Write all files of a ``problem``, except documentation, into ``folder``. ``of``: facts that identify the case."""
    (folder / "bones").mkdir()
    files.write_surface(folder / "muscle.ply", problem.surface, problem.surface.points)
    for bone, name in zip(problem.bones, bone_files(problem), strict=True):
        files.write_surface(folder / name, bone.surface, bone.surface.points)
    along = {} if problem.directions is None else {"fibre": problem.directions}
    middles = problem.mesh.points[problem.mesh.tets].mean(axis=1)
    along |= {f"region_{name}": region(middles) for name, region in problem.regions.items()}
    for name in ("tets.vtu", "tets.msh"):
        files.write_field(folder / name, problem.mesh.points, problem.mesh.tets, {}, along)
    write_lines(folder / "fibres.vtk", problem.fibres)
    _write_tables(problem, folder)
    files.write_text(folder / "scene.json", json.dumps({**of, **facts(problem)}, indent=1, allow_nan=False))


def bone_files(problem: MuscleProblem) -> list[str]:
    """The file names of the bones, which are numbered because the name of a bone may be any text."""
    return [f"bones/{i}.ply" for i in range(len(problem.bones))]


def _write_tables(problem: MuscleProblem, folder: Path) -> None:
    each = [(bone, frame) for bone in problem.bones for frame in problem.frames]
    poses = [(bone.name, frame, *map(repr, bone.pose(frame).ravel().tolist())) for bone, frame in each]
    entries = [f"m{row}{column}" for row in range(4) for column in range(4)]
    write_csv(folder / "poses.csv", ("bone", "frame", *entries), poses)
    attached = [(one.attachment, one.bone.name, vertex) for one in problem.attached for vertex in one.vertices.tolist()]
    write_csv(folder / "attachments.csv", ("attachment", "bone", "vertex"), attached)
    of = problem.mesh.facets
    facets = [(one.attachment, one.bone.name, *abc) for one in problem.attached for abc in of[one.attachment].tolist()]
    write_csv(folder / "attachment_facets.csv", ("attachment", "bone", "a", "b", "c"), facets)
    within = embed(problem.mesh, problem.surface.points)
    places = zip(within.tets.tolist(), within.barycentric.tolist(), strict=True)
    inside = [(vertex, tet, *map(repr, shares)) for vertex, (tet, shares) in enumerate(places)]
    write_csv(folder / "surface_in_tets.csv", ("vertex", "tet", "w0", "w1", "w2", "w3"), inside)


def write_csv(path: Path, columns: Sequence[str], entries: Iterable[Sequence[object]]) -> None:
    """Write a table: a row with the names of the ``columns``, then the rows ``entries``."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *entries])
    files.write_text(path, text.getvalue())


def facts(problem: MuscleProblem) -> dict[str, Any]:
    """The facts that are not in mesh files: units, conventions, frames, bones, attachments, names of regions, and effects with the
    unit of each parameter. The shares of regions are stored in the files with tetrahedra.
    """
    contact = problem.contact
    bones = [
        _bone(bone) | {"file": name, "obstacle": contact is not None and contact.is_by(bone.name)}
        for bone, name in zip(problem.bones, bone_files(problem), strict=True)
    ]
    return {
        "written_by": f"fem_reference {__version__}",
        "units": UNITS,
        "conventions": CONVENTIONS,
        "frames": list(problem.frames),
        "interval": {"value": problem.interval, "unit": "s", "of": "the time from frame number n to n + 1"},
        "bones": bones,
        "attachments": [
            {"name": attached.attachment, "bone": attached.bone.name, "stiffness": attached.stiffness, "unit": "MPa/mm"}
            for attached in problem.attached
        ],
        "regions": list(problem.regions),
        "effects": [_effect(effect) for effect in problem.effects],
        "mesh": problem.mesh_facts,
    }


def _bone(bone: Bone) -> dict[str, Any]:
    """The facts about a bone: the name, the analytic shape if there is one, the motion, and the errors of distances to it [mm]."""
    form = {name: asdict(bone.solid) for name, form in CLOSED_FORMS.items() if isinstance(bone.solid, form)}
    found: dict[str, Any] = {"name": bone.name, **form}
    if (motion := bone.motion) is not None:
        turns, frames = motion.centre is not None, [float(frame) for frame in motion.frames]
        amount = "angle" if turns else "distance"
        along = {"axis": motion.axis, "centre": motion.centre} if turns else {"direction": motion.axis}
        pairs = zip(frames, motion.amounts, strict=True)
        found["motion"] = along | {"keyframes": [{"frame": frame, amount: value} for frame, value in pairs]}
    return found | {"distance_error": bone.distance_error, "distance_rounding": bone.distance_rounding}


def _effect(effect: Effect) -> dict[str, Any]:
    """The facts about an effect: the name, the law in words, and the value and unit of each parameter."""
    values = effect.model_dump(mode="json")
    parameters = {name: {"value": values[name], "unit": unit} for name, _, unit in effect.parameters}
    there = {"in": region} if (region := region_of(effect)) else {}
    return {"name": name_of(effect), "law": type(effect).__doc__, "parameters": parameters} | there


def write_lines(path: Path, lines: Polylines) -> None:
    """Write polylines as a legacy VTK text file, with coordinates in full precision."""
    ends = lines.offsets.tolist()
    cells = [" ".join(map(str, (b - a, *range(a, b)))) for a, b in pairwise(ends)]
    head = ["# vtk DataFile Version 3.0", "fibres at rest, mm", "ASCII", "DATASET POLYDATA"]
    head += [f"POINTS {len(lines.points)} double", *rows(lines.points)]
    size = f"LINES {len(cells)} {len(lines.points) + len(cells)}"
    files.write_text(path, "\n".join([*head, size, *cells, ""]))
