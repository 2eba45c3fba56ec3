"""Frames of a field on a mesh on disk: ``field/frame_0000.vtu``, which opens in ParaView, and ``.npz`` with every node."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.runs.states import read_arrays, write_arrays

FOLDER = "field"
VALUES = "psi"  # what the field itself is called


@dataclass(frozen=True, eq=False)
class NodalField:
    """Arrays by name at the nodes of ``mesh``: ``psi`` (N,), at the vertices, then for elements of order 2 at the middles of
    ``mesh.edges``; and where a solver computes a vector that psi is the norm of, its ``components`` (n, d) at the vertices.
    """

    mesh: FieldMesh
    arrays: dict[str, Floats]


def write(path: Path, field: NodalField) -> None:
    """Write a field: all its nodes as numbers, and into ``path``, a .vtu file, the vertices for ParaView."""
    mesh = field.mesh
    write_arrays(path.with_suffix(".npz"), {"points": mesh.points, "cells": mesh.cells} | field.arrays)
    shown = {name: values[: len(mesh.points)] for name, values in field.arrays.items()}
    files.write_field(path, mesh.points, mesh.cells, shown)


def read(folder: Path, numbers: tuple[int, ...]) -> tuple[FieldMesh, dict[str, Floats]]:
    """The mesh and by name the arrays (f, ...) of the frames in the ``folder`` of a run; InputError where a file is damaged."""
    frames = []
    for number in numbers:
        path = folder / FOLDER / f"frame_{number:04d}.npz"
        frames.append(read_arrays(path))
        if not {"points", "cells", VALUES} <= frames[-1].keys():
            raise InputError(path, ", ".join(frames[-1]), f"the arrays points, cells and {VALUES}")
    names = [name for name in frames[0] if name not in ("points", "cells")]
    mesh = FieldMesh(frames[0]["points"], frames[0]["cells"], str(folder))
    return mesh, {name: np.stack([frame[name] for frame in frames]) for name in names}
