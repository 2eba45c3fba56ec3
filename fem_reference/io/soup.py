"""Points, triangles and lines as readers of any format return them: checks that they all share."""

import re
from collections import Counter
from typing import Any, NamedTuple

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints

Soup = tuple[Any, Any]
Lines = tuple[Floats, list[list[int]]]


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


def check_lengths(read: Lines) -> Lines:
    """The points (n, 3) and lines that were ``read``; ValueError where a point is not finite or a line has no length."""
    points, lines = read
    bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(bad):
        raise ValueError(f"a point that is not finite (point {bad[0]})")
    for number, line in enumerate(lines):
        if (points[line] == points[line[0]]).all():
            raise ValueError(f"line {number} of zero length")
    return read


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


def positions(rows: list[list[float]]) -> Any:
    """Points (n, 3) of as many ``rows``; ValueError where one has fewer coordinates."""
    if any(len(row) != 3 for row in rows):
        raise ValueError("a position of fewer than three coordinates")
    return np.array(rows)


def rows(points: Floats) -> list[str]:
    """One text a point (n, 3), in as many digits as bring the same float back."""
    return [f"{x!r} {y!r} {z!r}" for x, y, z in np.asarray(points).tolist()]


def of_meshio(points: Any, blocks: Any) -> Soup:
    """Points and triangles from the cell ``blocks`` of meshio; points and lines are passed over."""
    if other := {block.type for block in blocks} - {"triangle", "line", "vertex"}:
        raise ValueError(f"cells of type {', '.join(sorted(other))}")
    triangles = [block.data for block in blocks if block.type == "triangle"]
    return points, np.concatenate([np.empty((0, 3), np.int64), *triangles])


class PointLists(NamedTuple):
    """Cells as lists of points: ``sizes`` (m,), and the points of all, one after the other, in ``corners``."""

    sizes: Ints
    corners: Ints


class DataSet(NamedTuple):
    """A data set of a ``kind``, ``PolyData`` or ``UnstructuredGrid``: ``points`` (n, 3), ``cells`` by the name that XML files give
    them, and the ``types`` (m,) of those of a grid.
    """

    kind: str
    points: Any
    cells: dict[str, PointLists]
    types: Any


def checked_cells(sizes: Any, corners: Any, points: int) -> PointLists:
    """Cells of ``sizes`` (m,) in ``corners``; ValueError where one has a negative size or a point that does not exist."""
    sizes, corners = np.asarray(sizes, np.int64), np.asarray(corners, np.int64)
    if (sizes < 0).any() or (sizes > len(corners)).any() or sizes.sum() != len(corners):
        raise ValueError(f"cells that do not fit in their {len(corners)} corners")
    if len(wrong := np.flatnonzero((corners < 0) | (corners >= points))):
        cell = np.searchsorted(np.cumsum(sizes), wrong[0], side="right")
        raise ValueError(f"cell {cell} with a point that does not exist, of {points}")
    return PointLists(sizes, corners)


def whole_number(text: str, name: str) -> int:
    """The number that a text states; ValueError with its ``name`` where it is none of 1 to 18 digits."""
    if not re.fullmatch(r"\d{1,18}", text, re.ASCII):
        raise ValueError(f'{name} of "{text[:40]}"')
    return int(text)


def check_number(values: Any, count: int, name: str) -> None:
    """ValueError where there are not ``count`` values of this ``name``."""
    if len(values) != count:
        raise ValueError(f"{len(values)} {name} of {count}")
