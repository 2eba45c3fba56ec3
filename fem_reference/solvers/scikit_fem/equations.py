"""The equations of a body: residual and tangent are sums over energies, loads and springs, differentiated by jets."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csr_array, diags_array, eye_array, kron

from fem_reference.effects import Effect, Load, State, total_energy
from fem_reference.foundations.jets import JET_FUNCTIONS, Jet, constant, variables
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import Body, Prescribed, is_stabilised
from fem_reference.solvers.scikit_fem.spaces import DISPLACEMENT, PRESSURE, VARIABLES, Points, Space

# The quadrature degree for each displacement element: exact on a straight cell for an energy that is quadratic in the strain.
QUADRATURE_DEGREE = {"P1": 2, "P2": 4, "Q1": 3, "Q2": 5}
_AT_ONCE = 1024  # the number of points that are evaluated together, so that their jets fit into a cache

Acting = list[tuple[Effect, float]]
# A function of p points, their n variables and a frame. It returns first (n, p) and second (n, n, p) derivatives of the work.
Law = Callable[[Points, list[Any], float], tuple[Floats, Floats]]


@dataclass(frozen=True, eq=False)
class _Part:
    """A term of the equations: a ``law`` at ``points``. ``felt``: the indices of the variables on which the law depends."""

    points: Points
    law: Law
    felt: list[int]


class Equations:
    """The equations of ``body`` in the unknowns of ``space``."""

    def __init__(self, body: Body, element: str, quadrature_degree: int | None) -> None:
        self.body, self.space = body, Space(body.mesh, element, quadrature_degree or QUADRATURE_DEGREE[element[:2]])
        inside = self.space.inside
        if body.fibre is not None and any("fibre" in effect.needs for effect in body.effects):
            cells, places = np.repeat(inside.cells, inside.places.shape[1]), inside.places.reshape(-1, 3)
            inside = replace(inside, fibre=body.fibre(cells, places).reshape(inside.places.shape))
        self.inside = inside
        self.parts = [_Part(inside, self._energy_law, self._felt())]
        loads = [effect for effect in body.effects if isinstance(effect, Load)]
        everything, surface = list(range(VARIABLES)), self.space.surface
        self.parts += [_Part(surface(load.on), partial(_load_law, load), everything) for load in loads]
        self.springs = [
            _Part(surface(str(entry.on)), partial(_spring_law, entry), everything)
            for entry in body.prescribed
            if entry.stiffness is not None
        ]
        self.stabilising = self._projection() if is_stabilised(element) else None

    def assembled(self, unknowns: Floats, frame: float, springs: bool = True) -> tuple[Floats, Any]:
        """The residual (N,) [N, mm3] and the tangent (N, N); ``springs``: include the forces of springs."""
        residual = np.zeros(len(unknowns))
        blocks = []
        for part in self.parts + (self.springs if springs else []):
            for points in _chunks(part.points):
                forces, stiffness = _of_cells(part, points, unknowns, frame)
                np.add.at(residual, points.dofs, forces)
                rows, columns = np.broadcast_arrays(points.dofs[:, :, None], points.dofs[:, None, :])
                blocks.append((stiffness.ravel(), rows.ravel(), columns.ravel()))
        values, rows, columns = (np.concatenate(entries) for entries in zip(*blocks, strict=True))
        matrix = coo_array((values, (rows, columns)), shape=(len(unknowns),) * 2).tocsr()
        if self.stabilising is not None:
            residual, matrix = residual - self.stabilising @ unknowns, matrix - self.stabilising
        return residual, matrix

    def smallest_determinants(self, unknowns: Floats) -> tuple[float, float]:
        """The smallest det F at quadrature points, and the smallest det F at vertices of cells; NaN if some det F is NaN."""
        inside, vertices = (_determinant(points, unknowns).min() for points in (self.inside, self.space.vertices))
        return float(inside), float(vertices)

    def volume_ratio(self, unknowns: Floats) -> float:
        """The volume of the body divided by its volume at rest."""
        return float((_determinant(self.inside, unknowns) * self.inside.weights).sum() / self.inside.weights.sum())

    def energy(self, unknowns: Floats, frame: float) -> float:
        """The stored energy [N mm]."""
        values = np.moveaxis(self.inside.variables(unknowns), -1, 0)
        energy = total_energy(self._acting(frame), self._at(self.inside, list(values), self.inside.fibre))
        stabilising = 0.0 if self.stabilising is None else unknowns @ (self.stabilising @ unknowns) / 2
        return float((energy * self.inside.weights).sum() - stabilising)

    def _projection(self) -> Any:
        """The matrix (N, N) of the negative of the stabilising energy, which ``body.is_stabilised`` describes.

        The matrix is M - B^T D^-1 B. M is the mass matrix of the pressure, D that of constants in each cell, and B the mass matrix
        that couples these constants and the pressure; all are divided by twice the shear modulus.
        """
        inside, entries = self.inside, self.inside.variables(np.zeros(self.space.size)).reshape(-1, VARIABLES)
        _, curvature = self._energy_law(inside, variables(entries.T), self.body.frames[0])
        shear = np.mean([curvature[v, v] for v in range(9) if v % 4], axis=0).reshape(inside.weights.shape).mean(axis=1)
        names = inside.dofs[:, -inside.pressures.shape[2] :]
        cells, points = inside.weights.shape
        shape = (cells * points, self.space.size)
        rows = np.repeat(np.arange(shape[0]), names.shape[1])
        values = (inside.pressures.ravel(), (rows, np.repeat(names, points, axis=0).ravel()))
        basis = csr_array(coo_array(values, shape=shape))
        gather = csr_array(kron(eye_array(cells), np.ones((1, points))))
        soft = np.divide(0.5, np.abs(shear), out=np.zeros_like(shear), where=shear != 0)
        volumes = inside.weights.ravel()
        between = gather @ diags_array(volumes) @ basis
        mass = basis.T @ diags_array(volumes * np.repeat(soft, points)) @ basis
        return mass - between.T @ diags_array(soft / (gather @ volumes)) @ between

    def _acting(self, frame: float) -> Acting:
        return [(effect, effect.amount(frame)) for effect in self.body.effects]

    def _felt(self) -> list[int]:
        """The indices of the variables on which energies depend; the displacement, which is costly, is seldom among them."""
        deformed = np.append(np.eye(3).ravel(), np.ones(4)) + 0.1 * np.sin(np.arange(VARIABLES))
        jets = variables(deformed[:, None])
        fibre = None if self.inside.fibre is None else self.inside.fibre[:1, 0]
        everywhere = replace(_state(jets, fibre), regions=dict.fromkeys(self.body.regions, 0.5))
        energy = total_energy([(effect, 1.0) for effect in self.body.effects], everywhere)
        felt = list(range(9)) + ([] if self.space.pressure is None else [PRESSURE])
        if not isinstance(energy, Jet):
            return felt
        needed = energy.slope[DISPLACEMENT].any() or energy.curvature[DISPLACEMENT].any()
        return list(range(12)) + felt[9:] if needed else felt

    def _energy_law(self, points: Points, jets: list[Any], frame: float) -> tuple[Floats, Floats]:
        fibre = None if points.fibre is None else points.fibre.reshape(-1, 3)
        energy = _jet(total_energy(self._acting(frame), self._at(points, jets, fibre)), jets[0])
        return energy.slope, energy.curvature

    def _at(self, points: Points, entries: list[Any], fibre: Floats | None) -> State:
        """The state of ``points``, with their 13 variables as ``entries``.

        The shares of regions have the shape of an entry, or are one-dimensional if entries are jets.
        """
        cells = np.repeat(points.cells, points.places.shape[1])
        shares = self.body.shares(points.places.reshape(-1, 3), cells)
        shape = np.shape(entries[0]) if isinstance(entries[0], np.ndarray) else (-1,)
        return replace(_state(entries, fibre), regions={name: one.reshape(shape) for name, one in shares.items()})


def _of_cells(part: _Part, points: Points, unknowns: Floats, frame: float) -> tuple[Floats, Floats]:
    """The forces (m, d) and the stiffness (m, d, d) of m cells with d unknowns each."""
    (m, q), n = points.weights.shape, len(part.felt)
    values: list[Any] = list(points.variables(unknowns).reshape(-1, VARIABLES).T)
    for place, jet in zip(part.felt, variables(np.stack([values[i] for i in part.felt])), strict=True):
        values[place] = jet
    slope, curvature = part.law(points, values, frame)
    slope = np.broadcast_to(slope, (n, m * q)).T.reshape(m, q * n, 1)
    curvature = np.ascontiguousarray(np.moveaxis(np.broadcast_to(curvature, (n, n, m * q)), -1, 0)).reshape(m, q, n, n)
    rates = np.ascontiguousarray(points.rates[:, :, part.felt])
    weighted = np.swapaxes((rates * points.weights[:, :, None, None]).reshape(m, q * n, -1), 1, 2)
    return (weighted @ slope)[:, :, 0], weighted @ (curvature @ rates).reshape(m, q * n, -1)


def _load_law(load: Load, points: Points, jets: list[Any], frame: float) -> tuple[Floats, Floats]:
    """The derivatives of the virtual work of a load, which is minus the traction times the virtual displacement."""
    assert points.normals is not None
    state = _state(jets, None, load.amount(frame))
    tractions = load.traction(state, list(points.normals.reshape(-1, 3).T))
    return _along_displacement([-_jet(entry, jets[0]) for entry in tractions])


def _spring_law(entry: Prescribed, points: Points, jets: list[Any], frame: float) -> tuple[Floats, Floats]:
    """The derivatives of the virtual work of springs that pull towards the prescribed displacement."""
    wanted, pull = entry.path(points.places.reshape(-1, 3), frame), [constant(0.0, jets[0])] * 3
    for i in entry.components:
        pull[i] = entry.stiffness * (jets[9 + i] - wanted[:, i])
    return _along_displacement(pull)


def _along_displacement(forces: Sequence[Jet]) -> tuple[Floats, Floats]:
    """The derivatives of the work of ``forces`` (3,) with respect to the variables: first (13, p), then second (13, 13, p)."""
    along = np.broadcast_shapes(*(force.value.shape for force in forces))
    slope, curvature = np.zeros((VARIABLES, *along)), np.zeros((VARIABLES, VARIABLES, *along))
    for i, force in enumerate(forces):
        slope[9 + i], curvature[9 + i] = force.value, force.slope
    return slope, curvature


def _state(entries: Sequence[Any], fibre: Floats | None, amount: float = 1.0) -> State:
    """The state with the 13 variables ``entries``."""
    return State(
        F=[entries[0:3], entries[3:6], entries[6:9]],
        displacement=entries[DISPLACEMENT],
        pressure=entries[PRESSURE],
        fibre=None if fibre is None else list(np.moveaxis(fibre, -1, 0)),
        amount=amount,
        functions=JET_FUNCTIONS,
    )


def _jet(value: Any, like: Jet) -> Jet:
    return value if isinstance(value, Jet) else constant(value, like)


def _determinant(points: Points, unknowns: Floats) -> Floats:
    F = points.variables(unknowns)[..., :9]
    return np.asarray(np.linalg.det(F.reshape(*F.shape[:2], 3, 3)))


def _chunks(points: Points) -> Iterator[Points]:
    """The points in groups, each of which has the points of a few cells."""
    m, q = points.weights.shape
    size = max(1, _AT_ONCE // q)
    return (points.part(slice(start, start + size)) for start in range(0, m, size))
