"""Named pieces of geometry with arrays on them, which are written into one file and move together."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from fem_reference.foundations.mesh import Floats, Ints, Polylines


@dataclass(frozen=True, eq=False)
class Block:
    """``cells`` between ``points`` (n, 3) [mm]: triangles (m, 3), tetrahedra (m, 4) or lines; by name arrays ``of_points``
    (n, ...), ``of_cells`` (m, ...), and ``numbers`` that are one for all of it.
    """

    points: Floats
    cells: Ints | Polylines
    of_points: dict[str, Floats] = field(default_factory=dict)
    of_cells: dict[str, Floats] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)


type Tree = Mapping[str, "Block | Tree"]
