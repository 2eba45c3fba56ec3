"""Facets of a deforming surface: outward normals, and nearest places on curved ones."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.problems import shapes
from fem_reference.solvers.fenicsx import meshes
from fem_reference.solvers.fenicsx.facets import Facets, facets_of


def facets(element: str, region: str) -> Facets:
    """Those of a region of a box of 1 mm, 2 cells wide."""
    kind = "hexahedron" if element.startswith("Q") else "tetrahedron"
    cells = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), kind)
    mesh = meshes.distribute(MPI.COMM_SELF, cells)
    (own,) = meshes.local_facets(mesh, [cells.facets[region]])
    return facets_of(meshes.Displacement(meshes.unknowns(mesh, element)), cells, own)


@pytest.mark.parametrize("element", ["P1/P1", "P2/P1", "Q1/P0", "Q2/Q1"])
@pytest.mark.parametrize("region", ["x0", "y1", "z0"])
def test_normals_point_outward_and_areas_add_up(element, region) -> None:
    found = facets(element, region)
    points, weights = found.rule(8)
    which = np.repeat(np.arange(len(found.dofs)), len(points))
    place = found.places(found.rest, which, np.tile(points, (len(found.dofs), 1)))
    axis, end = "xyz".index(region[0]), int(region[1])
    assert place.normal == pytest.approx(np.tile((2 * end - 1) * np.eye(3)[axis], (len(which), 1)), abs=1e-14)
    assert place.point[:, axis] == pytest.approx(np.full(len(which), end), abs=1e-14)
    areas = np.sqrt(np.linalg.det(place.metric)) * np.tile(weights, len(found.dofs))
    assert areas.sum() == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
def test_the_nearest_place_on_a_paraboloid(element) -> None:
    # Quadratic facets represent z = 1 + (x^2 + y^2) / 4 exactly. A point at a distance along its normal, less than the radius of
    # curvature of 2 mm, is nearest to where it came from.
    found = facets(element, "z1")
    nodes = np.array(found.rest)
    nodes[..., 2] = 1 + (nodes[..., 0] ** 2 + nodes[..., 1] ** 2) / 4
    at = np.array([[0.2, 0.3], [0.6, 0.1], [0.05, 0.9]])
    which = np.array([0, 1, 3])
    place = found.places(nodes, which, at)
    assert place.normal[:, 2] == pytest.approx(1 / np.sqrt(1 + (place.point[:, :2] ** 2).sum(axis=1) / 4), abs=1e-14)
    for gap in (0.3, -0.2, 0.0):
        again = found.nearest(nodes, which, place.point + gap * place.normal)
        assert again.at == pytest.approx(at, abs=1e-12)
        assert again.point == pytest.approx(place.point, abs=1e-13)
    assert not found.beyond(at).any()
    assert found.beyond(np.array([[1.25, 0.5], [-0.5, 0.5]])) == pytest.approx(
        [0.75 if element == "P2/P1" else 0.25, 0.5]
    )


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
def test_places_along_lines_through_a_paraboloid(element) -> None:
    # The paraboloid of the test above. Lines lean by up to 45 degrees; one that runs along a facet misses it.
    found = facets(element, "z1")
    nodes = np.array(found.rest)
    nodes[..., 2] = 1 + (nodes[..., 0] ** 2 + nodes[..., 1] ** 2) / 4
    at, which = np.array([[0.2, 0.3], [0.6, 0.1], [0.05, 0.9]]), np.array([0, 1, 3])
    place = found.places(nodes, which, at)
    lines = np.array([[0.0, 0.0, 1.0], [0.7, 0.0, -1.0], [-0.3, 0.6, 1.0]])
    lines /= np.linalg.norm(lines, axis=1)[:, None]
    for gap in (0.2, -0.1, 0.0):
        there, far = found.along(nodes, which, place.point - gap * lines, lines)
        assert there.at == pytest.approx(at, abs=1e-12)
        assert far == pytest.approx(np.full(3, gap), abs=1e-13)
    _, far = found.along(nodes, which[:1], np.array([[0.2, 0.2, 5.0]]), np.array([[1.0, 0.0, 0.0]]))
    assert np.isnan(far).all()


@pytest.mark.parametrize("element", ["P1/P1", "Q1/P0"])
def test_the_distance_beyond_an_edge_has_the_stated_derivative(element) -> None:
    found, at = facets(element, "z1"), np.array([[0.2, 0.3], [1.2, 0.3], [-0.2, 0.5], [0.4, -0.1], [0.3, 1.4]])
    beyond, slope = found.leaving(at)
    assert beyond == pytest.approx(found.beyond(at), abs=0)
    for axis in (0, 1):
        step = 1e-3 * np.eye(2)[axis]  # the distance is linear there
        assert (found.beyond(at + step) - found.beyond(at - step)) / 2e-3 == pytest.approx(slope[:, axis], abs=1e-12)


def test_a_search_that_does_not_converge_finds_no_place() -> None:
    # Of 40,000 pairs of bent facets and points, the method fails for some. A place on a facet is then the foot of a perpendicular.
    found, random = facets("P2/P1", "z1"), np.random.default_rng(1)
    which, nowhere = np.zeros(1000, np.int64), 0
    for _ in range(40):
        nodes = found.rest[:1] + random.normal(0, 0.25, (1, *found.rest.shape[1:]))
        points = nodes.mean(axis=1) + random.normal(0, 1.0, (1000, 3))
        place = found.nearest(nodes, which, points)
        away = points - place.point
        aside = np.linalg.norm(away - np.vecdot(away, place.normal)[:, None] * place.normal, axis=1)
        on = found.beyond(place.at) <= 0.02
        assert aside[on].max(initial=0.0) < 1e-5
        nowhere += int((place.at == 9.0).all(axis=1).sum())
    assert nowhere > 0
