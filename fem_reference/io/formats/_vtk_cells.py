"""The parts of a VTK file that are read: points, and cells as lists of them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Ints


@dataclass(frozen=True, eq=False)
class PointLists:
    """Cells as lists of points, one after the other in ``corners``, each of one of the ``sizes`` (m,)."""

    sizes: Ints
    corners: Ints


@dataclass(frozen=True, eq=False)
class DataSet:
    """A data set of a ``kind``, ``PolyData`` or ``UnstructuredGrid``: ``points`` (n, 3), ``cells`` by the name that the file gives
    them, and the ``types`` (m,) of those of a grid.
    """

    kind: str
    points: Any
    cells: dict[str, PointLists]
    types: Ints = field(default_factory=lambda: np.zeros(0, np.int64))


def checked(sizes: Any, corners: Any, points: int) -> PointLists:
    """Cells of ``sizes`` (m,) in ``corners``; ValueError where one has a negative size, or one that is not there."""
    sizes, corners = np.asarray(sizes, np.int64), np.asarray(corners, np.int64)
    if (sizes < 0).any() or (sizes > len(corners)).any() or sizes.sum() != len(corners):
        raise ValueError(f"cells that do not end in the order of their {len(corners)} corners")
    if len(wrong := np.flatnonzero((corners < 0) | (corners >= points))):
        cell = np.searchsorted(np.cumsum(sizes), wrong[0], side="right")
        raise ValueError(f"cell {cell} with a point that does not exist, of {points}")
    return PointLists(sizes, corners)


def joined(parts: list[DataSet]) -> DataSet:
    """Data sets of one kind as one."""
    before = np.cumsum([0, *(len(part.points) for part in parts)]).tolist()
    cells = {
        name: PointLists(
            np.concatenate([part.cells[name].sizes for part in parts]),
            np.concatenate([part.cells[name].corners + first for part, first in zip(parts, before, strict=False)]),
        )
        for name in parts[0].cells
    }
    points, types = (
        np.concatenate(arrays) for arrays in zip(*((part.points, part.types) for part in parts), strict=True)
    )
    return DataSet(parts[0].kind, points, cells, types)
