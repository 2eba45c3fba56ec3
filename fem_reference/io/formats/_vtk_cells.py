"""What is read of a VTK file: points, and cells as lists of them."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Ints


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of points: ``offsets`` (m + 1,), from 0, into ``corners``."""

    offsets: Ints
    corners: Ints

    @property
    def sizes(self) -> set[int]:
        """How many points cells have."""
        return set(np.unique(np.diff(self.offsets)).tolist())


@dataclass(frozen=True, eq=False)
class DataSet:
    """A data set of a ``kind``, ``PolyData`` or ``UnstructuredGrid``: ``points`` (n, 3) and ``cells`` by what the file calls them;
    ``types`` (m,) of those of a grid.
    """

    kind: str
    points: Any
    cells: dict[str, Cells]
    types: Ints = field(default_factory=lambda: np.zeros(0, np.int64))


def checked(ends: Any, corners: Any, points: int) -> Cells:
    """Cells that end at ``ends`` (m,) in ``corners``; ValueError where one goes back or has a point that is not there."""
    offsets = np.concatenate([[0], np.asarray(ends, np.int64)])
    corners = np.asarray(corners, np.int64)
    if (np.diff(offsets) < 0).any() or offsets[-1] != len(corners):
        raise ValueError(f"cells that do not end in the order of their {len(corners)} corners")
    if len(wrong := np.flatnonzero((corners < 0) | (corners >= points))):
        cell = np.searchsorted(offsets, wrong[0], side="right") - 1
        raise ValueError(f"cell {cell} with a point that does not exist, of {points}")
    return Cells(offsets, corners)


def joined(parts: list[DataSet]) -> DataSet:
    """Data sets of one kind as one."""
    first = parts[0]
    if len(parts) == 1:
        return first
    before = np.cumsum([0, *(len(part.points) for part in parts)])
    cells = {
        name: checked(
            np.concatenate(
                [
                    part.cells[name].offsets[1:] + sum(len(other.cells[name].corners) for other in parts[:i])
                    for i, part in enumerate(parts)
                ]
            ),
            np.concatenate([part.cells[name].corners + before[i] for i, part in enumerate(parts)]),
            int(before[-1]),
        )
        for name in first.cells
    }
    points = np.concatenate([part.points for part in parts])
    return DataSet(first.kind, points, cells, np.concatenate([part.types for part in parts]))
