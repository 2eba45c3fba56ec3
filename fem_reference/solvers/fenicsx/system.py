"""The equations of a body in equilibrium: residual and tangent, summed from cells, springs, loads and contact.

Every method is collective: all ranks must call it.
"""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem, la
from dolfinx.fem.petsc import create_vector
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy.sparse import csr_array

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.fenicsx import compiling
from fem_reference.solvers.fenicsx.boundary_conditions import PointSprings, PrescribedRegion
from fem_reference.solvers.fenicsx.cells import CellSums, Structure, Tangent
from fem_reference.solvers.fenicsx.contact import ContactForces, Tractions
from fem_reference.solvers.fenicsx.forms import Form
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.touching import TouchingForces

_ROUNDING = 1e-11  # [mm], the rounding of positions


class System:
    """Residual ``b`` and tangent ``matrix`` of the ``unknowns``. Prescribed unknowns are eliminated: their residual is 0, and their
    rows and columns of the tangent are 0 except for a 1 on the diagonal.
    """

    def __init__(self, form: Form, conditions: list[PrescribedRegion | PointSprings], spent: Spent) -> None:
        unknowns, space = form.unknowns, form.unknowns.function_space
        self.unknowns, self.conditions, self.spent = unknowns, conditions, spent
        self.index_map, self.block = space.dofmap.index_map, space.dofmap.index_map_bs
        self.owned, self.size = self.index_map.size_local * self.block, len(unknowns.x.array)
        self.fixed: NDArray[np.bool_] = np.zeros(self.size, bool)
        for one in conditions:
            self.fixed[one.exact] = True
        self.cells = CellSums(form)
        self.scale = np.ones(self.size)  # of each unknown in linear systems
        self.b, self.work = create_vector(space), la.vector(self.index_map, self.block)
        self.ties = [one for one in conditions if isinstance(one, PointSprings)]
        springs = sum((one.springs(form) for one in conditions if isinstance(one, PrescribedRegion)), 0)
        self.stretched, self.loads, self.springs = (
            [SurfaceSums(terms, unknowns, self.fixed)] if terms else []
            for terms in (form.stretched, form.loads, springs)
        )
        self.surface = self.springs + self.loads + self.stretched
        self.contact: ContactForces | None = None
        self.touching: TouchingForces | None = None
        self.matrix, whole = PETSc.Mat().create(space.mesh.comm), self.index_map.size_global * self.block
        self.matrix.setSizes(((self.owned, whole), (self.owned, whole)))
        self.matrix.setType(PETSc.Mat.Type.AIJ)
        self._use(self.cells.structure(), 1.0)

    def _use(self, structure: Structure, unit: float) -> None:
        """Give the tangent and the matrix this ``structure`` and the pressures the scale ``unit``. Entries of ghost rows go to the
        ranks that own the rows.
        """
        blocks = self.index_map.local_to_global(np.arange(self.size // self.block, dtype=np.int32))
        names = (blocks[:, None] * self.block + np.arange(self.block)).ravel().astype(PETSc.IntType)
        rows = np.repeat(np.arange(self.size), np.diff(structure.starts))
        self.structure = structure
        self.tangent = Tangent(np.zeros(len(rows) + 1), self.cells.places(structure, self.fixed), unit)
        self.matrix.setPreallocationCOO(names[rows], names[structure.columns])
        diagonal = np.flatnonzero(structure.columns == rows)
        own = np.flatnonzero(self.fixed[: self.owned])
        self.prescribed_diagonal = diagonal[own]  # every row has a diagonal entry, in the order of the rows
        for terms in self.surface:
            terms.find_places(self._keys())

    def _keys(self) -> Ints:
        """The sorted keys (e,) of the entries of the structure: ``row * size + column``."""
        return np.repeat(np.arange(self.size), np.diff(self.structure.starts)) * self.size + self.structure.columns

    def _add_touching(self, touching: TouchingForces) -> None:
        """Add the tangent of ``touching`` to the entries, after extending the structure by the entries that it needs."""
        found, own = touching.tangent().tocoo(), self._keys()
        free = ~(self.fixed[found.row] | self.fixed[found.col])
        keys = found.row[free].astype(np.int64) * self.size + found.col[free]
        places = np.searchsorted(own, keys)
        lacks = own[np.minimum(places, len(own) - 1)] != keys
        if lacks.any():
            entries, every = self.tangent.entries, np.insert(own, places[lacks], keys[lacks])
            rows, columns = np.divmod(every, self.size)
            starts = np.searchsorted(rows, np.arange(self.size + 1))
            self._use(Structure(starts.astype(np.int32), columns.astype(np.int32)), self.tangent.unit)
            self.tangent.entries[np.append(np.searchsorted(every, own), -1)] = entries
            places = np.searchsorted(every, keys)
        self.tangent.entries[places] += found.data[free]

    def residual(self, tractions: Tractions | None = None) -> float:
        """Assemble the residual into ``b`` and return its norm. ``tractions``, if given, replace the current contact tractions."""
        with self.spent.on("assembly"):
            self.work.array[:] = 0
            self.cells.add(self.work.array)
            return self._finish(tractions, None)

    def linearise(
        self, moves: Floats | None = None, tractions: Tractions | None = None, *, pointwise: bool = False
    ) -> float:
        """Assemble the ``residual``, and the tangent into ``matrix``. Changes ``moves`` (n,) of prescribed unknowns are taken into
        account to first order. ``pointwise``: see ``CellSums.add``.
        """
        with self.spent.on("assembly"):
            self.work.array[:], self.tangent.entries[:] = 0, 0
            self.cells.add(self.work.array, self.tangent, moves, pointwise=pointwise)
            for terms in self.surface:
                terms.add_tangent(self.tangent.entries)
            ties = [tie.tangent() for tie in self.ties]
            for points in [*ties, *(self.contact.tangent() if self.contact else ())]:
                self.cells.add_points(self.tangent, *points)
            if self.touching:
                self._add_touching(self.touching)
            self.tangent.entries[self.prescribed_diagonal] = 1.0
            self.matrix.setValuesCOO(self.tangent.entries[:-1])  # type: ignore[arg-type]  # the stubs declare a sequence
            return self._finish(tractions, moves)

    def _finish(self, tractions: Tractions | None, moves: Floats | None) -> float:
        """Complete the residual of the cells with all other terms and with the contributions of other ranks; return its norm."""
        for terms in self.surface:
            terms.add_residual(self.work.array, moves)
        for tie in self.ties:
            tie.add_residual(self.work.array, moves)
        if self.contact:
            self.contact.add_residual(self.work.array, tractions)
        if self.touching:
            self.touching.add_residual(self.work.array, moves)
        self.work.scatter_reverse(la.InsertMode.add)
        self.b.array[:] = np.where(self.fixed[: self.owned], 0.0, self.work.array[: self.owned])
        norm = float(self.b.norm())
        self.b.array[:] *= self.scale[: self.owned]
        return norm

    def balance_units(self) -> None:
        """Choose the scale of the pressure from the current tangent. In linear systems it gives volumes [mm3] the weight of forces
        [N], and pressures the weight of displacements [mm].
        """
        space = self.unknowns.function_space
        if space.num_sub_spaces == 1:
            return
        self.linearise()
        pressures = np.zeros(self.size, bool)
        pressures[np.unique(space.sub(1).dofmap.list[: self.cells.count])] = True
        rows = np.repeat(np.arange(self.size), np.diff(self.structure.starts))
        squares = self.tangent.entries[:-1] ** 2
        moved = ~pressures[rows] & ~self.fixed[rows]
        of_pressures = pressures[self.structure.columns]
        sums = [float(squares[moved & (of_pressures == which)].sum()) for which in (False, True)]
        stiff, coupling = self.unknowns.function_space.mesh.comm.allreduce(np.array(sums), MPI.SUM)
        if coupling > 0:
            self.tangent.unit = self.scale[pressures] = float(np.sqrt(stiff / coupling))

    def missing(self) -> Floats:
        """The unknowns minus their prescribed values (n,); 0 for an unknown that is not prescribed."""
        found = np.zeros(self.size)
        for one in self.conditions:
            found[one.exact] = self.unknowns.x.array[one.exact] - one.prescribed[: len(one.exact)]
        return found

    def lacking(self) -> bool:
        """True if an unknown on any rank differs from its prescribed value by more than rounding."""
        most = np.abs(self.missing()).max(initial=0.0)
        return bool(self.unknowns.function_space.mesh.comm.allreduce(most, MPI.MAX) > _ROUNDING)

    def reactions(self, *, inside: bool = False) -> Floats:
        """The residual (n,) on the ranks that own the unknowns, including prescribed unknowns, but without springs on facets. With
        ``inside``, it is also without loads, other springs and contact.
        """
        self.work.array[:] = 0
        self.cells.add(self.work.array)
        for load in self.stretched + ([] if inside else self.loads):
            load.add_residual(self.work.array, None)
        for force in [] if inside else [*self.ties, self.contact, self.touching]:
            if force:
                force.add_residual(self.work.array, None)
        self.work.scatter_reverse(la.InsertMode.add)
        return np.array(self.work.array)


class SurfaceSums:
    """Terms of the weak form on parts of the surface; their tangent is added to the entries of a structure."""

    def __init__(self, terms: Any, unknowns: fem.Function, fixed: NDArray[np.bool_]) -> None:
        step = ufl.TrialFunction(unknowns.function_space)
        self.residual, self.slope = compiling.form(terms), compiling.form(ufl.derivative(terms, unknowns, step))
        self.matrix = fem.create_matrix(self.slope)
        self.fixed = fixed

    def find_places(self, keys: Ints) -> None:
        """Find the indices of the tangent's entries in the sorted ``keys`` (e,), each ``row * size + column``."""
        rows, columns = np.repeat(np.arange(len(self.fixed)), np.diff(self.matrix.indptr)), self.matrix.indices
        self.places = np.searchsorted(keys, rows * len(self.fixed) + columns)
        self.places[self.fixed[rows] | self.fixed[columns]] = len(keys)

    def add_residual(self, residual: Floats, moves: Floats | None) -> None:
        """Add the terms to ``residual`` (n,), and their first-order change due to changes ``moves`` (n,) of the unknowns."""
        fem.assemble_vector(residual, self.residual)
        if moves is not None:
            entries = (self.matrix.data, self.matrix.indices, self.matrix.indptr)
            residual += csr_array(entries, shape=(len(residual), len(residual))) @ moves

    def add_tangent(self, entries: Floats) -> None:
        """Add the tangent to the ``entries`` of the structure."""
        self.matrix.data[:] = 0
        fem.assemble_matrix(self.matrix, self.slope)
        np.add.at(entries, self.places, self.matrix.data)


def reactions(
    system: System, contact: ContactForces | None, *, divided: bool
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """The forces (3,) [N] on the body and their moments (3,) [N mm] about the origin, by the name of the constraint in ``system``,
    the bone in ``contact`` or the touching part.

    The force at an unknown of several regions is ``divided`` between the regions, so that all forces balance; otherwise it counts
    in each region.
    """
    residual, now, comm = system.reactions(), system.unknowns.x.array, system.unknowns.function_space.mesh.comm
    shared = np.zeros(len(now), np.int64)
    for one in system.conditions:
        if divided and isinstance(one, PrescribedRegion):
            shared[one.dofs] += 1
    found = {one.entry.name: one.force(residual, now, shared) for one in system.conditions}
    found |= contact.forces() if contact else {}
    found |= system.touching.forces() if system.touching else {}
    forces = {name: comm.allreduce(force, MPI.SUM) for name, (force, _) in found.items()}
    moments = {name: comm.allreduce(moment, MPI.SUM) for name, (_, moment) in found.items()}
    return forces, moments
