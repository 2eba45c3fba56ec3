"""Rigid bodies that push on a region: pressure of the gap at the quadrature points of its facets, with its tangent."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NonlinearProblem, assign
from mpi4py import MPI
from numpy.typing import NDArray

from fem_reference.contact import Contact, Obstruction
from fem_reference.continuum import Continuum
from fem_reference.mesh import Floats, Ints
from fem_reference.solvers.fenicsx import compiling


@dataclass(frozen=True, eq=False)
class Push:
    """What one obstruction does at n ``points`` (n, 3) [mm]: ``depth`` (n,) [mm], negative outside, ``pressure`` (n,) [MPa per
    rest area], ``traction`` (n, 3) and its ``slope`` (n, 3, 3) [MPa/mm].
    """

    points: Floats
    depth: Floats
    pressure: Floats
    traction: Floats
    slope: Floats


def push(law: Contact, obstruction: Obstruction, points: Floats, frame: float) -> Push:
    """What ``obstruction`` does, where it is at ``frame``, to the ``points`` (n, 3) [mm]."""
    pose = obstruction.pose(frame)
    turn = pose[:3, :3]
    sampled = obstruction.shape.sample((points - pose[:3, 3]) @ turn)
    pressure, change = law.pressure(sampled.distance)
    normal, curvature = sampled.gradient @ turn.T, turn @ sampled.curvature @ turn.T
    slope = change[:, None, None] * normal[:, :, None] * normal[:, None, :] + pressure[:, None, None] * curvature
    return Push(points, -sampled.distance, pressure, pressure[:, None] * normal, slope)


class Pushes:
    """What obstructions do on this rank's ``facets``: their traction and its slope at the quadrature points, as functions on the
    facets that the weak form integrates; to be brought up to date before each assembly.
    """

    def __init__(self, body: Continuum, law: Contact, unknowns: fem.Function, facets: Ints, degree: int) -> None:
        """``degree`` of the rule on facets."""
        self.obstructions, self.law, self.mesh = body.obstructions, law, unknowns.function_space.mesh
        self.facets, self.map = mesh.create_submesh(self.mesh, 2, facets)[:2]
        cell = "triangle" if body.mesh.kind == "tetrahedron" else "quadrilateral"
        number, vector, tensor = (
            fem.functionspace(self.facets, basix.ufl.quadrature_element(cell, value_shape=(3,) * rank, degree=degree))
            for rank in range(3)
        )
        self.traction, self.slope = fem.Function(vector), fem.Function(tensor)
        rule = ufl.Measure("dx", domain=self.facets, metadata={"quadrature_degree": degree})
        self.areas: Floats = np.asarray(fem.assemble_vector(compiling.form(ufl.TestFunction(number) * rule)).array)
        points = basix.make_quadrature(basix.CellType[cell], degree)[0]
        self.now = compiling.expression(ufl.SpatialCoordinate(self.mesh) + ufl.split(unknowns)[0], points)
        self.sides = self._sides()
        self.last: dict[str, Push] = {}

    def _sides(self) -> NDArray[np.int32]:
        """Of each facet: a cell that it bounds, and which of the cell's facets it is, (f, 2)."""
        topology, own = self.mesh.topology, self.facets.topology.index_map(2)
        count = own.size_local + own.num_ghosts
        numbers = self.map.sub_topology_to_topology(np.arange(count, dtype=np.int32), inverse=False)
        cells, facets = topology.connectivity(2, 3), topology.connectivity(3, 2)
        sides = [(cells.links(facet)[0], facet) for facet in numbers]
        found = [(cell, int(np.flatnonzero(facets.links(cell) == facet)[0])) for cell, facet in sides]
        return np.array(found, np.int32).reshape(-1, 2)

    def residual(self, test: Any, measure: Any) -> Any:
        """The weak form of the traction."""
        return -ufl.dot(self.traction, test) * measure

    def tangent(self, step: Any, test: Any, measure: Any) -> Any:
        """Its slope along a displacement ``step``."""
        return -ufl.dot(self.slope * step, test) * measure

    def update(self, frame: float) -> None:
        """Traction and slope with the unknowns as they are and the obstructions where they are at ``frame``."""
        if len(self.sides) == 0:
            return
        points = self.now.eval(self.mesh, self.sides).reshape(-1, 3)
        self.last = {entry.name: push(self.law, entry, points, frame) for entry in self.obstructions}
        self.traction.x.array[:] = np.sum([one.traction for one in self.last.values()], axis=0).ravel()
        self.slope.x.array[:] = np.sum([one.slope for one in self.last.values()], axis=0).ravel()

    def forces(self) -> dict[str, tuple[Floats, Floats]]:
        """By name of an obstruction, the force (3,) [N] that it exerts on this rank's facets and its moment (3,) [N mm] about the
        origin.
        """
        found = {entry.name: (np.zeros(3), np.zeros(3)) for entry in self.obstructions}
        for name, one in self.last.items():
            forces = self.areas[:, None] * one.traction[: len(self.areas)]
            found[name] = forces.sum(axis=0), np.cross(one.points[: len(self.areas)], forces).sum(axis=0)
        return found

    def scalars(self, comm: MPI.Comm) -> dict[str, float]:
        """The deepest ``penetration`` [mm] and largest ``contact_pressure`` [MPa] at a quadrature point, and the rest area that is
        pushed, ``contact_area`` [mm2].
        """
        pushed = np.zeros(len(self.areas), bool)
        depth = pressure = 0.0
        for one in self.last.values():
            pushed |= one.pressure[: len(self.areas)] > 0
            depth, pressure = max(depth, float(one.depth.max())), max(pressure, float(one.pressure.max()))
        return {
            "penetration": comm.allreduce(depth, MPI.MAX),
            "contact_pressure": comm.allreduce(pressure, MPI.MAX),
            "contact_area": comm.allreduce(float(self.areas[pushed].sum()), MPI.SUM),
        }


def watch(problem: NonlinearProblem, update: Callable[[], None]) -> None:
    """Bring what does not follow the unknowns by itself up to date before each residual of Newton's method."""
    assemble, _, context = problem.solver.getFunction()[1]

    def residual(snes: Any, x: Any, b: Any) -> None:
        assign(x, problem.u)
        problem.u.x.scatter_forward()
        update()
        assemble(snes, x, b, **context)

    problem.solver.setFunction(residual, problem.b)
