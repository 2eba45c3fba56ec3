"""Lagrange functions and rules on intervals and triangles: polynomials are met exactly, and the L2 norm has closed forms."""

import numpy as np
import pytest

from fem_reference.geometry.field_mesh import FieldMesh, refined
from fem_reference.geometry.lagrange import functions, l2_distance, nodes, rule

ROD = FieldMesh(np.array([[0.0], [0.25], [1.0]]), np.array([[0, 1], [1, 2]]))
PLATE = FieldMesh(np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]))
SHEET = FieldMesh(np.pad(PLATE.points @ [[0.6, 0.8], [-0.8, 0.6]], ((0, 0), (0, 1))), PLATE.cells)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("corners", [2, 3])
def test_functions_are_one_at_their_own_node_and_zero_at_others(corners: int, order: int) -> None:
    ends = np.eye(corners)
    middles = (ends + np.roll(ends, -1, axis=0))[: 1 if corners == 2 else 3] / 2
    places = ends if order == 1 else np.concatenate([ends, middles])
    assert functions(places, order) == pytest.approx(np.eye(len(places)), abs=1e-15)
    barycentric, _ = rule(corners)
    assert functions(barycentric, order).sum(axis=1) == pytest.approx(1, rel=1e-14)


@pytest.mark.parametrize("mesh", [ROD, PLATE, SHEET])
def test_nodes_of_cells_are_where_their_functions_are(mesh: FieldMesh) -> None:
    ends = mesh.points[mesh.cells]
    middles = ((ends + np.roll(ends, -1, axis=1)) / 2)[:, : 1 if mesh.cells.shape[1] == 2 else 3]
    assert mesh.nodes[2][nodes(mesh, 2)] == pytest.approx(np.concatenate([ends, middles], axis=1))
    assert np.array_equal(nodes(mesh, 1), mesh.cells)


@pytest.mark.parametrize("mesh", [ROD, PLATE, SHEET])
@pytest.mark.parametrize("order", [1, 2])
def test_polynomials_of_the_order_are_met(mesh: FieldMesh, order: int) -> None:
    assert l2_distance(mesh, mesh.nodes[order][:, 0] ** order, lambda x: x[:, 0] ** order) == pytest.approx(
        0, abs=1e-14
    )


def test_the_distance_of_a_parabola_from_its_chord() -> None:
    # x^2 less its chord on an interval of length h is x (h - x) there: its square integrates to h^5 / 30.
    wanted = np.sqrt((0.25**5 + 0.75**5) / 30)
    assert l2_distance(ROD, ROD.points[:, 0] ** 2, lambda x: x[:, 0] ** 2) == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize("order", [1, 2])
def test_refinement_divides_the_distance_by_two_to_the_order_plus_one(order: int) -> None:
    def wave(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(x[:, 0]) * np.exp(x[:, -1]))

    meshes = [PLATE]
    for _ in range(4):
        meshes.append(refined(meshes[-1]))
    coarse, fine = (l2_distance(mesh, wave(mesh.nodes[order]), wave) for mesh in meshes[-2:])
    assert coarse / fine == pytest.approx(2 ** (order + 1), rel=0.02)
