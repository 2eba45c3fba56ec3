"""Residual and tangent of the energy, summed over cells by compiled loops (``cells.c``), in chunks that fit into the cache."""

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, eye_array

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, is_stabilised
from fem_reference.solvers.fenicsx import compiling
from fem_reference.solvers.fenicsx.forms import Form
from fem_reference.solvers.fenicsx.meshes import lagrange

_CHUNK = 256  # cells
_FIELDS = ("weights", "shape", "slopes", "values", "pressures")
Places = NDArray[np.int32]


class _Element(ctypes.Structure):
    _fields_ = tuple((name, ctypes.c_void_p) for name in _FIELDS)


class Structure(NamedTuple):
    """The sparsity pattern of a matrix over this rank's unknowns with ghosts: ``starts`` of the rows in the sorted ``columns``."""

    starts: Places
    columns: Places


@dataclass
class Tangent:
    """A tangent matrix during assembly.

    ``entries`` (e + 1,): the entries of the matrix; the last one collects all contributions of prescribed unknowns.
    ``places`` (m, u, u): the index in ``entries`` of each entry of each cell. ``unit``: the scale of the pressure unknowns.
    """

    entries: Floats
    places: Places
    unit: float = 1.0


class CellSums:
    """Sums over the cells that this rank owns. ``unknowns`` (m, u): the unknowns of each cell, first the displacement component by
    component, then the pressures.
    """

    def __init__(self, form: Form) -> None:
        unknowns, element = form.unknowns, form.element
        space, msh = unknowns.function_space, unknowns.function_space.mesh
        self.form, self.mesh, self.function = form, msh, unknowns
        self.count = msh.topology.index_map(3).size_local
        self.size = len(unknowns.x.array)
        parts = [space.sub(0).sub(component) for component in range(3)]
        parts += [space.sub(1)] if space.num_sub_spaces > 1 else []
        self.unknowns: Places = np.concatenate([part.dofmap.list for part in parts], axis=1)[: self.count]
        self.nodes = space.sub(0).sub(0).dofmap.list.shape[1]
        tables = _tables(element, msh, form.rule)
        self.kept = [np.ascontiguousarray(tables[name]) for name in _FIELDS]  # kept alive, as C has only the addresses
        self.element = _Element(*(table.ctypes.data for table in self.kept))
        self.corners = np.ascontiguousarray(msh.geometry.x[msh.geometry.dofmap[: self.count]])
        sizes = {"POINTS": len(form.rule[1]), "NODES": self.nodes, "PRESSURES": self.unknowns.shape[1] - 3 * self.nodes}
        sizes |= {"GEOMETRY": self.corners.shape[1], "KINDS": form.kinds}
        self.code = compiling.library(Path(__file__).with_name("cells.c"), sizes)
        self.projection = self._projection() if is_stabilised(element) else None

    def structure(self) -> Structure:
        """The sparsity pattern of the cells' entries, extended by the full diagonal."""
        starts = np.arange(0, self.unknowns.size + 1, self.unknowns.shape[1])
        entries = np.ones(self.unknowns.size, bool), self.unknowns.ravel(), starts
        has = csr_array(entries, shape=(self.count, self.size))
        found = csr_array(has.T @ has + eye_array(self.size, dtype=bool))
        found.sort_indices()
        return Structure(found.indptr.astype(np.int32), found.indices.astype(np.int32))

    def places(self, structure: Structure, fixed: NDArray[np.bool_]) -> Places:
        """The index in ``structure`` of each entry of each cell (m, u, u); one past the last for entries of ``fixed`` unknowns."""
        found = np.empty((*self.unknowns.shape, self.unknowns.shape[1]), np.int32)
        arrays: tuple[NDArray[Any], ...] = self.unknowns, structure.starts, structure.columns, fixed.view(np.int8)
        size = ctypes.c_int(len(structure.columns))
        self.code.find_places(ctypes.c_long(self.count), *map(_address, arrays), size, _address(found))
        return found

    def add(
        self, residual: Floats, into: Tangent | None = None, moves: Floats | None = None, *, pointwise: bool = False
    ) -> None:
        """Add the forces of the cells to ``residual`` (n,) over this rank's unknowns, ghosts included.

        If a tangent ``into`` is given, the tangent of the cells is added to it. If a change ``moves`` (n,) of the displacement is
        also given, the first-order change of the forces that it causes is added to ``residual``. With ``pointwise``, the pressure
        is not an unknown but follows from the volume at every point.
        """
        given = self.form.derivatives.first if into is None else self.form.derivatives.second
        for some in self._chunks():
            values = given.eval(self.mesh, np.arange(some.start, some.stop, dtype=np.int32))
            values = _without_pressure(values, 3 * self.form.kinds) if pointwise else values
            self.code.add_cells(
                ctypes.byref(self.element),
                ctypes.c_long(some.stop - some.start),
                _address(self.corners[some]),
                _address(values),
                ctypes.c_int(values.shape[-1]),
                _address(self.unknowns[some]),
                None if into is None else _address(into.places[some]),
                _address(residual),
                None if into is None else _address(into.entries),
                ctypes.c_double(1.0 if into is None else into.unit),
                None if moves is None else _address(moves),
            )
        if self.projection is not None:
            names = self.unknowns[:, 3 * self.nodes :]
            np.subtract.at(residual, names, np.einsum("mcd,md->mc", self.projection, self.function.x.array[names]))
            if into is not None:
                own = into.places[:, 3 * self.nodes :, 3 * self.nodes :]
                np.subtract.at(into.entries, own, into.unit**2 * self.projection)

    def add_points(self, into: Tangent, cells: Ints, basis: Floats, slope: Floats) -> None:
        """Add the tangent of tractions at points in ``cells`` (n,). ``basis`` (n, k): the values of the basis functions of the
        cells at the points; ``slope`` (n, 3, 3): the derivative of each traction with respect to the position of its point.
        """
        given = cells.astype(np.int32), np.ascontiguousarray(basis), np.ascontiguousarray(slope)
        arrays: tuple[NDArray[Any], ...] = *given, into.places, into.entries
        self.code.add_points(ctypes.c_long(len(cells)), *map(_address, arrays))

    def softness(self) -> Floats:
        """The mass matrix (m, p, p) [mm3/MPa] of the pressures of each cell, weighted with ``1 / (2 mu) + 1 / K``. K is the bulk
        modulus; the shear stiffness mu is the mean of the diagonal second derivatives of the energy.
        """
        rows, basis = self._diagonal(), self._pressures()
        stiff = [rows[i * self.form.kinds + k] for i in range(3) for k in range(3)]
        found = np.empty((self.count, basis.shape[1], basis.shape[1]))
        for some, given, volumes in self._parts():
            soft = 0.5 / np.abs(given[..., stiff].mean(axis=-1)) - given[..., rows[-1]]
            found[some] = np.einsum("mq,qc,qd->mcd", soft * volumes, basis, basis)
        return found

    def stabilising_energy(self) -> float:
        """The energy [N mm] that stabilises the pressure in this rank's cells; 0 for elements without stabilisation."""
        if self.projection is None:
            return 0.0
        values = self.function.x.array[self.unknowns[:, 3 * self.nodes :]]
        return -float(np.einsum("mc,mcd,md->", values, self.projection, values)) / 2

    def _projection(self) -> Floats:
        """Minus the second derivative (m, p, p) [mm3/MPa], at rest, of the energy described at ``body.is_stabilised``."""
        rows, basis = self._diagonal(), self._pressures()
        shear = [rows[i * self.form.kinds + k] for i in range(3) for k in range(3) if i != k]
        found = np.empty((self.count, basis.shape[1], basis.shape[1]))
        for some, given, volumes in self._parts():
            modulus, mean = np.abs(given[..., shear].mean(axis=(1, 2))), volumes @ basis
            within = mean[:, :, None] * mean[:, None] / volumes.sum(axis=1)[:, None, None]
            mass = np.einsum("mq,qc,qd->mcd", volumes, basis, basis)
            soft = np.divide(0.5, modulus, out=np.zeros_like(modulus), where=modulus > 0)
            found[some] = soft[:, None, None] * (mass - within)
        return found

    def _diagonal(self) -> list[int]:
        """The indices of the diagonal second derivatives among the derivatives at a point."""
        count = 3 * self.form.kinds + 1
        return [count + v * count - v * (v - 1) // 2 for v in range(count)]

    def _pressures(self) -> Floats:
        """The values (q, p) of the basis of the pressure at the quadrature points."""
        return self.kept[4].reshape(-1, self.unknowns.shape[1] - 3 * self.nodes)

    def _parts(self) -> Iterator[tuple[slice, Floats, Floats]]:
        """For each chunk: the cells, the first and second derivatives (m, q, v) of the energy, and the volumes (m, q) [mm3]."""
        for some in self._chunks():
            cells = np.arange(some.start, some.stop, dtype=np.int32)
            slopes = np.einsum("mgi,qgr->mqir", self.corners[some], self.kept[1])
            yield (
                some,
                self.form.derivatives.second.eval(self.mesh, cells),
                np.abs(np.linalg.det(slopes)) * self.kept[0],
            )

    def _chunks(self) -> list[slice]:
        return [slice(first, min(first + _CHUNK, self.count)) for first in range(0, self.count, _CHUNK)]


def _without_pressure(values: Floats, others: int) -> Floats:
    """Eliminate the pressure from the derivatives ``values`` (..., v), which are the first derivatives followed by
    the upper triangle of the second derivatives.

    The pressure then follows the volume at each point: the volumetric stiffness K cof F x cof F replaces the coupling terms.
    ``others``: the number of variables other than the pressure.
    """
    values, (rows, columns) = values.copy(), np.triu_indices(others + 1)
    second, last = values[..., others + 1 :], columns == others
    coupling, softness = second[..., last][..., :-1], second[..., -1:]
    kept = np.flatnonzero(~last)
    second[..., kept] -= coupling[..., rows[kept]] * coupling[..., columns[kept]] / softness
    second[..., np.flatnonzero(last)[:-1]] = 0.0
    return values


def _address(array: NDArray[Any]) -> ctypes.c_void_p:
    assert array.flags.c_contiguous
    return ctypes.c_void_p(array.ctypes.data)


def _tables(element: str, msh: Any, rule: tuple[Floats, Floats]) -> dict[str, Floats]:
    """The tables of an ``element`` for ``cells.c``, evaluated at the points of a quadrature ``rule`` (points and weights)."""
    kind, degree, pressure = ELEMENTS[element]
    points, weights = rule
    displaced = lagrange(kind, degree).tabulate(1, points)[..., 0]
    shape = lagrange(kind, msh.geometry.cmap.degree).tabulate(1, points)[1:, :, :, 0]
    pressures = np.full((len(points), 1), float(pressure == 0))  # a constant pressure in the cell, or none
    if pressure:
        pressures = lagrange(kind, pressure).tabulate(0, points)[0, :, :, 0]
    return {
        "weights": np.asarray(weights),
        "shape": np.moveaxis(shape, 0, -1),
        "slopes": np.moveaxis(displaced[1:], 0, -1),
        "values": displaced[0],
        "pressures": pressures,
    }
