"""Meshes of scalar fields: what they measure, how they refine, and the stabilisation that they ask for."""

import fields
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.geometry.field_mesh import (
    FieldMesh,
    barycentric_gradients,
    check,
    functions,
    l2_distance,
    nodes,
    refined,
    rule,
    share_above,
    stabilisation,
)

INTERVAL = FieldMesh([[0.0], [0.25], [1.0]], [[0, 1], [1, 2]])
SQUARE = FieldMesh([[0.0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2], [0, 2, 3]])


def sphere(subdivisions: int) -> FieldMesh:
    surface = shapes.sphere(subdivisions)
    return FieldMesh(surface.points, surface.triangles)


def test_sizes_edges_and_rim() -> None:
    assert pytest.approx([0.25, 0.75]) == INTERVAL.sizes
    assert pytest.approx([0.5, 0.5]) == SQUARE.sizes
    assert SQUARE.edges.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    assert SQUARE.facets.tolist() == [[0, 1], [0, 3], [1, 2], [2, 3]]
    assert INTERVAL.facets.tolist() == [[0], [2]]
    assert len(sphere(1).facets) == 0


@pytest.mark.parametrize("mesh", [INTERVAL, SQUARE, sphere(1)], ids=["interval", "square", "sphere"])
def test_refinement_keeps_vertices_and_size(mesh) -> None:
    fine = refined(mesh)
    assert (fine.points[: len(mesh.points)] == mesh.points).all()
    assert fine.points[len(mesh.points) :] == pytest.approx(mesh.points[mesh.edges].mean(axis=1))
    assert fine.sizes.sum() == pytest.approx(mesh.sizes.sum(), rel=1e-12)
    assert fine.sizes.max() == pytest.approx(mesh.sizes.max() / 2 ** (mesh.cells.shape[1] - 1), rel=1e-12)
    check(fine)


@pytest.mark.parametrize("mesh", [INTERVAL, SQUARE, sphere(1)], ids=["interval", "square", "sphere"])
def test_gradients_of_hat_functions(mesh) -> None:
    # Hat functions sum to 1, and along an edge of the cell one rises from 0 to 1.
    slopes, corners = barycentric_gradients(mesh), mesh.points[mesh.cells]
    assert slopes.sum(axis=1) == pytest.approx(0, abs=1e-12)
    rises = np.einsum("mid,md->mi", slopes, corners[:, 1] - corners[:, 0])
    assert rises[:, :2] == pytest.approx(np.broadcast_to([-1, 1], (len(corners), 2)), abs=1e-12)


def test_share_above_is_the_area_above() -> None:
    # The unit right triangle above y = t is similar to it by 1 - t; of all the square, 1 - t lies above.
    triangle = FieldMesh([[0.0, 0], [1, 0], [0, 1]], [[0, 1, 2]])
    upside_down = FieldMesh([[0.0, 1], [1, 1], [0, 0]], [[0, 2, 1]])
    for t in (-1.0, 0.0, 0.3, 0.9, 1.0, 2.0):
        inside = min(max(t, 0), 1)
        assert share_above(triangle, t) == pytest.approx([(1 - inside) ** 2], abs=1e-15)
        assert share_above(upside_down, t) == pytest.approx([1 - inside**2], abs=1e-15)
        assert share_above(SQUARE, t) @ SQUARE.sizes == pytest.approx(1 - inside, abs=1e-15)


@pytest.mark.parametrize("speed", [1e-6, 1.0, 1e6])
def test_stabilisation_on_an_interval_is_the_exact_one(speed) -> None:
    # tau = h / 2v (coth Pe - 1 / Pe), Pe = v h / 2k; where Pe is small, h^2 / 12k.
    k, h = 0.5, np.array([0.25, 0.75])
    peclet, tau = stabilisation(INTERVAL, k, np.array([speed]), 1)
    Pe = speed * h / (2 * k)
    assert peclet == pytest.approx(Pe.max(), rel=1e-14)
    expected = h**2 / (12 * k) if speed < 1e-3 else h / (2 * speed) * (1 / np.tanh(Pe) - 1 / Pe)
    assert tau == pytest.approx(expected, rel=1e-9)


def test_stabilisation_turns_with_the_mesh_and_does_without_flow() -> None:
    turn = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
    mesh, velocity = sphere(2), np.array([3.0, -1, 2])
    turned = FieldMesh(mesh.points @ turn.T, mesh.cells)
    one, two = stabilisation(mesh, 0.01, velocity, 1), stabilisation(turned, 0.01, turn @ velocity, 1)
    assert one[0] == pytest.approx(two[0], rel=1e-10)
    assert one[1] == pytest.approx(two[1], rel=1e-9)
    still = stabilisation(mesh, 1.0, np.zeros(3), 1)
    assert (still[0], np.abs(still[1]).max()) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("points", "cells", "match"),
    [
        ([[0.0], [np.nan]], [[0, 1]], "not a finite number"),
        ([[0.0], [1e200]], [[0, 1]], "a coordinate beyond 1e"),
        ([[0.0], [1.0]], [[0, 2]], "outside 1 to 2"),
        ([[0.0], [1.0], [2.0]], [[0, 1]], "vertex 3 in no cell"),
        ([[0.0, 0], [1, 0], [2, 0]], [[0, 1, 2]], "cell 1 of size zero"),
        (
            [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]],
            [[0, 1, 2], [0, 1, 3], [0, 1, 4]],
            "3 triangles on",
        ),
    ],
)
def test_meshes_that_are_not_usable(points, cells, match) -> None:
    with pytest.raises(InputError, match=match):
        check(FieldMesh(points, cells))


def test_the_helper_square_is_a_square(tmp_path) -> None:
    assert fields.square(tmp_path, 4) == {"mesh": {"points": "points.csv", "triangles": "triangles.csv"}}


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
