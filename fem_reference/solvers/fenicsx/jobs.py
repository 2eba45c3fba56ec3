"""What is passed to the process that solves."""

from dataclasses import dataclass

from fem_reference.continuum import Continuum
from fem_reference.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.settings import BodySettings


@dataclass(frozen=True, eq=False)
class Job:
    """A ``body`` and how to solve it; ``samples``: by name, the cell (n,) of each point and the points (n, 3) at rest whose
    positions are wanted.
    """

    body: Continuum
    settings: BodySettings
    samples: dict[str, tuple[Ints, Floats]]
