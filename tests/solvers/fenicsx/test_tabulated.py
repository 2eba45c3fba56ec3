"""Positions and volumes of cells from tables of basis functions are those of the mesh."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.problems import shapes
from fem_reference.solvers.fenicsx import meshes, quadrature, tabulated, validity

# What DOLFINx 0.11 has in their place, 0.10 has not.
pytestmark = pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")
SIZE = (3.0, 2.0, 1.0)


@pytest.mark.parametrize("degree", [2, 4, 6])
@pytest.mark.parametrize(("kind", "element"), [("tetrahedron", "P2"), ("hexahedron", "Q2")])
def test_the_volumes_of_all_points_are_that_of_the_body(kind, element, degree) -> None:
    msh = meshes.distribute(MPI.COMM_SELF, shapes.box((3, 2, 1), SIZE, kind))
    count = msh.topology.index_map(3).size_local
    rule = quadrature.rule(element, degree)
    volumes, centres = validity.volumes_and_centres(msh, count, rule)
    places, slopes = tabulated.geometry(msh, rule[0], slice(count))
    assert volumes.sum() == pytest.approx(np.prod(SIZE), rel=1e-12)
    assert_allclose(volumes.sum(axis=1) @ centres / volumes.sum(), np.array(SIZE) / 2, atol=1e-12)
    # A rule of degree 2 has the second moment of the body: x^2 over a box.
    assert (volumes * places[:, :, 0] ** 2).sum() == pytest.approx(SIZE[0] ** 3 / 3 * SIZE[1] * SIZE[2], rel=1e-12)
    assert slopes.shape == (count, len(rule[1]), 3, 3)
