"""Frames of a field on a mesh on disk: ``field/frame_0000.vtu``, which opens in ParaView, and ``.npz`` with every node."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.runs.contents import frame_file
from fem_reference.runs.states import read_arrays, write_arrays

FOLDER = "field"
VALUES = "psi"  # the name of the field itself


@dataclass(frozen=True, eq=False)
class NodalField:
    """Arrays by name at the nodes of ``mesh``: ``psi`` (N,) at the vertices, then for elements of order 2 at the middles of
    ``mesh.edges``. ``components`` (n, d) at the vertices: the vector whose norm is psi, where a solver computes one.
    ``form``: the weak form that was solved. After a failure psi is not-a-number.
    """

    mesh: FieldMesh
    arrays: dict[str, Floats]
    form: str


def write(path: Path, field: NodalField) -> None:
    """Write a field: the values of all nodes as an array, and the vertices into ``path``, a .vtu file for ParaView."""
    mesh = field.mesh
    write_arrays(path.with_suffix(".npz"), {"points": mesh.points, "cells": mesh.cells} | field.arrays)
    shown = {name: values[: len(mesh.points)] for name, values in field.arrays.items()}
    files.write_field(path, mesh.points, mesh.cells, shown)


def read(folder: Path, numbers: tuple[int, ...]) -> tuple[FieldMesh, dict[str, Floats]]:
    """The mesh, and by name the arrays (f, ...) of the frames, of the run in ``folder``; InputError where a file is damaged."""
    frames = []
    for number in numbers:
        path = folder / FOLDER / frame_file(number, ".npz")
        frames.append(read_arrays(path))
        if not {"points", "cells", VALUES} <= frames[-1].keys():
            raise InputError(path, ", ".join(frames[-1]), f"the arrays points, cells and {VALUES}")
        _check(frames[-1], frames[0], path)
    names = [name for name in frames[0] if name not in ("points", "cells")]
    mesh = FieldMesh(frames[0]["points"], frames[0]["cells"], str(folder))
    return mesh, {name: np.stack([frame[name] for frame in frames]) for name in names}


def _check(arrays: dict[str, Any], first: dict[str, Any], path: Path) -> None:
    """Raise InputError where a frame's arrays are not those of a field, or belong to another mesh than the ``first``."""
    points, cells, values = arrays["points"], arrays["cells"], arrays[VALUES]
    found = {name: (array.shape, array.dtype.kind) for name, array in arrays.items()}
    usable = (
        all(kind in "fiu" for _, kind in found.values())
        and points.ndim == cells.ndim == 2
        and points.shape[1] in (1, 2, 3)
        and cells.shape[1] in (2, 3)
        and cells.dtype.kind == "i"
        and cells.size > 0
        and cells.min() >= 0
        and cells.max() < len(points)
        and values.ndim == 1
    )
    if not usable or found != {name: (array.shape, array.dtype.kind) for name, array in first.items()}:
        got = ", ".join(f"{name} {shape} of {kind}" for name, (shape, kind) in found.items())
        raise InputError(
            path, got, f"points (n, d), cells (m, 2 or 3) and {VALUES} of one mesh, as in the other frames"
        )
    nodes = {len(points), len(points) + len(FieldMesh(points, cells).edges)}
    if len(values) not in nodes or any(len(array) < len(points) for name, array in arrays.items() if name != "cells"):
        raise InputError(path, f"{len(values)} values", f"{' or '.join(map(str, sorted(nodes)))}, one a node")
