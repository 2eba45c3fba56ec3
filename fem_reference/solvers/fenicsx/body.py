"""A body in DOLFINx: spaces, the weak form summed from the effects, boundary conditions, and Newton's method.

Every method is collective: all ranks must call it, and all get the same value.
"""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.effects import Energy, Load, Ramped
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.contact import ContactLaw
from fem_reference.solvers.common.load_steps import Attempt
from fem_reference.solvers.common.state_checks import StateCheck, Trouble, first_trouble
from fem_reference.solvers.fenicsx import compiling, contact_points, forms, in_situ, meshes
from fem_reference.solvers.fenicsx.boundary_conditions import PointSprings, PrescribedRegion, Tendons
from fem_reference.solvers.fenicsx.clock import Clock
from fem_reference.solvers.fenicsx.contact import ContactForces
from fem_reference.solvers.fenicsx.determinants import Determinants
from fem_reference.solvers.fenicsx.linear import Factorised
from fem_reference.solvers.fenicsx.meshes import Displacement
from fem_reference.solvers.fenicsx.multigrid import LinearSolver, Multigrid
from fem_reference.solvers.fenicsx.newton import Newton
from fem_reference.solvers.fenicsx.nodal import Nodal
from fem_reference.solvers.fenicsx.path import Known, KnownState, Path
from fem_reference.solvers.fenicsx.resources import SMALL
from fem_reference.solvers.fenicsx.settings import BodySettings
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.stability import Stability
from fem_reference.solvers.fenicsx.system import System
from fem_reference.solvers.fenicsx.touching import touching_of
from fem_reference.solvers.fenicsx.validity import Validity


class AssembledBody:
    """The unknowns of a body, discretised with an element of ``ELEMENTS``, and their equations."""

    def __init__(self, body: Body, settings: BodySettings) -> None:
        self.comm, self.reuse, self.effects = MPI.COMM_WORLD, settings.reuse and not body.remembers, body.effects
        changed = (isinstance(one, Energy) and (isinstance(one, Ramped) or not one.stored) for one in self.effects)
        self.conserves = not any(changed)  # True if the energy changes only as the body deforms
        self.judged = False  # True if ``path.gap`` is judged; if not, a halfway state is not worth its cost
        self.mesh = meshes.distribute(self.comm, body.mesh)
        count = self.mesh.topology.index_map(3).size_local
        self.cells = np.asarray(self.mesh.topology.original_cell_index, np.int64)[:count]
        self.local = np.full(len(body.mesh.cells), -1)  # this rank's index of each cell of the body, -1 on other ranks
        self.local[self.cells] = np.arange(len(self.cells))
        self.unknowns = meshes.unknowns(self.mesh, settings.element)
        self.displacement = Displacement(self.unknowns)
        form = forms.Form(self.mesh, body, self.unknowns, settings, self.cells)
        self.set_amounts = form.set_amounts
        self.clock = Clock(body, form.step)
        self.energy_form = compiling.form(form.energy)
        self.kinetic_form = compiling.form(form.kinetic) if form.kinetic else None
        self.conditions = [self._condition(entry, form) for entry in body.prescribed]
        self.determinants = Determinants(self.displacement, self.cells, form.determinant, form.rule[0], body.mesh.kind)
        self.validity = Validity(self.determinants, form, body)
        self.spent = Spent()
        self.system = System(form, self.conditions, self.spent)
        self.linear = _linear_solver(self.system, body, settings)
        self.newton = Newton(self.system, self.linear, self.determinants, settings)
        counts = isinstance(self.linear, Factorised) and self.linear.symmetric
        self.stability = Stability(self.system, cast(Factorised, self.linear)) if counts else None
        self.contact = self.system.contact = self._contact(body, body.contact, form) if body.contact else None
        self.touching = self.system.touching = touching_of(body, form, self.displacement, self.spent)
        self.system.balance_units()
        in_situ.balance(form, self.system, self.linear, settings.residual)
        self.path = Path(self.system, self.determinants)
        if form.rest is not None:
            self.path.settle(self.energy(), connected=False)
        self.contacts = tuple(one for one in (self.contact, self.touching) if one is not None)
        self.checks: tuple[StateCheck, ...] = *self.contacts, self.determinants, self.validity, self.path, self
        self.known = Known(self.comm)
        self.recalled: KnownState | None = None
        self.modes: float | None = None  # negative modes of the last examined state
        self.at = body.frames[0]  # the frame of the last good state
        self.nodal = Nodal(body.mesh, self.cells, settings.element, self.displacement, self.clock, form.rest)

    def _condition(self, entry: Prescribed, form: forms.Form) -> PrescribedRegion | PointSprings:
        if isinstance(entry.on, str):
            return PrescribedRegion(self.displacement, entry, form.regions[entry.on])
        points = contact_points.on_skin(self.displacement, entry.on, self.local)
        return (PointSprings if entry.anchor is None else Tendons)(self.unknowns, entry, points)

    def _contact(self, body: Body, law: ContactLaw, form: forms.Form) -> ContactForces:
        if isinstance(law.on, str):
            points = contact_points.on_facets(self.displacement, body.mesh, form.regions[law.on], form.degree)
        else:
            points = contact_points.on_skin(self.displacement, law.on, self.local)
        return ContactForces(law, body.bones, points, self.unknowns, body.frames[0], self.spent)

    def trouble(self, _: Floats, /) -> Trouble | None:
        """The trouble *diverged* if the energy has no value in the current state."""
        if np.isfinite(self.energy()):
            return None
        return Trouble("diverged", "to a state in which the energy is not a number: a law has no value there")

    def start(self, moved: Callable[[Floats], Floats]) -> None:
        """Begin with the nodes at the positions to which ``moved`` maps their rest positions (n, 3) [mm]."""
        rest = self.displacement.space.tabulate_dof_coordinates()
        self.unknowns.x.array[self.displacement.dofs] = moved(rest) - rest
        self.unknowns.x.scatter_forward()
        if self.touching:
            self.touching.settle()
        self.path.settle(self.energy(), connected=False)

    @property
    def size(self) -> int:
        """The number of unknowns, over all ranks."""
        return int(self.unknowns.function_space.dofmap.index_map.size_global)

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame`` from the current state, which is restored if Newton's method fails or a check rejects the result."""
        before = np.array(self.unknowns.x.array)
        if self.clock.begins():
            self._begin(before)
        self.clock.start(frame, before)
        self.set_frame(frame)
        self.recalled = None
        found = self.newton.solve_among(self.contact, frame)
        if found.converged and (trouble := first_trouble(self.checks, before)) is not None:
            found = found.refused(trouble)
        if found.converged:
            self._settle(before, frame)
        else:
            self.go_back(before)
        return found

    def _settle(self, before: Floats, frame: float) -> None:
        """Accept the current state as the state of ``frame``. ``before`` (n,): the unknowns at the start of the load step, from
        which a state halfway through the step is computed if work and energy disagree.
        """
        after, contact, middle = np.array(self.unknowns.x.array), self.system.contact, (self.at + frame) / 2
        looked, restoring = list[bool](), [one.restoring() for one in self.contacts]

        def halfway() -> bool:
            looked.append(True)
            self.go_back(before)
            self.set_frame(middle)
            found = self.newton.solve_among(self.contact, middle)
            self.newton.thrown += found.iterations
            return found.converged and self.determinants.smallest().value > 0

        self.path.settle(self.energy(), halfway if self.judged and self.conserves and not self.clock.matters else None)
        if looked:
            self.set_frame(frame)
            self.system.contact = contact
            for restore in restoring:
                restore()
        for one in self.contacts:
            one.settle()
        self.clock.settle(frame, after)
        self.at = frame

    def go_back(self, before: Floats) -> None:
        """Restore the last good state, whose unknowns are ``before``."""
        self.unknowns.x.array[:] = before
        for one in self.contacts:
            one.go_back()

    def _begin(self, before: Floats) -> None:
        """Find the initial acceleration of the body at rest, with unknowns ``before``, by a step too short for motion."""
        self.clock.instant(before)
        self.set_frame(self.clock.at)
        self.newton.solve(self.clock.at)  # mass dominates the tangent; a failure would show in the first step
        self.clock.begin(self.unknowns.x.array)
        self.go_back(before)

    def recall(self, frame: float) -> bool:
        """Restore an earlier state with the loads and boundary conditions of ``frame`` and return True, if such a state exists, its
        residual confirms equilibrium, and no jump leads to it (after a full turn the loads are as at rest, but the state is not).
        """
        if self.clock.matters or not self.reuse:
            return False
        before, self.system.contact = np.array(self.unknowns.x.array), self.contact
        self.set_frame(frame)
        self.recalled = self.known.find(self._acting(frame))
        if self.recalled is None:
            return False
        self.unknowns.x.array[:] = self.recalled.unknowns
        self.unknowns.x.array[:] -= self.system.missing()  # prescribed values differ by rounding when a motion returns
        if self.contact:
            self.contact.update(frame)
        proved = self.system.residual() <= self.newton.residual and self.path.jumped(before) is None
        if not proved:
            self.go_back(before)
        else:
            self.arrive(frame)
        return proved

    def arrive(self, frame: float) -> None:
        """Accept the current state as the state of ``frame`` although no load step led to it."""
        self.at = frame
        for one in self.contacts:
            one.settle()
        self.path.settle(self.energy(), connected=False)

    def know(self, frame: float, unknowns: Floats, modes: float | None) -> None:
        """Register ``frame`` as solved earlier, with its ``unknowns`` (n,) and its number of negative ``modes``."""
        if self.reuse and not self.clock.matters:
            self.set_frame(frame)
            self.known.add(KnownState(self._acting(frame), unknowns, modes))

    def take_up(self, frame: float, unknowns: Floats, *, recalled: bool) -> None:
        """Restore the state of ``frame``, with ``unknowns`` (n,), as if just reached. ``recalled``: True if ``recall`` found it."""
        self.set_frame(frame)
        self.unknowns.x.array[:] = unknowns
        if self.contact:
            self.contact.update(frame)
        self.arrive(frame)
        if not recalled and self.stability is not None:  # makes the factorisation that the linear solver then uses
            with self.clock.slow(np.array(self.unknowns.x.array)):
                self.stability.negative_modes()

    def _acting(self, frame: float) -> Floats:
        """All values that determine the state at ``frame``, apart from the body itself."""
        amounts = [effect.amount(frame) for effect in self.effects]
        poses = [entry.pose(frame).ravel() for entry in self.contact.bones] if self.contact else []
        allowed = [self.contact.law.allowance(frame)] if self.contact else []
        allowed += self.touching.acting() if self.touching else []
        return np.concatenate([amounts, allowed, *poses, *(one.prescribed for one in self.conditions)])

    def set_frame(self, frame: float) -> None:
        """Set loads and prescribed values at ``frame``."""
        self.set_amounts(frame)
        for one in (*self.conditions, *([self.touching] if self.touching else [])):
            one.move_to(frame)

    def scalars(self) -> dict[str, float]:
        """The smallest det F at quadrature points and at vertices, V/V0, the energies [N mm], and the scalars of contact."""
        contact = self.contact.scalars() if self.contact else {}
        contact |= self.touching.scalars() if self.touching else {}
        moving = {} if self.kinetic_form is None else {"kinetic_energy": self.integral(self.kinetic_form)}
        gap = {"energy_gap": self.path.take_gap()} if self.conserves else {}
        own = {
            "min_det_F_quadrature": self.determinants.smallest("quadrature point").value,
            "min_det_F_vertices": self.determinants.smallest("vertex").value,
            "volume_ratio": self.validity.volume_ratio(),
            "energy": self.energy(),
        }
        return contact | moving | gap | own

    def examine(self, frame: float) -> float | None:
        """The number of directions in which the energy decreases from the current state, at ``frame``; None if the tangent is not
        symmetric. The state is stored for later frames with the same loads.

        With drag or viscosity, a direction counts if a perturbation along it would grow by more than a factor of e over the
        duration of all frames, with the bones held still and without the viscous stress of the current step.
        """
        if self.recalled is not None:
            self.modes = self.recalled.negative_modes
            return self.modes
        modes = None
        if self.stability is not None:
            with self.clock.slow(np.array(self.unknowns.x.array)):
                modes = self.stability.negative_modes()
        self.know(frame, np.array(self.unknowns.x.array), modes)
        self.modes = modes
        return modes

    def modes_of_material(self) -> float:
        """The number of negative modes of the current state that certainly belong to the material, not to the element."""
        assert self.stability is not None  # modes have been counted
        with self.clock.slow(np.array(self.unknowns.x.array)):
            return self.stability.of_material()

    def energy(self) -> float:
        """The stored energy [N mm]."""
        own = self.system.cells.stabilising_energy()
        return self.integral(self.energy_form) + float(self.comm.allreduce(own, MPI.SUM))

    def integral(self, form: Any) -> float:
        """The integral of a compiled ``form``, summed over the ranks."""
        return float(self.comm.allreduce(fem.assemble_scalar(form), MPI.SUM))

    def positions(self, cells: Ints, points: Floats) -> Floats:
        """The current positions (n, 3) [mm] of rest ``points`` (n, 3) in ``cells`` (n,); every rank gets all of them."""
        mine, result = np.flatnonzero(self.local[cells] >= 0), np.empty_like(points)
        carried = contact_points.on_skin(self.displacement, Skin(cells, points, np.zeros(len(cells))), self.local)
        for indices, moved in self.comm.allgather((mine, carried.positions(self.unknowns.x.array))):
            result[indices] = moved
        return result


def _linear_solver(system: System, body: Body, settings: BodySettings) -> LinearSolver:
    """The linear solver named in ``settings``, or the default for the size of the ``system``."""
    # The tangent is symmetric if contact and all loads have an energy.
    symmetric = body.has_energy and all(one.stored for one in body.effects if isinstance(one, Load))
    kind = settings.linear_solver or ("direct" if system.matrix.getSize()[0] < SMALL else "lagged")
    if kind == "multigrid":
        system.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)  # type: ignore[arg-type]  # a number in the stubs
        return Multigrid(system)
    precision = settings.precision or ("double" if kind == "direct" else "single")
    return Factorised(system.matrix, symmetric, kind == "lagged", precision, system.spent)
