"""How much a VTK file says it holds, before VTK, which is native code, takes memory for it.

VTK believes what a file says: counts that the file has no bytes for make it take all memory, loop for ever or end the process.
"""

import base64
import re
import struct
from collections.abc import Iterator
from itertools import islice

from fem_reference.io.references import check_no_entities

# The most bytes that the arrays of a compressed file may have in all.
_MOST = 2**28
# How many times fewer bytes a compressed file may have than its arrays: zlib reaches 1030.
_DENSEST = 1100
_COUNT = re.compile(rb'\bNumberOf(?:Points|Cells|Verts|Lines|Strips|Polys|Tuples)\s*=\s*["\']\s*([^"\']*)["\']')
_COMPONENTS = re.compile(rb'\bNumberOfComponents\s*=\s*["\']\s*([^"\']*)["\']')
_ARRAY = re.compile(rb"<DataArray\b([^<>]*)>\s*([A-Za-z0-9+/=]{0,64})")
_OFFSET = re.compile(rb'\boffset\s*=\s*["\'](\d{1,19})["\']')
_LEGACY = re.compile(
    rb"^[ \t]*(?:POINTS|CELLS|CELL_TYPES|POLYGONS|LINES|VERTICES|TRIANGLE_STRIPS|POINT_DATA|CELL_DATA|LOOKUP_TABLE|FIELD|DIMENSIONS"
    rb"|OFFSETS|CONNECTIVITY|SCALARS|METADATA|[XYZ]_COORDINATES|COLOR_SCALARS|TEXTURE_COORDINATES)\b([^\n]*)$",
    re.MULTILINE | re.IGNORECASE,
)


def check_sizes(data: bytes, *, xml: bool) -> None:
    """ValueError where the bytes of a VTK file cannot hold what they say that they hold."""
    if not xml:
        _check_legacy(data)
        return
    head, _, appended = data.partition(b"<AppendedData")
    check_no_entities(head)
    compressed = re.search(rb"<VTKFile[^<>]*\bcompressor\s*=", head) is not None
    most = min(_MOST, _DENSEST * len(data)) if compressed else len(data)
    values = sum(_counts(_COUNT, head)) * max([3, *_counts(_COMPONENTS, head)])
    # Each value takes a byte at least; nine: the offsets, the types and the points of as many cells.
    if values > 9 * most + 1000:
        raise ValueError(f"{values} numbers said to be in {len(data)} bytes")
    if compressed:
        _check_blocks(head, appended, most)


def _counts(pattern: re.Pattern[bytes], text: bytes) -> Iterator[int]:
    for found in pattern.finditer(text):
        if not re.fullmatch(rb"\d{1,18}\s*", found[1]):
            raise ValueError(f"a count of {found[1][:20]!r}")
        yield int(found[1])


def _check_legacy(data: bytes) -> None:
    numbers = (
        int(word) for found in _LEGACY.finditer(data) for word in re.findall(rb"(?<![\w.-])\d{1,30}(?![\w.])", found[1])
    )
    for number in numbers:
        if number > len(data):
            raise ValueError(f"{number} entries said to be in {len(data)} bytes")


def _check_blocks(head: bytes, appended: bytes, most: int) -> None:
    """ValueError where the blocks of compressed arrays are said to be longer than ``most`` bytes in all."""
    wide = re.search(rb"""<VTKFile[^<>]*\bheader_type\s*=\s*["']UInt64""", head) is not None
    order = ">" if re.search(rb"""<VTKFile[^<>]*\bbyte_order\s*=\s*["']BigEndian""", head) else "<"
    size = 24 if wide else 12
    begin = appended.find(b"_") + 1
    encoded = b"base64" in appended[:begin]
    total = 0
    for attributes, inline in islice(_ARRAY.findall(head), 10_000):
        at = _OFFSET.search(attributes)
        if at is not None:
            start = begin + int(at[1])
            first = base64.b64decode(appended[start : start + 32]) if encoded else appended[start : start + size]
        elif b"binary" in attributes:
            first = base64.b64decode(inline[:32])
        else:
            continue
        if len(first) < size:
            raise ValueError("an array that ends in its first bytes")
        blocks, block, _last = struct.unpack(f"{order}3{'Q' if wide else 'I'}", first[:size])
        total += blocks * (block + size)
    if total > most:
        raise ValueError(f"arrays said to have {total} bytes, which are more than {most}")
