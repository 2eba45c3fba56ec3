"""Points of cells and facets: normals, weights and nodes."""

import numpy as np
import pytest

from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS
from fem_reference.solvers.scikit_fem.spaces import Space
from tests.solvers.scikit_fem.test_body import FACES


@pytest.mark.slow
@pytest.mark.parametrize(("element", "degree"), [("P2", 2), ("Q2", 2), ("Q1", 1), ("P1", 1)])
def test_normals_and_weights_satisfy_the_divergence_theorem(element, degree) -> None:
    def bent(unit):
        return unit * [2.0, 3.0, 4.0] + 0.4 * np.roll(unit, 1, axis=1) ** 2

    kind, faces = ELEMENTS[element][0], {face: face for face in FACES}
    space = Space(shapes.mapped([shapes.Brick(bent, (2, 1, 2), faces)], kind, degree), element, 8)
    # The map of a cell is of degree 6 at most in all, along each axis of degree 2 at most: 8 is exact.
    closed, flux = np.zeros(3), 0.0
    for face in FACES:
        points = space.surface(face)
        closed += (points.weights[..., None] * points.normals).sum(axis=(0, 1))
        flux += (points.weights * (points.places * points.normals).sum(axis=2)).sum()
    assert closed == pytest.approx(np.zeros(3), abs=1e-11)
    assert flux == pytest.approx(3 * space.inside.weights.sum(), rel=1e-12)


@pytest.mark.parametrize("element", ELEMENTS)
def test_nodes_of_the_displacement_are_those_of_the_mesh(element) -> None:
    kind, degree, _ = ELEMENTS[element]
    mesh = shapes.warped_box((1, 2, 1), (2.0, 3.0, 4.0), kind, degree)
    space = Space(mesh, element, 2)
    assert space.rest[space.nodes] == pytest.approx(mesh.points, abs=1e-12)
    assert sorted(space.nodes_on("y1")) == sorted(space.nodes[np.isclose(mesh.points[:, 1], 3)])
