"""The states of a body of any shape that a solver reached."""

from dataclasses import dataclass, field

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record
from fem_reference.problems.body import Body
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Outcome


@dataclass(frozen=True, eq=False)
class Reached:
    """A state of a body at a frame: ``points`` (n, 3) [mm] where the nodes of the mesh are, and by name of what is prescribed the
    ``forces`` (3,) [N] of the constraint, along the prescribed components, and their ``moments`` (3,) [N mm] about the origin (at
    nodes of several regions that prescribe the same component, the force counts in each), and what obstructions exert; ``scalars``:
    min_det_F_quadrature, min_det_F_vertices, volume_ratio, energy [N mm] of what acts inside, newton_iterations, cut_backs; of
    the reference, energy_gap since the frame before (``solvers/fenicsx/path``; of muscles by Simpson's rule where the trapezoid
    leaves much) where all energy is stored, negative_modes and,
    of those, material_modes (``solvers/fenicsx/stability``) where the tangent is symmetric, and of the means over cells
    min_cell_volume_ratio and max_cell_volume_ratio, min_cell_fibre_stretch and max_cell_fibre_stretch where a law has a limit
    on it, and outside_law, in how many cells a law is outside its range; with contact the greatest contact_depth [mm] and
    contact_pressure [MPa] and the contact_area at rest [mm2]; ``state``: the
    unknowns of the cells, where they were asked for; ``residuals``: the norms [N, mm3] before and after each of Newton's iterations
    in the last load step to it.
    """

    frame: float
    points: Floats
    forces: dict[str, Floats]
    moments: dict[str, Floats]
    scalars: dict[str, float] = field(default_factory=dict)
    state: NodalState | None = None
    residuals: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Solved:
    """The states of a body that a solver reached, the rest state first, and how it ended; of which ``body`` and with what
    ``settings``, where error bars may be asked for.
    """

    states: tuple[Reached, ...]
    outcome: Outcome
    body: Body | None = None
    settings: Record | None = None

    @property
    def last(self) -> Reached:
        """The last state; ArithmeticError with the reason where not all were reached."""
        if self.outcome.status != "converged":
            raise ArithmeticError(f"{self.outcome.status}: {self.outcome.message}")
        return self.states[-1]
