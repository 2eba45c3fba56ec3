"""A problem as DOLFINx sees it: spaces, the weak form summed from the effects, what is held, Newton's method, and evaluation.

Every method is collective: all ranks call it and, where it returns a value, get the same one.
"""

from dataclasses import dataclass
from typing import Any

import basix
import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import NonlinearProblem
from mpi4py import MPI

from fem_reference.effects import Effect, State
from fem_reference.mesh import Floats, Ints, TetMesh
from fem_reference.motion import apply
from fem_reference.problem import Problem

QUADRATURE_DEGREE = 4
_VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


@dataclass(frozen=True)
class Smallest:
    """The smallest det F over a set of points, and where: tet and rest position [mm]."""

    value: float
    tet: int
    at: tuple[float, float, float]

    def __str__(self) -> str:
        x, y, z = self.at
        return f"{self.value:.3f} in tet {self.tet} at ({x:.1f}, {y:.1f}, {z:.1f}) mm"


class Body:
    """The unknowns of a problem and their equations."""

    def __init__(self, problem: Problem, residual: float, newton_iterations: int) -> None:
        self.comm = MPI.COMM_WORLD
        self.mesh = _distribute(self.comm, problem.mesh)
        # Where each of this rank's own tets and points stood in the problem's mesh.
        own = self.mesh.topology.index_map(3).size_local
        self.tets: Ints = np.asarray(self.mesh.topology.original_cell_index, np.int64)[:own]
        self.local = {int(tet): cell for cell, tet in enumerate(self.tets)}
        self.unknowns = _unknowns(self.mesh, problem.effects)
        self.displacement_space, self.displacement_dofs = self.unknowns.function_space.sub(0).collapse()
        self.displacement = fem.Function(self.displacement_space)
        self.nodes: Floats = self.displacement_space.tabulate_dof_coordinates()
        energy, self.determinant = _energy(self.unknowns, problem.effects)
        dx = ufl.Measure("dx", domain=self.mesh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
        self.volume_form = fem.form(self.determinant * dx)
        self.energy_form = fem.form(energy * dx)
        self.held = [_Hold(self, problem.mesh.facets[held.attachment], held.bone) for held in problem.held]
        self.newton = _newton(self, energy * dx, residual, newton_iterations)
        self.points = {
            "quadrature points": basix.make_quadrature(basix.CellType.tetrahedron, QUADRATURE_DEGREE)[0],
            "vertices": _VERTICES,
        }
        self.determinants = {name: fem.Expression(self.determinant, points) for name, points in self.points.items()}

    @property
    def size(self) -> int:
        """How many unknowns there are, over all ranks."""
        return int(self.unknowns.function_space.dofmap.index_map.size_global)

    def solve(self, frame: float) -> tuple[bool, int]:
        """Newton's method from the present state with the bones where they are at ``frame``: (converged, iterations)."""
        for hold in self.held:
            hold.move_to(frame)
        self.newton.solve()
        snes = self.newton.solver
        return bool(snes.getConvergedReason() > 0), int(snes.getIterationNumber())

    def state(self) -> Floats:
        """A copy of all unknowns of this rank."""
        return np.array(self.unknowns.x.array)

    def restore(self, state: Floats) -> None:
        """Go back to a state that ``state`` returned."""
        self.unknowns.x.array[:] = state

    def integral(self, form: Any) -> float:
        """A compiled form, summed over the ranks."""
        return float(self.comm.allreduce(fem.assemble_scalar(form), MPI.SUM))

    def smallest_determinant(self, where: str) -> Smallest:
        """The smallest det F at the ``"quadrature points"`` or the ``"vertices"`` of the tets; NaN counts as smallest."""
        if len(self.tets) == 0:  # a rank without tets
            return self._smallest_of_all(Smallest(float("inf"), -1, (0.0, 0.0, 0.0)))
        values = self.determinants[where].eval(self.mesh, np.arange(len(self.tets), dtype=np.int32))
        cell, point = np.unravel_index(np.argmin(np.where(np.isnan(values), -np.inf, values)), values.shape)
        corners = self.mesh.geometry.x[self.mesh.geometry.dofmap[cell]]
        r = self.points[where][point]
        at = np.array([1 - r.sum(), *r]) @ corners
        mine = Smallest(float(values[cell, point]), int(self.tets[cell]), (float(at[0]), float(at[1]), float(at[2])))
        return self._smallest_of_all(mine)

    def _smallest_of_all(self, mine: Smallest) -> Smallest:
        everywhere: list[Smallest] = self.comm.allgather(mine)
        return min(everywhere, key=lambda found: (not np.isnan(found.value), found.value))

    def positions(self, tets: Ints, points: Floats) -> Floats:
        """Where the material points ``points`` (n, 3), each seen from tet ``tets`` (n,), are now; (n, 3) on every rank."""
        self.displacement.x.array[:] = self.unknowns.x.array[self.displacement_dofs]
        mine = np.array([i for i, tet in enumerate(tets) if int(tet) in self.local], dtype=np.int64)
        cells = np.array([self.local[int(tets[i])] for i in mine], dtype=np.int32)
        moved = points[mine] + self.displacement.eval(points[mine], cells).reshape(-1, 3) if len(mine) else points[mine]
        result = np.empty_like(points)
        for indices, values in self.comm.allgather((mine, moved)):
            result[indices] = values
        return result


class _Hold:
    """The displacement nodes on facets that a bone holds: they follow it rigidly."""

    def __init__(self, body: Body, facets: Ints, bone: Any) -> None:
        self.bone, self.nodes = bone, body.nodes
        self.values = fem.Function(body.displacement_space)
        space = body.unknowns.function_space.sub(0)
        entities = _local_facets(body.mesh, facets)
        dofs = fem.locate_dofs_topological((space, body.displacement_space), 2, entities)
        self.condition = fem.dirichletbc(self.values, dofs, space)

    def move_to(self, frame: float) -> None:
        self.values.x.array[:] = (apply(self.bone.pose(frame), self.nodes) - self.nodes).ravel()


def _distribute(comm: MPI.Comm, tets: TetMesh) -> mesh.Mesh:
    """The mesh over the ranks; the first one brings it."""
    element = basix.ufl.element("Lagrange", "tetrahedron", 1, shape=(3,))
    brings = slice(None) if comm.rank == 0 else slice(0)
    return mesh.create_mesh(comm, cells=np.array(tets.tets[brings]), e=element, x=np.array(tets.points[brings]))


def _local_facets(msh: mesh.Mesh, facets: Ints) -> Ints:
    """This rank's facets among triangles (m, 3) given by the points of the problem's mesh."""
    for start, end in ((2, 3), (2, 0), (0, 3), (3, 0)):
        msh.topology.create_connectivity(start, end)
    exterior = mesh.exterior_facet_indices(msh.topology)
    corners = mesh.entities_to_geometry(msh, 2, exterior)
    original = np.sort(np.asarray(msh.geometry.input_global_indices)[corners], axis=1)
    wanted = {tuple(facet) for facet in np.sort(facets, axis=1).tolist()}
    chosen = [tuple(facet) in wanted for facet in original.tolist()]
    return np.asarray(exterior[np.array(chosen, bool)])


def _unknowns(msh: mesh.Mesh, effects: tuple[Effect, ...]) -> fem.Function:
    """Displacement P2, and P1 for each further unknown that an effect brings."""
    elements = [basix.ufl.element("Lagrange", "tetrahedron", 2, shape=(3,))]
    elements += [basix.ufl.element("Lagrange", "tetrahedron", 1) for _ in _brought(effects)]
    return fem.Function(fem.functionspace(msh, basix.ufl.mixed_element(elements)))


def _brought(effects: tuple[Effect, ...]) -> list[str]:
    """The names of the unknowns that effects bring, each once."""
    return sorted({unknown for effect in effects for unknown in effect.unknowns})


def _energy(unknowns: fem.Function, effects: tuple[Effect, ...]) -> tuple[Any, Any]:
    """The sum of the effects' energies per rest volume, and det F, as UFL expressions."""
    displacement, *others = ufl.split(unknowns)
    by_name = dict(zip(_brought(effects), others, strict=True))
    F = ufl.Identity(3) + ufl.grad(displacement)
    J = ufl.det(F)
    state = State(I1=ufl.tr(F.T * F), J=J, pressure=by_name.get("pressure"))
    return sum(effect.energy(state) for effect in effects), J


def _newton(body: Body, energy: Any, residual: float, newton_iterations: int) -> NonlinearProblem:
    """Newton's method with a backtracking line search, each step by a sparse LU factorisation (MUMPS)."""
    test = ufl.TestFunction(body.unknowns.function_space)
    options = {
        "snes_type": "newtonls",
        "snes_linesearch_type": "bt",
        "snes_atol": residual,
        "snes_rtol": 0.0,
        "snes_stol": 0.0,
        "snes_max_it": newton_iterations,
        "ksp_type": "preonly",
        "pc_type": "lu",
        "pc_factor_mat_solver_type": "mumps",
    }
    return NonlinearProblem(
        ufl.derivative(energy, body.unknowns, test),
        body.unknowns,
        bcs=[hold.condition for hold in body.held],
        petsc_options=options,
        petsc_options_prefix="fem_reference_",
    )
