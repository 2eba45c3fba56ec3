"""Sums over cells: what stabilises a pressure of the displacement's degree."""

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.solvers.fenicsx import BodySettings, meshes
from fem_reference.solvers.fenicsx.cells import CellSums
from fem_reference.solvers.fenicsx.forms import Form

# What DOLFINx 0.11 has in their place, 0.10 has not.
pytestmark = pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")
MU = 0.01  # MPa


def sums(mesh: Cells, element: str) -> CellSums:
    """Of a body of nearly incompressible material."""
    acting = make("neo_hooke", mu=MU), make("incompressible", bulk=10.0)
    there = meshes.distribute(MPI.COMM_SELF, mesh)
    unknowns, cells = meshes.unknowns(there, element), np.asarray(there.topology.original_cell_index, np.int64)
    body = Body(mesh, acting, (), (0.0, 1.0))
    return CellSums(Form(there, body, unknowns, BodySettings(element=element), cells), unknowns, element)


def test_what_stabilises_a_pressure_is_its_variance_in_each_cell() -> None:
    """Of linear functions with values p_a at the corners of a tetrahedron of volume V the integral of (p - mean p)^2 is V / 20
    times the sum of (p_a - mean p)^2, as its mass matrix is V / 20 (1 + delta).
    """
    mesh = shapes.warped_box((2, 2, 1), (2.0, 3.0, 4.0), "tetrahedron", 1, 0.1)
    cells = sums(mesh, "P1/P1")
    assert cells.projection is not None
    names, own = cells.unknowns[:, 12:], cells.function.x.array
    own[names] = 3.0
    assert abs(cells.stabilising_energy()) < 1e-13  # of 0.5 * 9 / (2 MU) N mm per mm3
    own[np.unique(names)] = np.random.default_rng(0).normal(size=len(np.unique(names)))
    volumes = np.abs(np.linalg.det(cells.corners[:, 1:] - cells.corners[:, :1])) / 6
    aside = own[names] - own[names].mean(axis=1, keepdims=True)
    variance = (volumes / 20 * (aside**2).sum(axis=1)).sum()
    assert cells.stabilising_energy() == pytest.approx(-variance / (4 * MU), rel=1e-12)


def test_other_elements_need_nothing() -> None:
    cells = sums(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), "P2/P1")
    assert cells.projection is None
    assert cells.stabilising_energy() == 0
