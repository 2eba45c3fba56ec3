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
    assert place.point[:, axis] == pytest.approx(np.full(len(which), end), abs=1e-15)
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


@pytest.mark.parametrize("element", ["P1/P1", "P2/P1", "Q1/P0", "Q2/Q1"])
def test_points_that_are_said_to_keep_away_from_facets_never_touch_them(element) -> None:
    # Against the distances [mm] at 20 times to places on facets of 0.5 mm, 1/35 of it apart: what touches is within 0.01 of one.
    found, draw = facets(element, "z1"), np.random.default_rng(1)
    old = found.rest + 0.05 * draw.normal(size=found.rest.shape)
    n, share = 400, np.linspace(0, 1, 36)
    which = draw.integers(len(old), size=n)
    starts = found.places(old, which, draw.uniform(0.1, 0.4, (n, 2))).point
    starts += [0, 0, 0.2] * draw.uniform(0.1, 1.5, (n, 1))
    shift = draw.normal(size=3)  # what both do does not matter
    new, ends = old + shift + 0.02 * draw.normal(size=old.shape), starts + shift + 0.08 * draw.normal(size=(n, 3))
    away = found.keep_away(old, new, which, np.stack([starts, ends]))
    assert 40 < away.sum() < 360
    at = np.stack(np.meshgrid(share, share), axis=-1).reshape(-1, 2)
    at = at[found.beyond(at) == 0]
    basis = found.element.tabulate(0, at)[0, :, :, 0]
    least = np.full(n, np.inf)
    for t in np.linspace(0, 1, 20):
        places = basis @ ((1 - t) * old + t * new)[which]
        points = (1 - t) * starts + t * ends
        distance = np.linalg.norm(places - points[:, None], axis=2).min(axis=1)
        least = np.minimum(least, distance)
    assert least[away].min() > 0.01
    assert least[~away].min() < 0.01
