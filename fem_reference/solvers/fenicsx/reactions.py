"""The forces that keep a body where it is: what acts at its boundary, and by how much. Collective."""

from functools import cached_property

import numpy as np
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx.boundary_conditions import PointSprings, PrescribedRegion
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.system import System

Forces = dict[str, Floats]


class Reactions:
    """The forces of the ``conditions`` of a ``system`` and of ``contact``, where there is some."""

    def __init__(
        self, system: System, conditions: list[PrescribedRegion | PointSprings], contact: ContactForces | None
    ) -> None:
        self.system, self.conditions, self.contact = system, conditions, contact

    def now(self, *, divided: bool) -> tuple[Forces, Forces]:
        """The force (3,) [N], by name of what is prescribed, that keeps it there and its moment (3,) [N mm] about the origin. What
        an unknown of several regions takes is ``divided`` between them, so that all forces are in balance, or counts in each.
        """
        balance, now = self.system.reactions(), np.array(self.system.unknowns.x.array)
        shared = self._shared if divided else np.ones(len(now), np.int64)
        found = {one.entry.name: one.force(balance, now, shared) for one in self.conditions}
        found |= self.contact.forces() if self.contact else {}
        comm = self.system.unknowns.function_space.mesh.comm
        forces = {name: comm.allreduce(force, MPI.SUM) for name, (force, _) in found.items()}
        moments = {name: comm.allreduce(moment, MPI.SUM) for name, (_, moment) in found.items()}
        return forces, moments

    @cached_property
    def _shared(self) -> Ints:
        """The number of regions (n,) that prescribe each unknown."""
        count = np.zeros(len(self.system.unknowns.x.array), np.int64)
        for one in self.conditions:
            if isinstance(one, PrescribedRegion):
                count[one.dofs] += 1
        return count
