"""What is prescribed on a region: exactly, by conditions on its unknowns, or by springs; and the force that it takes."""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from fem_reference.continuum import Prescribed
from fem_reference.mesh import Floats, Ints


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


class Hold:
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

    def springs(self, measure: Any) -> Any:
        """The weak form of springs that pull towards what is prescribed, 0 where it is exact; ``measure`` is of the region."""
        if self.entry.stiffness is None:
            return 0
        displacement = ufl.split(self.unknowns)[0]
        test = ufl.split(ufl.TestFunction(self.unknowns.function_space))[0]
        stiffness = fem.Constant(self.unknowns.function_space.mesh, float(self.entry.stiffness))
        return sum(
            stiffness * (displacement[entry.component] - entry.values) * test[entry.component] * measure
            for entry in self.components
        )

    def move_to(self, frame: float) -> None:
        """Prescribe what the course gives at ``frame``."""
        for entry in self.components:
            entry.values.x.array[entry.dofs[1]] = self.entry.course(entry.rest, frame)[:, entry.component]

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
