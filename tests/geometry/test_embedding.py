"""Embedding: every point lands in a tet that contains it, round-off or not, and linear functions come out exact."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import TetMesh
from fem_reference.geometry.embedding import Locator, embed

HIP = np.array([146.0, 238.0, -431.0])  # [mm]


def _block() -> TetMesh:
    return shapes.box((3, 3, 3), (30.0, 30.0, 30.0))


def _turned(mesh: TetMesh, seed: int) -> TetMesh:
    """The mesh turned at random and moved to where the hip's coordinates are."""
    turn = Rotation.random(rng=np.random.default_rng(seed))
    return TetMesh(turn.apply(mesh.points) + HIP, mesh.tets)


def _affine(points: np.ndarray) -> np.ndarray:
    slope = np.array([[1.2, -0.3, 0.1], [0.4, 0.8, -0.2], [0.0, 0.5, 1.1]])
    return points @ slope.T + (3, -2, 1)


def test_points_of_the_mesh_lie_in_tets_that_have_them() -> None:
    mesh = _turned(_block(), 1)
    found = embed(mesh, mesh.points)
    assert (mesh.tets[found.tets] == np.arange(len(mesh.points))[:, None]).any(axis=1).all()
    assert_array_equal(found.outside, 0)


@pytest.mark.parametrize("seed", range(10))
def test_points_on_faces_and_edges_do_not_fall_through(seed: int) -> None:
    mesh = _turned(_block(), seed)
    corners = mesh.points[mesh.tets]
    points = np.concatenate([corners[:, :k].mean(axis=1) for k in (2, 3, 4)])
    found = embed(mesh, points)
    # Round-off of coordinates near 500 mm in tets of 10 mm leaves 1e-14 relative; the nudge of 1e-9 diagonals 1e-8.
    assert_array_equal(found.outside, 0)
    assert found.barycentric.min() > -1e-7


def test_linear_functions_are_exact_inside_and_outside() -> None:
    mesh = _turned(_block(), 2)
    rng = np.random.default_rng(3)
    points = mesh.points.mean(axis=0) + rng.uniform(-25, 25, (500, 3))
    found = embed(mesh, points)
    assert (found.outside > 0).any()
    assert (found.outside == 0).any()
    # 1e-12 of the largest coordinate: barycentric coordinates up to 5 outside, times round-off.
    assert_allclose(found.interpolate(mesh, _affine(mesh.points)), _affine(points), rtol=0, atol=1e-12 * 1000)
    assert_allclose(found.interpolate(mesh, mesh.points @ (1.0, 2.0, 3.0)), points @ (1.0, 2.0, 3.0), rtol=0, atol=1e-9)


def test_inside_is_inside_and_outside_has_a_distance() -> None:
    mesh = _block()
    found = embed(mesh, np.array([[1.0, 2.0, 3.0], [15.0, 15.0, -2.0], [33.0, 34.0, 15.0]]))
    assert_allclose(found.outside, [0, 2, 5], rtol=0, atol=1e-12)  # behind a face; off an edge, a 3-4-5 triangle
    assert found.barycentric[0].min() >= 0
    assert found.barycentric[1].min() < 0


def test_nothing_in_nothing_out() -> None:
    assert len(Locator(_block()).embed(np.zeros((0, 3))).tets) == 0


def test_round_off_does_not_choose_between_tets_outside_an_edge() -> None:
    # Beyond an edge or a corner of the box two or more boundary triangles are equally close; their tets extrapolate differently.
    mesh = _block()
    points = np.array(
        [[x, y, z] for x in (-2.0, 5.0, 10.0, 32.0) for y in (-3.0, 10.0, 31.0) for z in (-1.0, 20.0, 34.0)]
    )
    chosen = embed(mesh, points).tets
    for seed in range(5):
        turn = Rotation.random(random_state=seed).as_matrix()
        turned = TetMesh(mesh.points @ turn.T + HIP, mesh.tets)
        outside = embed(mesh, points).outside > 0
        assert_array_equal(embed(turned, points @ turn.T + HIP).tets[outside], chosen[outside])
