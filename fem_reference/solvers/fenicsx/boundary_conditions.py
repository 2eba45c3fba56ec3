"""Boundary conditions on a region, exact or by springs over its facets or at points of a skin, and their reaction forces."""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Prescribed
from fem_reference.solvers.fenicsx.contact_points import ContactPoints
from fem_reference.solvers.fenicsx.forms import Form


class _Component:
    """One component of the displacement on a region: its unknowns, where they are at rest, and the values they shall have."""

    def __init__(self, unknowns: fem.Function, component: int, facets: Ints) -> None:
        whole = unknowns.function_space.sub(0).sub(component)
        space, _ = whole.collapse()
        self.component = component
        self.dofs = fem.locate_dofs_topological((whole, space), 2, facets)
        self.values = fem.Function(space)
        self.rest: Floats = space.tabulate_dof_coordinates()[self.dofs[1]]
        owned = whole.dofmap.index_map.size_local * whole.dofmap.index_map_bs
        self.own = self.dofs[0] < owned


class PrescribedRegion:
    """A ``Prescribed`` on this rank's ``facets``."""

    def __init__(self, unknowns: fem.Function, entry: Prescribed, facets: Ints) -> None:
        self.entry, self.unknowns = entry, unknowns
        # All three of the nodes, for where the forces act now, and those that are prescribed.
        self.all = [_Component(unknowns, component, facets) for component in range(3)]
        self.components = [self.all[component] for component in entry.components]

    @property
    def exact(self) -> Ints:
        """The unknowns (n,) that are prescribed exactly: none by springs."""
        if self.entry.stiffness is not None:
            return np.zeros(0, np.int64)
        return np.concatenate([component.dofs[0] for component in self.components]).astype(np.int64)

    @property
    def targets(self) -> Floats:
        """What (n,) the unknowns ``exact`` shall be."""
        if self.entry.stiffness is not None:
            return np.zeros(0)
        return np.concatenate([component.values.x.array[component.dofs[1]] for component in self.components])

    def springs(self, form: Form) -> Any:
        """The weak form of springs that pull towards what is prescribed, 0 where it is exact."""
        if self.entry.stiffness is None:
            return 0
        measure = form.measure(str(self.entry.on))
        displacement = ufl.split(self.unknowns)[0]
        test = ufl.split(ufl.TestFunction(self.unknowns.function_space))[0]
        stiffness = fem.Constant(self.unknowns.function_space.mesh, float(self.entry.stiffness))
        return sum(
            stiffness * (displacement[entry.component] - entry.values) * test[entry.component] * measure
            for entry in self.components
        )

    @property
    def prescribed(self) -> Floats:
        """All numbers (n,) that are prescribed now."""
        return np.concatenate([entry.values.x.array for entry in self.components])

    def move_to(self, frame: float) -> None:
        """Prescribe the displacement of the path at ``frame``."""
        for entry in self.components:
            entry.values.x.array[entry.dofs[1]] = self.entry.path(entry.rest, frame)[:, entry.component]

    def force(self, residual: Floats, now: Floats, shared: Ints) -> tuple[Floats, Floats]:
        """The force (3,) [N] and its moment (3,) [N mm] about the origin that this rank's part of the region takes, from the
        out-of-balance ``residual`` of what acts in the body and the unknowns ``now``. Of an unknown that several regions prescribe
        each takes an equal part: ``shared`` (n,) says how many do.
        """
        places = np.stack([entry.rest[:, i] + now[entry.dofs[0]] for i, entry in enumerate(self.all)], axis=1)
        forces = np.zeros_like(places)
        for entry in self.components:
            own = entry.dofs[0][entry.own]
            forces[entry.own, entry.component] = residual[own] / shared[own]
        return forces.sum(axis=0), np.cross(places, forces).sum(axis=0)


class PointSprings:
    """A ``Prescribed`` by springs at the ``points`` of this rank's cells: they are not unknowns, so that none is exact."""

    exact: Ints = np.zeros(0, np.int64)
    targets: Floats = np.zeros(0)

    def __init__(self, unknowns: fem.Function, entry: Prescribed, points: ContactPoints) -> None:
        assert entry.stiffness is not None  # body.check
        self.entry, self.unknowns, self.points = entry, unknowns, points
        along = np.isin(np.arange(3), entry.components)
        self.stiffness = entry.stiffness * points.areas[:, None] * along  # [N/mm]
        self.wanted = np.array(points.rest)

    @property
    def prescribed(self) -> Floats:
        """Where (3 n,) the points shall be now [mm]."""
        return self.wanted.ravel()

    def move_to(self, frame: float) -> None:
        """Prescribe the displacement of the path at ``frame``."""
        self.wanted = self.points.rest + self.entry.path(self.points.rest, frame)

    def add_residual(self, residual: Floats, moves: Floats | None) -> None:
        """Add what pulls to ``residual`` over this rank's unknowns; as if the unknowns had made ``moves`` (n,), where given."""
        now = self.unknowns.x.array
        self.points.add_forces(residual, self._pulls(now if moves is None else now + moves))

    def tangent(self) -> tuple[Ints, Floats, Floats]:
        """The slope of the residual, as ``ContactForces.tangent`` has it."""
        return self.points.cells, self.points.basis, self.stiffness[:, :, None] * np.eye(3)

    def force(self, _residual: Floats, now: Floats, _shared: Ints) -> tuple[Floats, Floats]:
        """As ``PrescribedRegion.force``: of springs, it is what they pull with."""
        pulls = -self._pulls(now)
        return pulls.sum(axis=0), np.cross(self.points.positions(now), pulls).sum(axis=0)

    def _pulls(self, unknowns: Floats) -> Floats:
        """The forces (n, 3) [N] of the points on the springs."""
        return self.stiffness * (self.points.positions(unknowns) - self.wanted)
