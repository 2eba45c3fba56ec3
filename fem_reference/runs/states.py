"""The finite element states and the scalar fields of a run: arrays for each frame, written and read with numpy alone.

<run>/state/rest.npz          points (n, 3) [mm], tets (m, 4), fibre (m, 3): unit vectors along the fibres, (0, 3) without fibres
            /frame_0010.npz   the arrays of ``NodalState``
     /field/frame_0000.vtu    a scalar field at the vertices, for ParaView
            /frame_0000.npz   the arrays of ``NodalField`` and the mesh
"""

import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, TetMesh
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.runs.contents import frame_file

FOLDER, FIELD = "state", "field"
VALUES = "psi"  # the name of the array with the values of a field
# The maximum size [bytes] of the arrays in a file, which is the size of a state with a million tetrahedra.
MOST_BYTES = 2**30
# The arrays in a file by name.
Arrays = dict[str, NDArray[Any]]
_ARRAYS = ("displacement", "pressure", "before", "rate")
_IN_SITU = ("response", "response_pressure")


@dataclass(frozen=True, eq=False)
class NodalState:
    """The unknowns of m cells.

    ``displacement`` (m, k, 3) [mm] is given at the k nodes of the element, in the order of ``body.reference_nodes``. ``pressure``
    (m, l) [MPa] is given at the corners (l = 4 in a tetrahedron), is constant in the cell (l = 1), or is absent (l = 0).

    If an effect depends on velocities, ``before`` (m, k, 3) [mm] is the displacement at the start of the last load step, and
    ``rate`` [1/s] is the reciprocal of its duration; otherwise they have the shape (0, 0, 3) and the value 0. For a body in situ,
    ``response`` (m, k, 3) [mm] and ``response_pressure`` (m, l) [MPa] determine the stress at rest (``effects.in_situ``); otherwise
    they have the shapes (0, 0, 3) and (0, 0).
    """

    displacement: Floats
    pressure: Floats
    before: Floats
    rate: float = 0.0
    response: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))
    response_pressure: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def arrays(self) -> Arrays:
        """The arrays to be written, by name."""
        return {name: getattr(self, name) for name in (*_ARRAYS, *(_IN_SITU if len(self.response) else ()))}

    @classmethod
    def of(cls, arrays: Mapping[str, ArrayLike]) -> "NodalState":
        """The state with these ``arrays``, given by name. Raises KeyError if an array is missing."""
        displacement, pressure, before, rate = (np.asarray(arrays[name], float) for name in _ARRAYS)
        own = {name: np.asarray(arrays[name], float) for name in _IN_SITU if name in arrays}
        return cls(displacement, pressure, before, float(rate), **own)


def write_rest(folder: Path, mesh: TetMesh, fibre: Floats | None) -> None:
    """Write the ``mesh`` at rest and its fibre directions ``fibre`` (m, 3) for the states of the run in ``folder``."""
    directions = np.zeros((0, 3)) if fibre is None else fibre
    write_arrays(folder / FOLDER / "rest.npz", {"points": mesh.points, "tets": mesh.tets, "fibre": directions})


def write(folder: Path, frame: float, state: NodalState) -> None:
    """Write the ``state`` at the frame number ``frame`` into the folder of a run."""
    write_arrays(_place(folder, frame), state.arrays)


def are_kept(folder: Path, frames: tuple[int, ...]) -> bool:
    """True if the run in ``folder`` has stored states at all ``frames``."""
    return all(path.is_file() for path in (folder / FOLDER / "rest.npz", *(_place(folder, frame) for frame in frames)))


def read_rest(folder: Path) -> tuple[TetMesh, Floats | None]:
    """The mesh at rest, and the fibre directions (m, 3) or None without fibres, of the states in the folder of a run.

    Raises InputError if the run has no states, or if the file is damaged.
    """
    place = folder / FOLDER / "rest.npz"
    if not place.is_file():
        raise InputError(folder, "a run without states", "a run of the reference, solved with store_state = true")
    arrays = read_arrays(place, ("points", "tets", "fibre"))
    points, tets, fibre = arrays["points"], arrays["tets"], arrays["fibre"]
    fits = points.dtype.kind == fibre.dtype.kind == "f" and tets.dtype.kind == "i" and fibre.ndim == 2
    fits = fits and points.ndim == tets.ndim == 2 and (points.shape[1], tets.shape[1], fibre.shape[1]) == (3, 4, 3)
    fits = fits and tets.size > 0 and tets.min() >= 0 and tets.max() < len(points) and len(fibre) in (0, len(tets))
    if not (fits and np.isfinite(points).all()):
        got = f"arrays {points.shape}, {tets.shape} and {fibre.shape}"
        raise InputError(place, got, "finite points (n, 3), tets (m, 4) of these points and fibre (m or 0, 3)")
    return TetMesh(points, tets), fibre if len(fibre) else None


class StoredStates(Mapping[float, NodalState]):
    """The states of the run in ``folder``, by frame number. They are read on demand, and the last state is kept in memory."""

    def __init__(self, folder: Path, frames: tuple[int, ...]) -> None:
        self.folder, self.frames = folder, frames
        self.last: tuple[float, NodalState] | None = None

    def __getitem__(self, frame: float) -> NodalState:
        if frame not in self.frames:
            raise KeyError(frame)
        if self.last is None or self.last[0] != frame:
            place = _place(self.folder, frame)
            arrays = read_arrays(place, _ARRAYS, _IN_SITU)
            try:
                self.last = (frame, NodalState.of(arrays))
            except (TypeError, ValueError) as error:
                raise InputError(place, str(error), "the arrays of a state") from error
        return self.last[1]

    def __iter__(self) -> Iterator[float]:
        return iter(self.frames)

    def __len__(self) -> int:
        return len(self.frames)


def _place(folder: Path, frame: float) -> Path:
    return folder / FOLDER / frame_file(frame, ".npz")


def write_arrays(path: Path, arrays: Arrays) -> None:
    """Write ``arrays`` into an .npz file."""
    path.parent.mkdir(exist_ok=True)
    with files.whole(path) as part:
        np.savez(part, allow_pickle=False, **arrays)


def read_arrays(path: Path, names: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Arrays:
    """The arrays with the given ``names`` (by default all) in an .npz file, and those with names in ``also`` that exist.

    Raises InputError if the file is damaged or too large, or if it lacks one of the ``names``.
    """
    try:
        with path.open("rb") as file:
            with zipfile.ZipFile(file) as members:
                size = sum(member.file_size for member in members.infolist())
            if size > MOST_BYTES:
                raise ValueError(f"{size / 2**20:.0f} MB of arrays, more than {MOST_BYTES / 2**20:.0f}")
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                there = [name for name in also if name in arrays.files]
                return {name: arrays[name] for name in (*(names or arrays.files), *there)}
    except Exception as error:  # zipfile and numpy raise many types of errors on a damaged file
        raise InputError(path, repr(error), f"the arrays {', '.join(names)} of a stored state") from error


@dataclass(frozen=True, eq=False)
class NodalField:
    """A scalar field as arrays at the nodes of a ``mesh``.

    The array ``psi`` (N,) has the values at the vertices and, for elements of order 2, then at the midpoints of ``mesh.edges``. It
    is NaN after a failure. The array ``components`` (n, d), which some solvers add, has the vector whose norm is psi at the
    vertices. ``form``: the weak form that was solved.
    """

    mesh: FieldMesh
    arrays: dict[str, Floats]
    form: str


def write_field(path: Path, field: NodalField) -> None:
    """Write a field twice: at the vertices, into the .vtu file ``path`` for ParaView; and at all nodes, into an .npz file."""
    mesh = field.mesh
    write_arrays(path.with_suffix(".npz"), {"points": mesh.points, "cells": mesh.cells} | field.arrays)
    shown = {name: values[: len(mesh.points)] for name, values in field.arrays.items()}
    files.write_field(path, mesh.points, mesh.cells, shown)


def read_field(folder: Path, numbers: tuple[int, ...]) -> tuple[FieldMesh, dict[str, Floats]]:
    """The mesh of the fields of the run in ``folder``, and their arrays (f, ...) by name, at the frame ``numbers`` (f,).

    Raises InputError if a file is damaged.
    """
    frames = []
    for number in numbers:
        path = folder / FIELD / frame_file(number, ".npz")
        frames.append(read_arrays(path))
        if not {"points", "cells", VALUES} <= frames[-1].keys():
            raise InputError(path, ", ".join(frames[-1]), f"the arrays points, cells and {VALUES}")
        _check_field(frames[-1], frames[0], path)
    names = [name for name in frames[0] if name not in ("points", "cells")]
    mesh = FieldMesh(frames[0]["points"], frames[0]["cells"], str(folder))
    return mesh, {name: np.stack([frame[name] for frame in frames]) for name in names}


def _check_field(arrays: dict[str, Any], first: dict[str, Any], path: Path) -> None:
    """Raise InputError if the arrays of a frame are not a field, or not a field on the mesh of the ``first`` frame."""
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
        want = f"points (n, d), cells (m, 2 or 3) and {VALUES} of one mesh, as in the other frames"
        raise InputError(path, got, want)
    nodes = {len(points), len(points) + len(FieldMesh(points, cells).edges)}
    if len(values) not in nodes or any(len(array) < len(points) for name, array in arrays.items() if name != "cells"):
        raise InputError(path, f"{len(values)} values", f"{' or '.join(map(str, sorted(nodes)))}, one for each node")
