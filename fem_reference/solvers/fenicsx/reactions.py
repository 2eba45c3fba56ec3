"""The reaction forces of a body: at its constraints and on its bones. Collective."""

import numpy as np
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats
from fem_reference.solvers.fenicsx.boundary_conditions import PrescribedRegion
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.system import System

Forces = dict[str, Floats]


def reactions(system: System, contact: ContactForces | None, *, divided: bool) -> tuple[Forces, Forces]:
    """By name of each constraint in a ``system`` and of each bone in ``contact``, the force (3,) [N] on the body and its moment
    (3,) [N mm] about the origin. The force at an unknown of several regions is ``divided`` between them, so that all forces
    balance, or counts in each.
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
