"""The PLY format, with numpy alone."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, only_triangles, rows

_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_TYPES |= {"float": "f4", "double": "f8"}
_TYPES |= {np.dtype(code).name: code for code in _TYPES.values()}  # PLY also allows numpy's names: int8 ... float64
_CORNERS = ("vertex_indices", "vertex_index")


def _read(path: Path) -> Soup:
    """The positions and faces in a PLY file, text or binary. A list must have the same length in all rows of an element."""
    parts = re.match(rb"ply\s(.*?)end_header\r?\n(.*)", path.read_bytes(), re.DOTALL)
    if parts is None:
        raise ValueError("no PLY header")
    words = [line.split() for line in parts[1].decode("ascii").splitlines()]
    kind = next(line[1] for line in words if line[:1] == ["format"])
    order = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    types, body = {name: order + code for name, code in _TYPES.items()}, parts[2]
    if kind == "ascii":
        types, body = dict.fromkeys(_TYPES, "=f8"), np.array(body.split()).astype(np.float64).tobytes()
    tables = {}
    starts = [i for i, line in enumerate(words) if line[:1] == ["element"]]
    for start, stop in zip(starts, [*starts[1:], len(words)], strict=True):
        _, name, count = words[start]
        properties = [line[1:] for line in words[start:stop] if line[:1] == ["property"]]
        tables[name], body = _element(body, int(count), properties, types)
    if not {"vertex", "face"} <= tables.keys():
        raise ValueError("no vertices or no faces")
    vertex, face = tables["vertex"], tables["face"]
    corners = next(name for name in _CORNERS if name in face.dtype.names)
    return np.column_stack([vertex[axis] for axis in "xyz"]), face[corners]


def _element(body: bytes, count: int, properties: list[list[str]], types: dict[str, str]) -> tuple[Any, bytes]:
    """The table of an element, and the bytes that follow it. The lengths of lists are taken from the first row."""
    fields: list[tuple[Any, ...]] = []
    for *kind, name in properties:
        if kind[0] == "list":
            first = np.frombuffer(body, types[kind[1]], 1, np.dtype(fields).itemsize) if count else [3]
            if name in _CORNERS:
                only_triangles({int(first[0])})
            fields += [(f"{name} size", types[kind[1]]), (name, types[kind[2]], (int(first[0]),))]
        else:
            fields.append((name, types[kind[0]]))
    table = np.frombuffer(body, np.dtype(fields), count)
    for name in (name for *kind, name in properties if kind[0] == "list"):
        if (table[f"{name} size"] != table[name].shape[1]).any():
            raise ValueError("polygons of different sizes")
    return table, body[table.nbytes :]


def _write(path: Path, surface: Surface, displacement: Floats) -> None:  # noqa: ARG001 - PLY has no displacements
    axes = "".join(f"property double {axis}\n" for axis in "xyz")
    head = (
        f"ply\nformat ascii 1.0\ncomment unit mm\nelement vertex {len(surface.points)}\n{axes}"
        f"element face {len(surface.triangles)}\nproperty list uchar int vertex_indices\nend_header"
    )
    faces = (f"3 {a} {b} {c}" for a, b, c in surface.triangles.tolist())
    path.write_text("\n".join([head, *rows(surface.points), *faces, ""]), encoding="utf-8")


FORMAT = Format((".ply",), _read, _write)
