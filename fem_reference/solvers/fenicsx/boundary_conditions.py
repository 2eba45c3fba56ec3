"""Boundary conditions, exact or by springs, on the facets of a region, at points of a skin or along tendons, and their forces."""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Prescribed
from fem_reference.solvers.fenicsx.contact_points import ContactPoints
from fem_reference.solvers.fenicsx.forms import Form
from fem_reference.solvers.fenicsx.meshes import Displacement


class PrescribedRegion:
    """A ``Prescribed`` condition on the ``displacement`` of a region; ``facets``: the facets of the region on this rank."""

    def __init__(self, displacement: Displacement, entry: Prescribed, facets: Ints) -> None:
        self.entry, self.unknowns, self.along = entry, displacement.unknowns, list(entry.components)
        self.nodes = fem.locate_dofs_topological(displacement.space, 2, facets)
        self.rest: Floats = displacement.space.tabulate_dof_coordinates()[self.nodes]
        self.all = displacement.dofs[self.nodes]  # the unknowns (m, 3) of the nodes
        self.dofs: Ints = np.ravel(self.all[:, self.along])  # the unknowns that are prescribed, exactly or by springs
        self.exact = self.dofs if entry.stiffness is None else np.zeros(0, np.int64)
        self.wanted = fem.Function(displacement.space)
        self.extension = np.zeros_like(self.rest)

    @property
    def prescribed(self) -> Floats:
        """The current prescribed values (n,) of the unknowns ``dofs``."""
        return np.ravel(np.reshape(self.wanted.x.array, (-1, 3))[self.nodes][:, self.along])

    def springs(self, form: Form) -> Any:
        """The weak form of the springs that pull towards the prescribed displacement; 0 if the condition is exact."""
        if self.entry.stiffness is None:
            return 0
        measure = form.measure(str(self.entry.on))
        displacement = ufl.split(self.unknowns)[0]
        test = ufl.split(ufl.TestFunction(self.unknowns.function_space))[0]
        stiffness = fem.Constant(self.unknowns.function_space.mesh, float(self.entry.stiffness))
        return sum(stiffness * (displacement[i] - self.wanted[i]) * test[i] * measure for i in self.along)

    def move_to(self, frame: float) -> None:
        """Prescribe the displacement that the path has at ``frame``."""
        ends = self.rest - self.extension
        self.wanted.x.array.reshape(-1, 3)[self.nodes] = self.entry.path(ends, frame) - self.extension

    def extend(self, response: Floats) -> None:
        """Extend the springs at rest: move their prescribed ends back by the ``response`` (n,) of the unknowns."""
        if self.entry.stiffness is not None:
            self.extension = np.where(np.isin(np.arange(3), self.along), response[self.all], 0.0)
            self.wanted.x.array.reshape(-1, 3)[self.nodes] = -self.extension

    def force(self, residual: Floats, now: Floats, shared: Ints) -> tuple[Floats, Floats]:
        """The force (3,) [N] on this rank's part of the region, and its moment (3,) [N mm] about the origin.

        ``residual`` (n,): the residual of the effects in the body; ``now`` (n,): the current unknowns; ``shared`` (n,): the number
        of regions that prescribe each unknown. These regions divide the force at the unknown equally.
        """
        places, forces = self.rest + now[self.all], np.zeros_like(self.rest)
        forces[:, self.along] = (residual[self.all] / np.maximum(shared[self.all], 1))[:, self.along]
        index_map = self.unknowns.function_space.dofmap.index_map
        forces[self.all >= index_map.size_local * self.unknowns.function_space.dofmap.index_map_bs] = (
            0  # of other ranks
        )
        return forces.sum(axis=0), np.cross(places, forces).sum(axis=0)


class PointSprings:
    """A ``Prescribed`` condition by springs at ``points`` in this rank's cells. It is never exact, as points have no unknowns."""

    exact: Ints = np.zeros(0, np.int64)

    def __init__(self, unknowns: fem.Function, entry: Prescribed, points: ContactPoints) -> None:
        assert entry.stiffness is not None  # body.check ensures it
        self.entry, self.unknowns, self.points = entry, unknowns, points
        self.along = along = np.isin(np.arange(3), entry.components)
        self.stiffness = entry.stiffness * points.areas[:, None] * along  # [N/mm]
        self.ends = self.wanted = np.array(points.rest)  # the other ends of the springs, at rest

    @property
    def prescribed(self) -> Floats:
        """The current targets (3 n,) [mm] of the points."""
        return self.wanted.ravel()

    def move_to(self, frame: float) -> None:
        """Prescribe the displacement that the path has at ``frame``."""
        self.wanted = self.ends + self.entry.path(self.ends, frame)

    def extend(self, response: Floats) -> None:
        """Extend the springs at rest, as ``PrescribedRegion.extend`` does."""
        self.ends = self.wanted = self.points.rest - self.along * (self.points.positions(response) - self.points.rest)

    def add_residual(self, residual: Floats, moves: Floats | None) -> None:
        """Add the spring forces to ``residual`` (n,) over this rank's unknowns, at the unknowns plus ``moves`` (n,) if given."""
        now = self.unknowns.x.array
        self.points.add_forces(residual, self._pulls(now if moves is None else now + moves))

    def tangent(self) -> tuple[Ints, Floats, Floats]:
        """The derivative of the residual, as in ``ContactForces.tangent``."""
        return self.points.cells, self.points.basis, self.stiffness[:, :, None] * np.eye(3)

    def force(self, _residual: Floats, now: Floats, _shared: Ints) -> tuple[Floats, Floats]:
        """The force of the springs and its moment, as in ``PrescribedRegion.force``."""
        pulls = -self._pulls(now)
        return pulls.sum(axis=0), np.cross(self.points.positions(now), pulls).sum(axis=0)

    def _pulls(self, unknowns: Floats) -> Floats:
        """The forces (n, 3) [N] that the points exert on the springs."""
        return self.stiffness * (self.points.positions(unknowns) - self.wanted)


class Tendons(PointSprings):
    """Straight lines from ``points`` in this rank's cells to the anchor of a ``Prescribed`` condition; the anchor moves along the
    path of the condition. A taut line pulls with its stiffness times its extension ``l - l0``; a slack line exerts no force.
    """

    def __init__(self, unknowns: fem.Function, entry: Prescribed, points: ContactPoints) -> None:
        super().__init__(unknowns, entry, points)
        self.ends = self.wanted = np.array([entry.anchor])
        self.lengths = np.linalg.norm(points.rest - self.ends, axis=1)  # at rest

    def extend(self, response: Floats) -> None:
        """Do nothing: no tendon is taut at rest."""

    def tangent(self) -> tuple[Ints, Floats, Floats]:
        """``k n n^T + k (l - l0) / l (1 - n n^T)`` for a taut line with direction n, 0 for a slack line."""
        along, length, tension = self._lines(self.unknowns.x.array)
        straight = along[:, :, None] * along[:, None, :]
        taut = np.where(length >= self.lengths, self.stiffness[:, 0], 0.0)[:, None, None]
        slope = taut * straight + (tension / length)[:, None, None] * (np.eye(3) - straight)
        return self.points.cells, self.points.basis, slope

    def _pulls(self, unknowns: Floats) -> Floats:
        along, _, tension = self._lines(unknowns)
        return tension[:, None] * along

    def _lines(self, unknowns: Floats) -> tuple[Floats, Floats, Floats]:
        """The directions (n, 3) of the lines away from the anchor, their lengths (n,) [mm] and their tensions (n,) [N]."""
        lines = self.points.positions(unknowns) - self.wanted
        length = np.linalg.norm(lines, axis=1)
        return lines / length[:, None], length, self.stiffness[:, 0] * np.maximum(length - self.lengths, 0.0)
