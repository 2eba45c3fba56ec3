"""The attributes that all problems have in common, for muscles, bodies and scalar fields."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol

import numpy as np

from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh

# The names of the solver functions for the three kinds of problem: muscles, a scalar field, or a body of any shape.
Task = Literal["solve", "solve_field", "solve_body"]
# The empty surface of a problem that has none.
NO_SURFACE = Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


@dataclass(frozen=True, eq=False)
class AtRest:
    """The shapes at rest whose positions the frames of a run contain: the ``surface``, and if they exist, the ``fibres`` and the
    tetrahedra of ``mesh``. ``directions`` (m, 3): the unit vector along the fibres in each tetrahedron.
    """

    surface: Surface = NO_SURFACE
    fibres: Polylines | None = None
    mesh: TetMesh | None = None
    directions: Floats | None = None


NOTHING = AtRest()


class Problem(Protocol):
    """A problem for a solver: a muscle, a body or a scalar field."""

    task: ClassVar[Task]

    @property
    def frames(self) -> Sequence[float]:
        """The requested frame numbers; at the first frame the problem is at rest, unless it states otherwise."""

    @property
    def rest(self) -> AtRest:
        """The rest state of everything whose positions a frame contains."""
