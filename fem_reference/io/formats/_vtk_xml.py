"""VTK's XML formats, read with numpy alone: no array is made that the file has no bytes for.

VTK's own readers are native code that believes a file: what it says wrongly ends or hangs the process.
"""

import base64
import lzma
import re
import warnings
import zlib
from collections.abc import Callable
from typing import Any
from xml.etree.ElementTree import Element, fromstring

import numpy as np

from fem_reference.io.formats._vtk_cells import DataSet, checked, joined
from fem_reference.io.texts import check_no_entities

# The most bytes of an array that was compressed.
_MOST = 2**28
_KINDS = {"PolyData": ("Lines", "Strips", "Polys"), "UnstructuredGrid": ("Cells",)}
_END = re.compile(rb"</AppendedData>\s*</VTKFile>\s*\Z")
_TYPES = {"Float32": "f4", "Float64": "f8"}
_TYPES |= {f"{sign}Int{8 * size}": f"{code}{size}" for sign, code in (("", "i"), ("U", "u")) for size in (1, 2, 4, 8)}


def read(data: bytes) -> DataSet:
    """The data set of a file; ValueError or another exception where it is none, or not whole."""
    head, mark, appended = data.partition(b"<AppendedData")
    check_no_entities(head)
    if mark and not _END.search(data, max(0, len(data) - 1000)):
        raise ValueError("no end of the appended data")
    root = fromstring(head + b"</VTKFile>" if mark else data)
    kind = root.get("type", "nothing")
    if root.tag != "VTKFile" or kind not in _KINDS:
        raise ValueError(f"a VTK file of {kind}, neither {' nor '.join(_KINDS)}")
    arrays = _Arrays(root, appended)
    pieces = root.findall(f"{kind}/Piece")
    if not pieces:
        return DataSet(kind, np.zeros((0, 3)), {})
    return joined([_piece(piece, kind, arrays.read) for piece in pieces])


def _piece(piece: Element, kind: str, read_array: Callable[[Element], Any]) -> DataSet:
    count = _count(piece, "NumberOfPoints")
    found = piece.find("Points/DataArray")
    if found is None and count:
        raise ValueError("no points")
    points = np.zeros((0, 3)) if found is None or not count else read_array(found).reshape(-1, 3)
    if len(points) != count:
        raise ValueError(f"{len(points)} points of {count}")
    cells, types = {}, np.zeros(0, np.int64)
    for name in _KINDS[kind]:
        arrays = {one.get("Name"): one for one in piece.findall(f"{name}/DataArray")}
        number = _count(piece, f"NumberOf{name}")
        ends, corners = (read_array(arrays[key]) if number else [] for key in ("offsets", "connectivity"))
        if len(ends) != number:
            raise ValueError(f"{len(ends)} offsets of {number} cells")
        cells[name] = checked(np.diff(np.asarray(ends, np.int64), prepend=0), corners, count)
        if kind == "UnstructuredGrid" and number:
            types = np.asarray(read_array(arrays["types"]), np.int64)
            if len(types) != number:
                raise ValueError(f"{len(types)} types of {number} cells")
    return DataSet(kind, points, cells, types)


def _count(piece: Element, name: str) -> int:
    text = piece.get(name, "0").strip()
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise ValueError(f'{name} of "{text[:40]}"')
    return int(text)


class _Arrays:
    """The arrays of a file with the ``root`` and what is ``appended`` to it, from behind the name of the element."""

    def __init__(self, root: Element, appended: bytes) -> None:
        self.order = ">" if root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(f"{self.order}u{8 if root.get('header_type') == 'UInt64' else 4}")
        self.compressor = root.get("compressor")
        if self.compressor and self.compressor not in _UNPACKING:
            raise ValueError(f"arrays compressed by {self.compressor[:40]}, none of {', '.join(_UNPACKING)}")
        attributes, _, self.appended = appended.partition(b"_")
        self.encoded = b"base64" in attributes

    def read(self, array: Element) -> Any:
        """The numbers of a DataArray, in one dimension."""
        kind = _TYPES.get(array.get("type", ""))
        if kind is None:
            raise ValueError(f'an array of type "{array.get("type")}"')
        form = array.get("format", "ascii")
        dtype = np.dtype(self.order + kind)
        if form == "ascii":
            return _numbers(array.text or "", np.dtype(kind))
        if form == "appended":
            offset = int(array.attrib["offset"])
            if not 0 <= offset <= len(self.appended):
                raise ValueError(f"an array at {offset} of {len(self.appended)} bytes")
            data, encoded = memoryview(self.appended)[offset:], self.encoded
        else:
            data, encoded = memoryview("".join((array.text or "").split()).encode("ascii")), True
        return np.frombuffer(self._bytes(data, encoded=encoded), dtype)

    def _bytes(self, data: memoryview, *, encoded: bool) -> bytes:
        """Bytes stored at the beginning of ``data``, behind a header with their length, or with those of compressed blocks."""
        size = self.header.itemsize
        take = _decoded if encoded else _taken
        if not self.compressor:
            (count,) = np.frombuffer(take(data, size), self.header).tolist()
            return take(data, size + count)[size:]
        blocks, block, last = np.frombuffer(take(data, 3 * size), self.header).tolist()
        total = (blocks - 1) * block + (last or block) if blocks else 0
        if total > _MOST or blocks * size > len(data):
            raise ValueError(f"an array of {total} bytes, more than {_MOST} or than the file has blocks for")
        head = size * (3 + blocks)
        lengths = np.frombuffer(take(data, head), self.header)[3:].tolist()
        packed = take(data[4 * -(-head // 3) :] if encoded else data[head:], sum(lengths))
        found, at = bytearray(), 0
        for i, length in enumerate(lengths):
            wanted = last if last and i == blocks - 1 else block
            part = _UNPACKING[self.compressor](packed[at : at + length], wanted + 1)  # never more than that
            if len(part) != wanted:
                raise ValueError(f"a block of {len(part)} bytes in place of {wanted}")
            found += part
            at += length
        return bytes(found)


def _taken(data: memoryview, count: int) -> bytes:
    if count > len(data):
        raise ValueError(f"{len(data)} bytes of {count}")
    return bytes(data[:count])


def _decoded(data: memoryview, count: int) -> bytes:
    """The first ``count`` bytes of what is base64."""
    found = base64.b64decode(_taken(data, 4 * -(-count // 3)), validate=True)
    if len(found) < count:
        raise ValueError(f"{len(found)} bytes of {count}")
    return found[:count]


def _of_lz4(packed: bytes, most: int) -> bytes:
    """A block of LZ4: runs of bytes as they are, each followed by a repetition of what was shortly before."""
    found, at = bytearray(), 0

    def extended(length: int) -> int:
        nonlocal at
        if length == 15:
            while packed[at] == 255:
                length, at = length + 255, at + 1
            length, at = length + packed[at], at + 1
        return length

    while at < len(packed):
        token = packed[at]
        at += 1
        plain = extended(token >> 4)
        found += packed[at : at + plain]
        at += plain
        if at >= len(packed):
            break
        back = int.from_bytes(packed[at : at + 2], "little")
        at += 2
        count = extended(token & 15) + 4
        if not 0 < back <= len(found) or len(found) + count > most:
            raise ValueError("a damaged block of LZ4")
        before = bytes(found[-back:])
        found += (before * (count // back + 1))[:count]
    return bytes(found)


_UNPACKING: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": lambda packed, most: zlib.decompressobj().decompress(packed, most),
    "vtkLZMADataCompressor": lambda packed, most: lzma.LZMADecompressor(memlimit=_MOST).decompress(packed, most),
    "vtkLZ4DataCompressor": _of_lz4,
}


def _numbers(text: str, dtype: np.dtype[Any]) -> Any:
    """The numbers of a text; ValueError where a word is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("a word that is no number") from error
