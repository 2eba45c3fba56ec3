"""PLY, OBJ, OFF and STL with numpy alone: points and triangles as in the file; ValueError where it is not whole.

And what points, triangles and lines of any format must be.
"""

import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints

Soup = tuple[Any, Any]
_PLY_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_PLY_TYPES |= {"float": "f4", "double": "f8"}
_PLY_TYPES |= {
    np.dtype(code).name: code for code in _PLY_TYPES.values()
}  # PLY also has numpy's names: int8 ... float64
_PLY_CORNERS = ("vertex_indices", "vertex_index")
_STL_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def arrays(soup: Soup) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (m, 3) as arrays; ValueError or OverflowError where they are none."""
    points, corners = (np.asarray(values) for values in soup)
    if len(corners) == 0:
        raise ValueError("no triangles")
    if len(points) == 0:
        raise ValueError("no vertices")
    if points.shape != (len(points), 3):
        raise ValueError(f"points of shape {points.shape}")
    with np.errstate(invalid="ignore"):  # not a number becomes another one, and is found below
        triangles = np.asarray(soup[1], np.int64)
    if triangles.shape != (len(triangles), 3) or (triangles != corners).any():
        raise ValueError(f"corners of shape {corners.shape} that are not three point numbers each")
    return points.astype(np.float64), triangles


def check_lines(points: Floats, lines: list[list[int]]) -> None:
    """ValueError where a line is of fewer than two points, or of one that is not among ``points`` (n, 3)."""
    for number, line in enumerate(lines):
        if len(line) < 2:
            raise ValueError(f"line {number} of {len(line)} points")
        if min(line) < 0 or max(line) >= len(points):
            raise ValueError(f"line {number} with a point that does not exist, of {len(points)}")


def check_lengths(points: Floats, lines: list[list[int]]) -> None:
    """ValueError where one of ``points`` (n, 3) is not finite or a line has no length."""
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ValueError(f"a point that is not finite (point {bad[0]})")
    for number, line in enumerate(lines):
        if (points[line] == points[line[0]]).all():
            raise ValueError(f"line {number} of zero length")


def joined(cells: list[list[int]]) -> list[list[int]]:
    """Lines of point numbers; a cell that begins where one other ends goes on from there."""
    starts, ends = Counter(cell[0] for cell in cells), Counter(cell[-1] for cell in cells)
    shared = {point for point in starts if starts[point] == ends[point] == 1}
    after = {cell[0]: cell for cell in cells}
    lines = []
    for cell in (cell for cell in cells if cell[0] not in shared):
        line = list(cell)
        while line[-1] in shared:
            line += after[line[-1]][1:]
        lines.append(line)
    if sum(len(line) - 1 for line in lines) != sum(len(cell) - 1 for cell in cells):
        raise ValueError("lines that close to a ring")
    return lines


def only_triangles(corners: set[int]) -> None:
    """ValueError where polygons have another number of corners than three."""
    if other := corners - {3}:
        raise ValueError(f"a polygon of {min(other)} corners")


def read_ply(path: Path) -> Soup:
    """PLY, text or binary of either byte order; a list must be equally long in the whole element."""
    parts = re.match(rb"ply\s(.*?)end_header\r?\n(.*)", path.read_bytes(), re.DOTALL)
    if parts is None:
        raise ValueError("no PLY header")
    words = [line.split() for line in parts[1].decode("ascii").splitlines()]
    kind = next(line[1] for line in words if line[:1] == ["format"])
    order = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    types, body = {name: order + code for name, code in _PLY_TYPES.items()}, parts[2]
    if kind == "ascii":
        types, body = dict.fromkeys(_PLY_TYPES, "=f8"), np.array(body.split()).astype(np.float64).tobytes()
    tables = {}
    starts = [i for i, line in enumerate(words) if line[:1] == ["element"]]
    for start, stop in zip(starts, [*starts[1:], len(words)], strict=True):
        _, name, count = words[start]
        properties = [line[1:] for line in words[start:stop] if line[:1] == ["property"]]
        tables[name], body = _ply_element(body, int(count), properties, types)
    if not {"vertex", "face"} <= tables.keys():
        raise ValueError("no vertices with faces")
    vertex, face = tables["vertex"], tables["face"]
    corners = next(name for name in _PLY_CORNERS if name in face.dtype.names)
    return np.column_stack([vertex[axis] for axis in "xyz"]), face[corners]


def _ply_element(body: bytes, count: int, properties: list[list[str]], types: dict[str, str]) -> tuple[Any, bytes]:
    """The table of an element and what follows it; the first row states how long its lists are."""
    fields: list[tuple[Any, ...]] = []
    for *kind, name in properties:
        if kind[0] == "list":
            first = np.frombuffer(body, types[kind[1]], 1, np.dtype(fields).itemsize) if count else [3]
            if name in _PLY_CORNERS:
                only_triangles({int(first[0])})
            fields += [(f"{name} size", types[kind[1]]), (name, types[kind[2]], (int(first[0]),))]
        else:
            fields.append((name, types[kind[0]]))
    table = np.frombuffer(body, np.dtype(fields), count)
    for name in (name for *kind, name in properties if kind[0] == "list"):
        if (table[f"{name} size"] != table[name].shape[1]).any():
            raise ValueError("polygons of different sizes")
    return table, body[table.nbytes :]


def read_obj(path: Path) -> Soup:
    """Wavefront OBJ: the positions and faces, corners counted from 1, or back from the last."""
    points: list[list[float]] = []
    triangles = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        word, *values = line.split() or [""]
        if word == "v":
            points.append([float(value) for value in values[:3]])
        elif word == "f":
            only_triangles({len(values)})
            corners = (int(value.split("/")[0]) for value in values)
            triangles.append([corner - 1 if corner > 0 else len(points) + corner for corner in corners])
    return _positions(points), triangles


def read_off(path: Path) -> Soup:
    """Geomview OFF: text, counts, positions, faces; colours are passed over."""
    text = re.sub(r"#[^\n]*", "", path.read_text(encoding="utf-8"))
    parts = re.match(r"\s*C?N?OFF\s+(\d+)\s+(\d+)\s+\d+\s+(.*)", text, re.DOTALL)
    if parts is None:
        raise ValueError("no OFF header")
    vertices, faces = int(parts[1]), int(parts[2])
    rows = [line.split() for line in parts[3].splitlines() if line.strip()]
    if len(rows) != vertices + faces:
        raise ValueError(f"{len(rows)} rows of {vertices} vertices and {faces} faces")
    only_triangles({size for row in rows[vertices:] for size in (int(row[0]), len(row[1:4]))})
    points = _positions([[float(value) for value in row[:3]] for row in rows[:vertices]])
    return points, [[int(value) for value in row[1:4]] for row in rows[vertices:]]


def _positions(rows: list[list[float]]) -> Any:
    if any(len(row) != 3 for row in rows):
        raise ValueError("a position of fewer than three coordinates")
    return np.array(rows)


def read_stl(path: Path) -> Soup:
    """STL, text or binary: three points a triangle, in the order of the file."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        points = np.frombuffer(data, _STL_FACET, count, 84)["corners"].reshape(-1, 3)
    elif re.match(rb"\s*solid\b.*\bendsolid\b[^\n]*\s*$", data, re.DOTALL):
        lines = [line.split()[1:] for line in data.splitlines() if line.lstrip().startswith(b"vertex")]
        points = np.array(lines).astype(np.float64)
    else:
        raise ValueError(f"{len(data)} bytes that are no complete STL file")
    return points, np.arange(len(points)).reshape(-1, 3)


def displacement(data: dict[str, Any], points: Floats) -> Any:
    """The displacement among point ``data`` of a step; ValueError where there is none of the shape of ``points``."""
    name = next((name for name in ("displacement", "u") if np.shape(data.get(name, 0)) == points.shape), None)
    if name is None:
        raise ValueError(f"point data {', '.join(data) or 'nothing'} in a step")
    return data[name]
