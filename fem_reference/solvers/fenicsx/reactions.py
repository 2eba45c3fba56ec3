"""The forces that keep a body where it is: what acts at its boundary, and by how much. Collective."""

import numpy as np
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats
from fem_reference.solvers.fenicsx.boundary_conditions import PrescribedRegion
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.system import System

Forces = dict[str, Floats]


def reactions(system: System, contact: ContactForces | None, *, divided: bool) -> tuple[Forces, Forces]:
    """The force (3,) [N], by name of what is prescribed in a ``system`` and of bones in ``contact``, that keeps it there, and its
    moment (3,) [N mm] about the origin. What an unknown of several regions takes is ``divided`` between them, so that all forces
    are in balance, or counts in each.
    """
    residual, now, comm = system.reactions(), system.unknowns.x.array, system.unknowns.function_space.mesh.comm
    shared = np.zeros(len(now), np.int64)
    for one in system.conditions:
        if divided and isinstance(one, PrescribedRegion):
            shared[one.dofs] += 1
    found = {one.entry.name: one.force(residual, now, shared) for one in system.conditions}
    found |= contact.forces() if contact else {}
    forces = {name: comm.allreduce(force, MPI.SUM) for name, (force, _) in found.items()}
    moments = {name: comm.allreduce(moment, MPI.SUM) for name, (_, moment) in found.items()}
    return forces, moments
