"""Problems: what a muscle, a body and a scalar field share for those who solve and judge them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal, Protocol

import numpy as np

from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh
from fem_reference.foundations.records import Record

# What a solver is asked for: a muscle, a scalar field, or a body of any shape.
Task = Literal["solve", "solve_field", "solve_body"]
# The surface of what has none.
NO_SURFACE = Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


@dataclass(frozen=True, eq=False)
class AtRest:
    """Shapes at rest that frames of a run move, as far as there are any: the ``surface``, the ``fibres``, the tetrahedra of
    ``mesh`` with the unit vector along the fibres in each of them, ``directions`` (m, 3).
    """

    surface: Surface = NO_SURFACE
    fibres: Polylines | None = None
    mesh: TetMesh | None = None
    directions: Floats | None = None


NOTHING = AtRest()


class Problem(Protocol):
    """A problem that a solver is given: a muscle, a body or a scalar field."""

    task: ClassVar[Task]

    @property
    def frames(self) -> Sequence[float]:
        """The frame numbers wanted; at the first of them it is at rest, unless it says otherwise."""

    @property
    def rest(self) -> AtRest:
        """The shapes that frames of it move."""


class Meshed(Problem, Protocol):
    """A problem with its mesh and effects."""

    @property
    def effects(self) -> tuple[Record, ...]:
        """The effects that act."""

    @property
    def mesh_facts(self) -> dict[str, float] | dict[str, float | str]:
        """Size and quality of its mesh, by name."""

    def write_meshes(self, folder: Path, /) -> None:
        """Write what it is solved on into ``folder``, for ParaView."""
