"""A body as DOLFINx sees it: spaces, the weak form summed from the effects, what is prescribed, and Newton's method.

Every method is collective: all ranks call it and, where it returns a value, get the same one.
"""

from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, la, mesh
from dolfinx.fem.petsc import NonlinearProblem
from mpi4py import MPI

from fem_reference.continuum import ELEMENTS, Continuum
from fem_reference.mesh import Floats, Ints
from fem_reference.solvers.fenicsx import compiling, forms, meshes, pushed_points
from fem_reference.solvers.fenicsx.clock import Clock
from fem_reference.solvers.fenicsx.contact import Pushes, Watched
from fem_reference.solvers.fenicsx.determinants import Determinants
from fem_reference.solvers.fenicsx.holds import Hold
from fem_reference.solvers.fenicsx.settings import BodySettings
from fem_reference.solvers.fenicsx.stability import Stability, has_energy
from fem_reference.stepping import Attempt

_NOT_A_NUMBER = -4  # how PETSc's SNES ends there; the name of the constant depends on its version


class Body:
    """The unknowns of a body, made of an element of ``ELEMENTS``, and their equations."""

    def __init__(self, body: Continuum, settings: BodySettings) -> None:
        self.comm = MPI.COMM_WORLD
        self.effects = body.effects
        self.mesh = meshes.distribute(self.comm, body.mesh)
        # Where each of this rank's own cells stood in the body's mesh.
        own = self.mesh.topology.index_map(3).size_local
        self.cells: Ints = np.asarray(self.mesh.topology.original_cell_index, np.int64)[:own]
        self.local = {int(cell): i for i, cell in enumerate(self.cells)}
        self.unknowns = _unknowns(self.mesh, settings.element)
        self.displacement_space, self.displacement_dofs = self.unknowns.function_space.sub(0).collapse()
        self.displacement = fem.Function(self.displacement_space)
        form = forms.Form(self.mesh, body, self.unknowns, settings, self.cells)
        self.amounts = form.amounts
        self.clock = Clock(body, form.before, form.rate)
        self.volume_form, self.energy_form = compiling.form(form.volume), compiling.form(form.energy)
        self.rest_volume = self.integral(self.volume_form)
        self.internal = compiling.form(form.residual)
        self.held = [Hold(self.unknowns, entry, form.regions[entry.on]) for entry in body.prescribed]
        self.determinants = Determinants(self.mesh, self.cells, form.determinant, form.rule[0], body.mesh.kind)
        springs = sum((hold.springs(form.measure(hold.entry.on)) for hold in self.held), 0)
        slope = ufl.derivative(springs, self.unknowns) if springs else 0
        symmetric = has_energy(body)
        self.newton = self._newton(form.residual + springs, form.tangent + slope, settings, symmetric)
        self.stability = Stability(self.newton, self.unknowns) if symmetric else None
        self.contact = self._contact(body, form) if body.contact else None
        self.nodes = meshes.Nodes(body.mesh, self.cells, ufl.split(self.unknowns)[0])

    def _contact(self, body: Continuum, form: forms.Form) -> Watched:
        """What obstructions do, added to Newton's method."""
        law, space, parents = body.contact, self.displacement_space, np.ravel(self.displacement_dofs)
        assert law is not None  # asked for only where it is there
        if isinstance(law.on, str):
            facets = form.regions[law.on]
            points = pushed_points.on_facets(space, parents, body.mesh, facets, form.degree)
        else:
            points = pushed_points.on_skin(space, parents, law.on, self.local)
        pushes = Pushes(law, body.obstructions, points, self.unknowns, body.frames[0])
        return Watched(self.newton, pushes, self._conditions)

    @property
    def _conditions(self) -> list[Any]:
        return [condition for hold in self.held for condition in hold.conditions]

    def _newton(self, equations: Any, tangent: Any, settings: BodySettings, symmetric: bool) -> NonlinearProblem:
        """Newton's method, each step whole and by a sparse factorisation (MUMPS): LDL^T of a symmetric tangent, else LU.

        A line search would weigh out-of-balance forces [N] against volumes [mm3]: it stalls where bodies bend or are soft.
        """
        options = {
            "snes_type": "newtonls",
            "snes_linesearch_type": "basic",
            "snes_atol": settings.residual,
            "snes_rtol": 0.0,
            "snes_stol": 0.0,
            "snes_max_it": settings.newton_iterations,
            "ksp_type": "preonly",
            "pc_type": "cholesky" if symmetric else "lu",  # with MUMPS the former is LDL^T
            "pc_factor_mat_solver_type": "mumps",
        }
        return NonlinearProblem(
            equations,
            self.unknowns,
            J=tangent,
            bcs=self._conditions,
            petsc_options=options,
            jit_options=compiling.OPTIONS,
            petsc_options_prefix="fem_reference_",
        )

    @property
    def size(self) -> int:
        """How many unknowns there are, over all ranks."""
        return int(self.unknowns.function_space.dofmap.index_map.size_global)

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame`` from the present state; on failure go back to it. A state in which det F is not positive, at a
        quadrature point or a vertex, is inverted whatever Newton's method says.
        """
        before = np.array(self.unknowns.x.array)
        self.clock.start(frame, before)
        reason, iterations = self._solve(frame)
        smallest = self.determinants.smallest()
        through = self.contact.pushes.tunnelled(self.comm) if self.contact and reason > 0 else None
        if reason > 0 and smallest.value > 0 and through is None:
            self.clock.settle(frame)
            if self.contact:
                self.contact.pushes.settle()
            return Attempt(None, iterations)
        self.unknowns.x.array[:] = before
        if self.contact:
            self.contact.pushes.go_back()
        if through is not None:
            return Attempt("diverged", iterations, f"Newton's method converged, but {through}")
        if reason > 0:
            return Attempt("inverted", iterations, f"Newton's method converged, but det F fell to {smallest}")
        how = "went where a law has no value" if reason == _NOT_A_NUMBER else "did not converge"
        return Attempt("diverged", iterations, f"Newton's method {how} in {iterations} iterations")

    def _solve(self, frame: float) -> tuple[int, int]:
        """Newton's method with what acts and is prescribed at ``frame``: how it ended (above 0: converged) and its iterations."""
        for effect, amount in zip(self.effects, self.amounts, strict=True):
            amount.value = effect.amount(frame)
        for hold in self.held:
            hold.move_to(frame)
        if self.contact:
            self.contact.go_to(frame)
        self.newton.solve()
        snes = self.newton.solver
        return int(snes.getConvergedReason()), int(snes.getIterationNumber())

    def scalars(self) -> dict[str, float]:
        """The smallest det F at quadrature points and vertices, V/V0, and the energy [N mm]."""
        contact = self.contact.pushes.scalars(self.comm) if self.contact else {}
        return contact | {
            "min_det_F_quadrature": self.determinants.smallest("quadrature point").value,
            "min_det_F_vertices": self.determinants.smallest("vertex").value,
            "volume_ratio": self.integral(self.volume_form) / self.rest_volume,
            "energy": self.integral(self.energy_form),
        }

    def negative_modes(self) -> float | None:
        """In how many directions the energy falls, with drag or viscosity those in which it does so by more than a factor e over
        all frames, were it held still from now on: the viscous stress of this step is left out. None where the tangent is not
        symmetric.
        """
        if self.stability is None:
            return None
        with self.clock.slow(np.array(self.unknowns.x.array)):
            return self.stability.negative_modes()

    def integral(self, form: Any) -> float:
        """A compiled form, summed over the ranks."""
        return float(self.comm.allreduce(fem.assemble_scalar(form), MPI.SUM))

    def forces(self) -> tuple[dict[str, Floats], dict[str, Floats]]:
        """By name of what is prescribed, the force (3,) [N] that holds it there and its moment (3,) [N mm] about the origin."""
        vector = fem.assemble_vector(self.internal)
        vector.scatter_reverse(la.InsertMode.add)
        now = np.array(self.unknowns.x.array)
        if self.contact:
            vector.array[:] += self.contact.everywhere(self.contact.pushes.tractions())
        held = {hold.entry.name: hold.force(vector.array, now) for hold in self.held}
        held |= self.contact.pushes.forces() if self.contact else {}
        forces = {name: self.comm.allreduce(force, MPI.SUM) for name, (force, _) in held.items()}
        moments = {name: self.comm.allreduce(moment, MPI.SUM) for name, (_, moment) in held.items()}
        return forces, moments

    def node_positions(self) -> Floats:
        """Where the nodes of the body's mesh are now (n, 3) [mm]."""
        return self.nodes.positions(self.mesh)

    def positions(self, cells: Ints, points: Floats) -> Floats:
        """Where the material points ``points`` (n, 3), each seen from cell ``cells`` (n,), are now; (n, 3) on every rank."""
        self.displacement.x.array[:] = self.unknowns.x.array[self.displacement_dofs]
        mine = np.array([i for i, cell in enumerate(cells) if int(cell) in self.local], dtype=np.int64)
        local = np.array([self.local[int(cells[i])] for i in mine], dtype=np.int32)
        moved = points[mine] + self.displacement.eval(points[mine], local).reshape(-1, 3) if len(mine) else points[mine]
        result = np.empty_like(points)
        for indices, values in self.comm.allgather((mine, moved)):
            result[indices] = values
        return result


def _unknowns(msh: mesh.Mesh, element: str) -> fem.Function:
    """Displacement, and pressure where the element has one."""
    kind, degree, pressure = ELEMENTS[element]
    parts = [basix.ufl.element("Lagrange", kind, degree, shape=(3,))]
    if pressure == 0:
        parts.append(basix.ufl.element("Discontinuous Lagrange", kind, 0))
    elif pressure is not None:
        parts.append(basix.ufl.element("Lagrange", kind, pressure))
    return fem.Function(fem.functionspace(msh, basix.ufl.mixed_element(parts)))
