"""VTK's legacy format, text or binary, read with numpy alone: no array is made that the file has no bytes for."""

import re
from itertools import islice
from typing import Any

import numpy as np

from fem_reference.io.formats._vtk_cells import DataSet, PointLists, checked

_HEAD = re.compile(rb"# vtk DataFile Version (\d+)\.(\d+)[^\n]*\n[^\n]*\n\s*(ASCII|BINARY)\s+DATASET\s+(\w+)\s*?\n")
_KINDS = {b"POLYDATA": "PolyData", b"UNSTRUCTURED_GRID": "UnstructuredGrid"}
_CELLS = {"LINES": "Lines", "POLYGONS": "Polys", "TRIANGLE_STRIPS": "Strips", "CELLS": "Cells", "VERTICES": "Verts"}
_TYPES = {
    "char": "i1", "signed_char": "i1", "short": "i2", "int": "i4", "long": "i8", "vtktypeint32": "i4", "vtktypeint64": "i8",
    "unsigned_char": "u1", "unsigned_short": "u2", "unsigned_int": "u4", "unsigned_long": "u8", "vtktypeuint32": "u4",
    "vtktypeuint64": "u8", "vtkidtype": "i4", "float": "f4", "double": "f8",
}  # fmt: skip
# Attributes with a fixed number of components; the third word of their line is the type.
_COMPONENTS = {"VECTORS": 3, "NORMALS": 3, "TENSORS": 9, "TENSORS6": 6}
_COMPONENTS |= dict.fromkeys(("GLOBAL_IDS", "PEDIGREE_IDS", "EDGE_FLAGS"), 1)


def read(data: bytes) -> DataSet:
    """The data set of a file; ValueError or another exception where it is none, or not whole."""
    head = _HEAD.match(data)
    if head is None:
        raise ValueError("no head of a VTK file")
    if head[4] not in _KINDS:
        raise ValueError(f"a VTK file of {head[4].decode()}, neither {' nor '.join(_KINDS.values())}")
    return _File(data, head.end(), text=head[3] == b"ASCII", new=int(head[1]) >= 5).read(_KINDS[head[4]])


class _File:
    """The bytes of a file, read from ``at``; ``new``: of version 5, with offsets."""

    def __init__(self, data: bytes, at: int, *, text: bool, new: bool) -> None:
        self.data, self.at, self.text, self.new = data, at, text, new
        self.count = 0
        self.points: Any = np.zeros((0, 3))
        self.parts: dict[str, tuple[Any, Any]] = {}
        self.types: Any = np.zeros(0, np.int64)

    def read(self, kind: str) -> DataSet:
        """All sections; what is not of points and cells is passed over, to its end."""
        while (words := self._line()) is not None:
            self._section(words)
        cells = {name: self._cells(name) for name in set(_CELLS.values())}
        if kind == "UnstructuredGrid" and len(self.types) != len(cells["Cells"].sizes):
            raise ValueError(f"{len(self.types)} types of {len(cells['Cells'].sizes)} cells")
        return DataSet(kind, self.points, cells, self.types)

    def _cells(self, name: str) -> PointLists:
        return checked(*self.parts.get(name, ([], [])), len(self.points))

    def _section(self, words: list[str]) -> None:
        name = words[0].upper()
        if name == "POINTS":
            self.points = self._array(3 * _number(words[1]), words[2]).reshape(-1, 3)
        elif name in _CELLS:
            self.parts[_CELLS[name]] = self._sizes_and_corners(_number(words[1]), _number(words[2]))
        elif name == "CELL_TYPES":
            self.types = np.asarray(self._array(_number(words[1]), "int"), np.int64)
        elif name in ("POINT_DATA", "CELL_DATA"):
            self.count = _number(words[1])
        elif name == "FIELD":
            self._field(_number(words[2]))
        elif name == "METADATA":
            self._to_empty_line()
        else:
            self._attribute(name, words)

    def _sizes_and_corners(self, count: int, size: int) -> tuple[Any, Any]:
        """Sizes of cells and their corners; in old files each cell is preceded by its size."""
        if self.new:
            offsets, corners = self._named("OFFSETS", count), self._named("CONNECTIVITY", size)
            if count and offsets[0] != 0:
                raise ValueError("offsets that do not begin with 0")
            return np.diff(np.asarray(offsets, np.int64)), corners
        values = self._array(size, "int").tolist()
        sizes, corners, at = list[int](), list[int](), 0
        while at < len(values):
            if not 0 <= values[at] < len(values) - at:
                raise ValueError("cells that do not fit in their list")
            sizes.append(values[at])
            corners += values[at + 1 : at + 1 + values[at]]
            at += 1 + values[at]
        if len(sizes) != count:
            raise ValueError(f"{len(sizes)} cells of {count}")
        return sizes, corners

    def _named(self, name: str, length: int) -> Any:
        """The array on whose line is a ``name`` and then its type."""
        words = self._line() or [""]
        if words[0].upper() != name:
            raise ValueError(f"no {name} of cells")
        return self._array(length, words[1])

    def _attribute(self, name: str, words: list[str]) -> None:
        of_bytes = "float" if self.text else "unsigned_char"
        if name == "SCALARS":
            if re.match(rb"\s*LOOKUP_TABLE\s", self.data[self.at : self.at + 100], re.IGNORECASE):
                self._line()
            self._array((_number(words[3]) if len(words) > 3 else 1) * self.count, words[2])
        elif name == "LOOKUP_TABLE":
            self._array(4 * _number(words[2]), of_bytes)
        elif name in ("COLOR_SCALARS", "TEXTURE_COORDINATES"):
            self._array(_number(words[2]) * self.count, words[3] if name[0] == "T" else of_bytes)
        elif name in _COMPONENTS:
            self._array(_COMPONENTS[name] * self.count, words[2])
        else:
            raise ValueError(f'a section "{name[:40]}"')

    def _field(self, arrays: int) -> None:
        left = arrays
        while left:
            words = self._line()
            if words is None:
                raise ValueError(f"{arrays - left} of {arrays} arrays of a field")
            if words[0] == "METADATA":
                self._to_empty_line()
                continue
            self._array(_number(words[1]) * _number(words[2]), words[3])
            left -= 1

    def _line(self) -> list[str] | None:
        """The words of the next line that has some; None at the end."""
        while self.at < len(self.data):
            end = self.data.find(b"\n", self.at)
            end = len(self.data) if end < 0 else end
            words = self.data[self.at : min(end, self.at + 1000)].decode("utf-8", errors="replace").split()
            self.at = end + 1
            if words:
                return words
        return None

    def _to_empty_line(self) -> None:
        found = re.compile(rb"\n[ \t\r]*\n").search(self.data, max(self.at - 1, 0))
        self.at = len(self.data) if found is None else found.end()

    def _array(self, count: int, kind: str) -> Any:
        """So many numbers of a kind; ValueError where there are fewer."""
        dtype = np.dtype(">" + _TYPES[kind.lower()]) if kind.lower() in _TYPES else None
        if dtype is None:
            raise ValueError(f'numbers of type "{kind}"')
        if count > len(self.data) - self.at + 1:
            raise ValueError(f"{count} numbers said to be in {len(self.data) - self.at} bytes")
        if not self.text:
            found = np.frombuffer(self.data, dtype, count, self.at)
            self.at += found.nbytes
            return found
        words = list(islice(re.compile(rb"\S+").finditer(self.data, self.at), count))
        if len(words) < count:
            raise ValueError(f"{len(words)} numbers of {count}")
        self.at = words[-1].end() if words else self.at
        with np.errstate(over="ignore"):
            values = np.array([word[0] for word in words], bytes)
            return values.astype(np.float64 if dtype.kind == "f" else np.int64).astype(dtype.newbyteorder("="))


def _number(word: str) -> int:
    if not re.fullmatch(r"\d{1,18}", word, re.ASCII):
        raise ValueError(f'a count of "{word[:40]}"')
    return int(word)
