"""Bodies on which speed is measured: they can be solved, are closed, and attached where they should be."""

import math

import numpy as np
import pytest

from benchmarks import bodies
from fem_reference.foundations.mesh import check_closed, enclosed_volume, tet_volumes
from fem_reference.problems.body import ByCell
from fem_reference.problems.checks import check


@pytest.mark.parametrize("element", ["Q1/P0", "P2/P0", "P2/P1"])
def test_the_fusiform_body_can_be_solved(element) -> None:
    body = bodies.fusiform(element, 1, 4)
    check(body, element)
    radius, z = np.linalg.norm(body.mesh.points[:, :2], axis=1), body.mesh.points[:, 2]
    thick, thin = (radius[np.isclose(z, height)].max() for height in (bodies.LENGTH / 2, 0))
    assert (thick, thin) == pytest.approx((bodies.RADIUS, (1 - bodies.THINNER) * bodies.RADIUS))
    # Along a fibre the point keeps its share of the radius.
    assert isinstance(body.fibre, ByCell)
    centres, small_step = body.mesh.points[body.mesh.cells].mean(axis=1), 1e-5
    ahead = centres + small_step * body.fibre.vectors
    shares = [np.linalg.norm(at[:, :2], axis=1) / _radius(at[:, 2]) for at in (centres, ahead)]
    assert shares[0] == pytest.approx(shares[1], abs=1e-9)


def _radius(z: np.ndarray) -> np.ndarray:
    return bodies.RADIUS * (1 - bodies.THINNER * (2 * z / bodies.LENGTH - 1) ** 2)


@pytest.mark.parametrize("subdivisions", [0, 1, 2, 3])
def test_the_ellipsoid_is_closed_and_attached(subdivisions) -> None:
    made = bodies.ellipsoid(subdivisions)
    surface = check_closed(made.surface)
    assert len(surface.triangles) == 20 * 4**subdivisions
    of_ellipsoid = 4 / 3 * math.pi * bodies.SHORT**2 * bodies.LONG
    assert enclosed_volume(surface.points, surface.triangles) < of_ellipsoid
    if subdivisions == 3:
        assert enclosed_volume(surface.points, surface.triangles) == pytest.approx(of_ellipsoid, rel=0.02)
    assert all(len(entry.vertices) for entry in made.attached)
    assert made.bones[1].pose(4) != pytest.approx(np.eye(4))
    assert all((bone.shape.sample(surface.points).distance > -1e-9).all() for bone in made.bones)


def test_the_spindle_has_tets_and_ends() -> None:
    made = bodies.spindle(1, 4)
    check_closed(made.surface)
    assert tet_volumes(made.mesh.points, made.mesh.tets).min() > 0
    for entry, end in zip(made.attached, (-1, 1), strict=True):
        z = made.surface.points[entry.vertices, 2]
        assert z == pytest.approx(np.full(len(z), end * bodies.LENGTH / 2))
        assert len(np.unique(made.mesh.facets[entry.attachment])) == len(z)
