"""Meshes: numbers of nodes and cells change nothing, the rule with vertices is exact where it says so, and tabulated positions and
volumes are those of the mesh.
"""

import itertools
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.problems import shapes
from fem_reference.problems.body import Cells, reference_nodes
from fem_reference.problems.paths import Turn
from fem_reference.solvers.fenicsx import meshes, validity
from tests.solvers.fenicsx.test_body import BOTH, box, settings, turned

# What DOLFINx 0.11 has in their place, 0.10 has not.
pytestmark = pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")
SIZE = (3.0, 2.0, 1.0)


@pytest.mark.parametrize("degree", [2, 4, 6])
@pytest.mark.parametrize(("kind", "element"), [("tetrahedron", "P2"), ("hexahedron", "Q2")])
def test_the_volumes_of_all_points_are_that_of_the_body(kind, element, degree) -> None:
    msh = meshes.distribute(MPI.COMM_SELF, shapes.box((3, 2, 1), SIZE, kind))
    count = msh.topology.index_map(3).size_local
    rule = meshes.rule(element, degree)
    volumes, centres = validity.volumes_and_centres(msh, count, rule)
    places, slopes = meshes.geometry(msh, rule[0], slice(count))
    assert volumes.sum() == pytest.approx(np.prod(SIZE), rel=1e-12)
    assert_allclose(volumes.sum(axis=1) @ centres / volumes.sum(), np.array(SIZE) / 2, atol=1e-12)
    # A rule of degree 2 has the second moment of the body: x^2 over a box.
    assert (volumes * places[:, :, 0] ** 2).sum() == pytest.approx(SIZE[0] ** 3 / 3 * SIZE[1] * SIZE[2], rel=1e-12)
    assert slopes.shape == (count, len(rule[1]), 3, 3)


@pytest.mark.parametrize("powers", [p for p in itertools.product(range(6), repeat=3) if sum(p) <= 5])
def test_exact_to_degree_five(powers) -> None:
    # The integral of x^i y^j z^k over the unit tetrahedron is i! j! k! / (i + j + k + 3)!.
    points, weights = meshes.with_vertices()
    exact = math.prod(map(math.factorial, powers)) / math.factorial(sum(powers) + 3)
    assert weights @ np.prod(points ** np.array(powers), axis=1) == pytest.approx(exact, abs=1e-16)


def test_inside_positive_and_with_the_vertices() -> None:
    points, weights = meshes.with_vertices()
    barycentric = np.column_stack([1 - points.sum(axis=1), points])
    assert barycentric.min() >= 0
    assert weights.min() > 0
    assert points[:4] == pytest.approx(reference_nodes("tetrahedron", 1))


@pytest.mark.parametrize(("element", "degree"), [("P1", None), ("P2/P1", 8), ("Q2/Q1", None), ("Q1/P0", 7)])
def test_other_rules_are_those_of_the_shelf(element, degree) -> None:
    _, weights = meshes.rule(element, degree)
    assert weights.sum() == pytest.approx(1 / 6 if element.startswith("P") else 1, abs=1e-14)
    assert len(weights) == {"P1": 4, "P2/P1": 45, "Q2/Q1": 27, "Q1/P0": 64}[element]


def test_quadratic_tetrahedra_take_it() -> None:
    for element in ("P2", "P2/P1", "P2/P0"):
        assert len(meshes.rule(element, None)[1]) == 18


@pytest.mark.slow
@BOTH
def test_the_order_of_nodes_and_cells_does_not_matter(element, session) -> None:
    mesh, random = box(element, (1, 2, 2)), np.random.default_rng(4)
    new = random.permutation(len(mesh.points))  # where each node goes
    points = np.empty_like(mesh.points)
    points[new] = mesh.points
    cells = new[mesh.cells][random.permutation(len(mesh.cells))]
    facets = {name: new[region] for name, region in mesh.facets.items()}
    other = Cells(points, cells, mesh.kind, mesh.degree, facets)
    turn = Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 1.0))
    first, second = (session.solve(turned(one, turn), settings(element)).last for one in (mesh, other))
    # Both end within Newton's residual of 1e-12 N, over a stiffness of 1e-3 N/mm.
    assert second.points[new] == pytest.approx(first.points, abs=1e-9)
    assert second.forces["top"] == pytest.approx(first.forces["top"], abs=1e-10)
