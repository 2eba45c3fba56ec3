"""VTK's legacy format, text or binary, read with numpy alone. No array is larger than the number of bytes in the file allows."""

import re
from itertools import islice
from typing import Any

import numpy as np

from fem_reference.io.soup import DataSet, check_number, checked_cells, whole_number

_HEAD = re.compile(rb"# vtk DataFile Version (\d+)\.(\d+)[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET\s+(\w+)\s*?\n")
_KINDS = {b"POLYDATA": "PolyData", b"UNSTRUCTURED_GRID": "UnstructuredGrid"}
_CELLS = {"LINES": "Lines", "POLYGONS": "Polys", "TRIANGLE_STRIPS": "Strips", "CELLS": "Cells", "VERTICES": "Verts"}
_TYPES = {
    "char": "i1", "signed_char": "i1", "short": "i2", "int": "i4", "long": "i8", "vtktypeint32": "i4", "vtktypeint64": "i8",
    "unsigned_char": "u1", "unsigned_short": "u2", "unsigned_int": "u4", "unsigned_long": "u8", "vtktypeuint32": "u4",
    "vtktypeuint64": "u8", "vtkidtype": "i4", "float": "f4", "double": "f8",
}  # fmt: skip
# Attributes with a fixed number of components, which is given here. The third word of their line is the type.
_COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}
_COMPONENTS |= dict.fromkeys(("GLOBAL_IDS", "PEDIGREE_IDS", "EDGE_FLAGS"), 1)


def read(data: bytes) -> DataSet:
    """The data set in the bytes of a file; other sections are skipped. Raises ValueError or another error if it is incomplete."""
    head = _HEAD.match(data)
    if head is None:
        raise ValueError("no header of a VTK file")
    if head[4] not in _KINDS:
        raise ValueError(f"a VTK file of {head[4].decode()}, neither {' nor '.join(_KINDS.values())}")
    file = _File(data, head.end(), text=head[3] == b"ASCII")
    kind, points, types = _KINDS[head[4]], np.zeros((0, 3)), np.zeros(0, np.int64)
    parts: dict[str, tuple[Any, Any]] = {}
    while words := file.line():
        name = words[0].upper()
        if name == "POINTS":
            points = file.array(words[1], words[2], 3).reshape(-1, 3)
        elif name in _CELLS:
            read_cells = file.cells_by_offsets if int(head[1]) >= 5 else file.cells
            parts[_CELLS[name]] = read_cells(words[1], words[2])
        elif name == "CELL_TYPES":
            types = file.array(words[1], "int")
        else:
            file.skip(name, words)
    cells = {name: checked_cells(*parts.get(name, ([], [])), len(points)) for name in _CELLS.values()}
    if kind == "UnstructuredGrid":
        check_number(types, len(cells["Cells"].sizes), "types")
    return DataSet(kind, points, cells, types)


class _File:
    """The bytes of a file, text or binary, read from position ``at`` on; ``values``: the number of values of each attribute."""

    def __init__(self, data: bytes, at: int, *, text: bool) -> None:
        self.data, self.at, self.text, self.values = data, at, text, "0"

    def line(self) -> list[str]:
        """The words of the next line that is not empty; no words at the end of the file."""
        words = list[str]()
        while not words and self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words = self.data[self.at : min(end, self.at + 1000)].decode("utf-8", errors="replace").split()
            self.at = end + 1
        return words

    def array(self, number: str, kind: str, components: int = 1) -> Any:
        """The next ``number`` times ``components`` values of type ``kind``. Raises ValueError if there are fewer."""
        if kind.lower() not in _TYPES:
            raise ValueError(f'numbers of type "{kind}"')
        dtype, count = np.dtype(">" + _TYPES[kind.lower()]), whole_number(number, "a count") * components
        if count > len(self.data) - self.at + 1:
            raise ValueError(f"{count} numbers declared in {len(self.data) - self.at} bytes")
        if not self.text:
            found = np.frombuffer(self.data, dtype, count, self.at)
            self.at += found.nbytes
            return found
        words = list(islice(re.compile(rb"\S+").finditer(self.data, self.at), count))
        check_number(words, count, "numbers")
        self.at = words[-1].end() if words else self.at
        with np.errstate(over="ignore"):
            values = np.array([word[0] for word in words], bytes)
            return values.astype(np.float64 if dtype.kind == "f" else np.int64).astype(dtype.newbyteorder("="))

    def cells(self, count: str, size: str) -> tuple[Any, Any]:
        """The sizes of cells and their corners, as stored before version 5 of the format: each cell is preceded by its size."""
        values = self.array(size, "int").tolist()
        sizes, corners, at = list[int](), list[int](), 0
        while at < len(values):
            sizes.append(values[at])
            corners += values[at + 1 : at + 1 + max(0, values[at])]
            at += 1 + max(0, values[at])
        check_number(sizes, whole_number(count, "a count"), "cells")
        return sizes, corners

    def cells_by_offsets(self, count: str, size: str) -> tuple[Any, Any]:
        """The sizes of cells and their corners, as stored since version 5 of the format."""
        offsets, corners = self._named("OFFSETS", count), self._named("CONNECTIVITY", size)
        if len(offsets) and offsets[0] != 0:
            raise ValueError("offsets that do not begin with 0")
        return np.diff(np.asarray(offsets, np.int64)), corners

    def _named(self, name: str, count: str) -> Any:
        """The array after a line that consists of its ``name`` and its type."""
        words = self.line()
        if words[:1] != [name]:
            raise ValueError(f"no {name} of cells")
        return self.array(count, words[1])

    def skip(self, name: str, words: list[str]) -> None:
        """Skip the section ``name``, which begins with a line of ``words``. Raises ValueError if its arrays are incomplete."""
        of_bytes = "float" if self.text else "unsigned_char"
        if name in ("POINT_DATA", "CELL_DATA"):
            self.values = words[1]
        elif name == "METADATA":
            found = re.compile(rb"\n[ \t\r]*\n").search(self.data, max(self.at - 1, 0))
            self.at = len(self.data) if found is None else found.end()
        elif name == "FIELD":
            self._skip_field(words[2])
        elif name == "SCALARS":
            self.line()  # the name of its lookup table
            self.array(self.values, words[2], whole_number(words[3], "a count") if len(words) > 3 else 1)
        elif name == "LOOKUP_TABLE":
            self.array(words[2], of_bytes, 4)
        elif name in ("COLOR_SCALARS", "TEXTURE_COORDINATES"):
            self.array(self.values, words[3] if name[0] == "T" else of_bytes, whole_number(words[2], "a count"))
        elif name in _COMPONENTS:
            self.array(self.values, words[2], _COMPONENTS[name])
        else:
            raise ValueError(f'a section "{name[:40]}"')

    def _skip_field(self, arrays: str) -> None:
        left = whole_number(arrays, "a count")
        while left:
            words = self.line()
            if not words:
                raise ValueError(f"a field with {left} of {arrays} arrays missing")
            if words[0] == "METADATA":
                self.skip("METADATA", words)
            else:
                self.array(words[2], words[3], whole_number(words[1], "a count"))
                left -= 1
