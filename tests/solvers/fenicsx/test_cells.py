"""Sums over cells: what stabilises a pressure of the displacement's degree."""

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse import csr_array

from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.solvers.fenicsx import BodySettings, meshes
from fem_reference.solvers.fenicsx.cells import CellSums, Tangent
from fem_reference.solvers.fenicsx.forms import Form

# What DOLFINx 0.11 has in their place, 0.10 has not.
pytestmark = pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")
MU = 0.01  # MPa


def sums(mesh: Cells, element: str, bulk: float = 10.0) -> CellSums:
    """Of a body of nearly incompressible material."""
    acting = make("neo_hooke", mu=MU), make("incompressible", bulk=bulk)
    there = meshes.distribute(MPI.COMM_SELF, mesh)
    unknowns, cells = meshes.unknowns(there, element), np.asarray(there.topology.original_cell_index, np.int64)
    body = Body(mesh, acting, (), (0.0, 1.0))
    return CellSums(Form(there, body, unknowns, BodySettings(element=element), cells))


def test_what_stabilises_a_pressure_is_its_variance_in_each_cell() -> None:
    """Of linear functions with values p_a at the corners of a tetrahedron of volume V the integral of (p - mean p)^2 is V / 20
    times the sum of (p_a - mean p)^2, as its mass matrix is V / 20 (1 + delta).
    """
    mesh = shapes.warped_box((2, 2, 1), (2.0, 3.0, 4.0), "tetrahedron", 1, 0.1)
    cells = sums(mesh, "P1/P1")
    assert cells.projection is not None
    names, own = cells.unknowns[:, 12:], cells.function.x.array
    own[names] = 3.0
    assert (
        abs(cells.stabilising_energy()) < 1e-11
    )  # rounding of terms of 9 / (4 MU) N mm per mm3, which are 5400 N mm in all
    own[np.unique(names)] = np.random.default_rng(0).normal(size=len(np.unique(names)))
    volumes = np.abs(np.linalg.det(cells.corners[:, 1:] - cells.corners[:, :1])) / 6
    aside = own[names] - own[names].mean(axis=1, keepdims=True)
    variance = (volumes / 20 * (aside**2).sum(axis=1)).sum()
    assert cells.stabilising_energy() == pytest.approx(-variance / (4 * MU), rel=1e-12)


def tangent(cells: CellSums, unit: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """The tangent (n, n), with pressures in a ``unit``, and what is out of balance (n,)."""
    structure, residual = cells.structure(), np.zeros(cells.size)
    into = Tangent(np.zeros(len(structure.columns) + 1), cells.places(structure, np.zeros(cells.size, bool)), unit)
    cells.add(residual, into)
    parts = (into.entries[:-1], structure.columns, structure.starts)
    return csr_array(parts, shape=(cells.size, cells.size)).toarray(), residual


def test_the_tangent_is_the_slope_of_the_residual_with_stabilised_pressures_in_any_unit() -> None:
    cells, unit, step = sums(shapes.warped_box((1, 1, 1), (2.0, 3.0, 4.0), "tetrahedron", 1, 0.1), "P1/P1"), 7.0, 1e-6
    random, own = np.random.default_rng(1), cells.function.x.array
    pressures = np.isin(np.arange(cells.size), cells.unknowns[:, 12:])
    now = random.normal(scale=np.where(pressures, MU, 0.05))
    scale = np.where(pressures, unit, 1.0)
    own[:] = now
    found, _ = tangent(cells, unit)
    slope = np.empty_like(found)
    for i in range(cells.size):
        ends = np.zeros((2, cells.size))
        for end, sign in zip(ends, (1, -1), strict=True):
            own[:] = now
            own[i] += sign * step
            cells.add(end)
        slope[:, i] = (ends[0] - ends[1]) / (2 * step) * scale * scale[i]
    assert (
        np.abs(found - slope).max() < 1e-8 * np.abs(found).max()
    )  # central differences: step^2, and rounding over step


def test_no_pressure_but_a_constant_one_is_free_in_a_body_that_is_clamped_all_around() -> None:
    """Of 27 cubes of six tetrahedra 8 vertices may move: 24 displacements cannot feel 64 pressures, of which 40 or more are free to
    oscillate. Where they are stabilised, each but the constant one has an energy of the order of its mass over 2 mu (the body is
    incompressible but for 1e-9 of mu).
    """
    mesh = shapes.box((3, 3, 3), (3.0, 3.0, 3.0), "tetrahedron")
    cells = sums(mesh, "P1/P1", bulk=MU * 1e9)
    corners = cells.corners.reshape(-1, 3)
    inside = ((corners > 1e-9) & (corners < 3 - 1e-9)).all(axis=1).reshape(cells.corners.shape[:2])
    free = np.unique(np.concatenate([cells.unknowns[:, 4 * i : 4 * i + 4][inside] for i in range(3)]))
    pressures = np.unique(cells.unknowns[:, 12:])
    assert (len(free), len(pressures)) == (24, 64)
    mass = np.zeros((cells.size, cells.size))
    volumes = np.abs(np.linalg.det(cells.corners[:, 1:] - cells.corners[:, :1])) / 6
    for names, volume in zip(cells.unknowns[:, 12:], volumes, strict=True):
        mass[np.ix_(names, names)] += volume / 20 * (1 + np.eye(4))

    def energies() -> np.ndarray:
        whole, _ = tangent(cells)
        stiffness, coupling = whole[np.ix_(free, free)], whole[np.ix_(free, pressures)]
        given = coupling.T @ np.linalg.solve(stiffness, coupling) - whole[np.ix_(pressures, pressures)]
        return np.asarray(eigh(given, mass[np.ix_(pressures, pressures)] / (2 * MU), eigvals_only=True))

    stabilised = energies()
    assert abs(stabilised[0]) < 1e-6 < 0.1 < stabilised[1]
    cells.projection = None
    assert np.sum(np.abs(energies()) < 1e-6) >= 40


def test_other_elements_need_nothing() -> None:
    cells = sums(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), "P2/P1")
    assert cells.projection is None
    assert cells.stabilising_energy() == 0
