"""Points, triangles and lines as the readers of all formats return them, and the checks that these readers share."""

import re
from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints

Soup = tuple[Any, Any]


def arrays(soup: Soup) -> tuple[Floats, Ints]:
    """Points (n, 3) and triangles (m, 3) as arrays. Raises ValueError or OverflowError if ``soup`` has other shapes."""
    points, corners = (np.asarray(values) for values in soup)
    if len(corners) == 0:
        raise ValueError("no triangles")
    if len(points) == 0:
        raise ValueError("no vertices")
    if points.shape != (len(points), 3):
        raise ValueError(f"points of shape {points.shape}")
    with np.errstate(invalid="ignore"):  # NaN becomes an arbitrary integer, which the comparison below detects
        triangles = np.asarray(soup[1], np.int64)
    if triangles.shape != (len(triangles), 3) or (triangles != corners).any():
        raise ValueError(f"corners of shape {corners.shape} that are not three point numbers each")
    return points.astype(np.float64), triangles


def check_lengths(points: Floats, lines: list[list[int]]) -> None:
    """Raise ValueError if a point of ``points`` (n, 3) is not finite, or if one of the ``lines`` between them has no length."""
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ValueError(f"a point that is not finite (point {bad[0]})")
    for number, line in enumerate(lines):
        if (points[line] == points[line[0]]).all():
            raise ValueError(f"line {number} of zero length")


def joined(cells: list[list[int]]) -> list[list[int]]:
    """Lines of point numbers. Cells are joined at each point where exactly one cell ends and exactly one cell begins."""
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
        raise ValueError("lines that form a closed ring")
    return lines


def only_triangles(corners: set[int]) -> None:
    """Raise ValueError if one of the numbers of ``corners`` is not three."""
    if other := corners - {3}:
        raise ValueError(f"a polygon with {min(other)} corners")


def positions(rows: list[list[float]]) -> Any:
    """Points (n, 3) from n ``rows`` of coordinates. Raises ValueError if a row does not have three."""
    if any(len(row) != 3 for row in rows):
        raise ValueError("a position with fewer than three coordinates")
    return np.array(rows)


def rows(points: Floats) -> list[str]:
    """A line of text for each of ``points`` (n, 3), with enough digits to read the same floats again."""
    return [f"{x!r} {y!r} {z!r}" for x, y, z in np.asarray(points).tolist()]


def of_meshio(points: Any, blocks: Any) -> Soup:
    """Points and triangles from the cell ``blocks`` of meshio; vertex and line cells are skipped."""
    if other := {block.type for block in blocks} - {"triangle", "line", "vertex"}:
        raise ValueError(f"cells of type {', '.join(sorted(other))}")
    triangles = [block.data for block in blocks if block.type == "triangle"]
    return points, np.concatenate([np.empty((0, 3), np.int64), *triangles])


class PointLists(NamedTuple):
    """Cells as lists of points: the ``sizes`` (m,) of the cells, and the points of all cells in sequence (``corners``)."""

    sizes: Ints
    corners: Ints


class DataSet(NamedTuple):
    """A VTK data set of a ``kind``, ``PolyData`` or ``UnstructuredGrid``. ``points``: (n, 3). ``cells``: by the name that they have
    in XML files. ``types`` (m,): the types of the cells of a grid.
    """

    kind: str
    points: Any
    cells: dict[str, PointLists]
    types: Any


def checked_cells(sizes: Any, corners: Any, points: int) -> PointLists:
    """Cells of ``sizes`` (m,) with their points in ``corners``. ``points``: the number of existing points. Raises ValueError if a
    size is negative, if the sizes do not fit the corners, or if a cell has a point that does not exist.
    """
    sizes, corners = np.asarray(sizes, np.int64), np.asarray(corners, np.int64)
    if (sizes < 0).any() or (sizes > len(corners)).any() or sizes.sum() != len(corners):
        raise ValueError(f"cells whose sizes are negative or do not add up to {len(corners)} corners")
    if len(wrong := np.flatnonzero((corners < 0) | (corners >= points))):
        cell = np.searchsorted(np.cumsum(sizes), wrong[0], side="right")
        raise ValueError(f"cell {cell} with a point outside 0 to {points - 1}")
    return PointLists(sizes, corners)


def whole_number(text: str, name: str) -> int:
    """The number in a ``text``. Raises ValueError, with the ``name`` of the number, unless the text consists of 1 to 18 digits."""
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise ValueError(f'{name} of "{text[:40]}"')
    return int(text)


def check_number(values: Any, count: int, name: str) -> None:
    """Raise ValueError unless there are ``count`` values; the message calls them ``name``."""
    if len(values) != count:
        raise ValueError(f"{len(values)} {name} instead of {count}")
