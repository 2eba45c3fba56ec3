"""VTK's XML formats, read with numpy alone. The number of bytes in the file limits the size of each array.

VTK's own readers are native code that trusts the file: a wrong number in a file can crash or hang the process.
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

from fem_reference.foundations.mesh import Ints
from fem_reference.io.soup import DataSet, PointLists, check_number, checked_cells, whole_number
from fem_reference.io.texts import check_no_entities

_KINDS = {"PolyData": ("Lines", "Strips", "Polys"), "UnstructuredGrid": ("Cells",)}
_TYPES = {"Float32": "f4", "Float64": "f8"}
_TYPES |= {f"{sign}Int{8 * size}": f"{sign or 'i'}{size}".lower() for sign in ("", "U") for size in (1, 2, 4, 8)}
_END = re.compile(rb"</AppendedData>\s*</VTKFile>\s*\Z")
# The maximum size in bytes of a compressed array after decompression.
_MOST = 2**28


def read(data: bytes) -> DataSet:
    """The data set in the bytes of a file, with its pieces joined. Raises ValueError or another exception if it is invalid."""
    head, mark, appended = data.partition(b"<AppendedData")
    check_no_entities(head)
    if mark and not _END.search(data, max(0, len(data) - 1000)):
        raise ValueError("appended data without a closing tag")
    root = fromstring(head + b"</VTKFile>" if mark else data)
    kind = root.get("type", "unknown")
    if root.tag != "VTKFile" or kind not in _KINDS:
        raise ValueError(f"a VTK file of type {kind}, neither {' nor '.join(_KINDS)}")
    arrays, first = _Arrays(root, appended), 0
    points, types = [np.zeros((0, 3))], [np.zeros(0, np.int64)]
    cells = {name: [PointLists(types[0], types[0])] for name in _KINDS[kind]}
    for piece in root.findall(f"{kind}/Piece"):
        points.append(_points(piece, arrays))
        for name, parts in cells.items():
            sizes, corners, own_types = _cells(piece, name, arrays, len(points[-1]))
            parts.append(PointLists(sizes, corners + first))
            types.append(own_types)
        first += len(points[-1])
    whole = {name: PointLists(*map(np.concatenate, zip(*parts, strict=True))) for name, parts in cells.items()}
    return DataSet(kind, np.concatenate(points), whole, np.concatenate(types))


def _number_of(piece: Element, name: str) -> int:
    return whole_number(piece.get(f"NumberOf{name}", "0").strip(), f"NumberOf{name}")


def _points(piece: Element, arrays: "_Arrays") -> Any:
    count, found = _number_of(piece, "Points"), piece.find("Points/DataArray")
    points = np.zeros((0, 3)) if found is None or not count else arrays.read(found).reshape(-1, 3)
    check_number(points, count, "points")
    return points


def _cells(piece: Element, name: str, arrays: "_Arrays", points: int) -> tuple[Ints, Ints, Ints]:
    """The sizes, the corners and the types of the cells of a ``piece`` that are called ``name``; ``points``: the number of points
    of the piece. Only the cells of a grid have types.
    """
    count, found = _number_of(piece, name), {one.get("Name"): one for one in piece.findall(f"{name}/DataArray")}
    wanted = ("offsets", "connectivity", *(["types"] if name == "Cells" else []))
    ends, corners, *types = (np.asarray(arrays.read(found[key]) if count else [], np.int64) for key in wanted)
    check_number(ends, count, "offsets")
    for one in types:
        check_number(one, count, "types")
    return *checked_cells(np.diff(ends, prepend=0), corners, points), np.concatenate([ends[:0], *types])


class _Arrays:
    """The arrays of a file with the given ``root`` element. ``appended``: the bytes that follow ``<AppendedData``, if any (the
    rest of this tag and then, after the character ``_``, the data to which arrays refer).
    """

    def __init__(self, root: Element, appended: bytes) -> None:
        self.order = ">" if root.get("byte_order") == "BigEndian" else "<"
        self.header = np.dtype(f"{self.order}u{8 if root.get('header_type') == 'UInt64' else 4}")
        self.compressor = root.get("compressor")
        if self.compressor and self.compressor not in _UNPACKING:
            raise ValueError(f"arrays compressed by {self.compressor[:40]}, which is none of {', '.join(_UNPACKING)}")
        attributes, _, self.appended = appended.partition(b"_")
        self.encoded = b"base64" in attributes

    def read(self, array: Element) -> Any:
        """The values of a DataArray, in one dimension."""
        kind, form, text = _TYPES.get(array.get("type", "")), array.get("format", "ascii"), array.text or ""
        if kind is None:
            raise ValueError(f'an array of type "{array.get("type")}"')
        if form == "ascii":
            return _numbers(text, np.dtype(kind))
        if form == "appended":
            offset = int(array.attrib["offset"])
            if not 0 <= offset <= len(self.appended):
                raise ValueError(f"an array at byte {offset}, outside the {len(self.appended)} bytes of appended data")
            data, encoded = memoryview(self.appended)[offset:], self.encoded
        else:
            data, encoded = memoryview("".join(text.split()).encode("ascii")), True
        return np.frombuffer(self._bytes(data, _decoded if encoded else _taken), self.order + kind)

    def _bytes(self, data: memoryview, take: Callable[[memoryview, int], bytes]) -> bytes:
        """The bytes stored at the beginning of ``data``, after a header with their number or with the lengths of compressed blocks.
        ``take``: a function that returns the first bytes of given data, as many as requested.
        """
        size = self.header.itemsize
        if not self.compressor:
            (count,) = np.frombuffer(take(data, size), self.header).tolist()
            return take(data, size + count)[size:]
        blocks, block, last = np.frombuffer(take(data, 3 * size), self.header).tolist()
        total = (blocks - 1) * block + (last or block) if blocks else 0
        if total > _MOST or blocks * size > len(data):
            raise ValueError(
                f"an array of {total} bytes in {blocks} blocks: too large, or more blocks than fit in the file"
            )
        head = size * (3 + blocks)
        lengths = np.frombuffer(take(data, head), self.header)[3:].tolist()
        packed = take(data[4 * -(-head // 3) if take is _decoded else head :], sum(lengths))
        found, at = bytearray(), 0
        for i, length in enumerate(lengths):
            wanted = last if last and i == blocks - 1 else block
            part = _UNPACKING[self.compressor](packed[at : at + length], wanted)
            if len(part) != wanted:
                raise ValueError(f"a block of {len(part)} bytes in place of {wanted}")
            found += part
            at += length
        return bytes(found)


def _taken(data: memoryview, count: int) -> bytes:
    if count > len(data):
        raise ValueError(f"{len(data)} bytes instead of {count}")
    return bytes(data[:count])


def _decoded(data: memoryview, count: int) -> bytes:
    return _taken(memoryview(base64.b64decode(_taken(data, 4 * -(-count // 3)), validate=True)), count)


def _of_lz4(packed: bytes, wanted: int) -> bytes:
    import pyvista
    from vtkmodules.vtkIOCore import vtkLZ4DataCompressor

    found = bytearray(min(wanted, 256 * len(packed)))  # a byte of LZ4 expands to at most 255 bytes
    with pyvista.vtk_verbosity("off"), pyvista.VtkErrorCatcher(send_to_logging=False):
        return bytes(found[: vtkLZ4DataCompressor().Uncompress(packed, len(packed), found, len(found))])


# Functions that unpack a block to an expected length. If the block is longer, they return one byte more than this length.
_UNPACKING: dict[str, Callable[[bytes, int], bytes]] = {
    "vtkZLibDataCompressor": lambda packed, most: zlib.decompressobj().decompress(packed, most + 1),
    "vtkLZMADataCompressor": lambda packed, most: lzma.LZMADecompressor(memlimit=_MOST).decompress(packed, most + 1),
    "vtkLZ4DataCompressor": _of_lz4,
}


def _numbers(text: str, dtype: np.dtype[Any]) -> Any:
    """The numbers in a ``text``. Raises ValueError if a word is not a number."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype, sep=" ")
        except DeprecationWarning as error:
            raise ValueError("a word that is not a number") from error
