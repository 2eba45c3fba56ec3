"""Cells in eight parts: they fill the same, share the points of the coarser ones, and keep regions, fibres and skins."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.effects import make
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.geometry.skins import Skin
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, ByCell, Cells, Prescribed, outer_facets
from fem_reference.problems.checks import check
from fem_reference.problems.contact import ContactLaw
from fem_reference.problems.finer import finer

SIZE = (10.0, 20.0, 30.0)
KINDS = pytest.mark.parametrize("kind", ["tetrahedron", "hexahedron"])
DEGREES = pytest.mark.parametrize("degree", [1, 2])


def body_of(mesh: Cells, **more) -> Body:
    still = Prescribed("still", "z0", (0, 1, 2), lambda points, _: 0 * points)
    effects = more.pop("effects", (make("neo_hooke", mu=0.01), make("incompressible_penalty", bulk=1.0)))
    return Body(mesh, effects, (still,), (0.0, 1.0), **more)


def order(points: np.ndarray) -> np.ndarray:
    return points[np.lexsort(np.round(points, 9).T)]


@KINDS
@DEGREES
def test_a_box_becomes_the_box_of_twice_as_many_cells_along_its_edges(kind, degree) -> None:
    body = body_of(shapes.box((2, 1, 2), SIZE, kind, degree))
    fine, shared = finer(body)
    wanted = shapes.box((4, 2, 4), SIZE, kind, degree)
    assert fine.mesh.cells.shape == wanted.cells.shape
    assert_allclose(order(fine.mesh.points), order(wanted.points), atol=1e-12)  # rounding of 30 mm
    assert np.array_equal(fine.mesh.points[shared], body.mesh.points)
    check(fine, {"tetrahedron": "P2", "hexahedron": "Q2"}[kind])  # its regions are facets of one cell each
    for name, facets in wanted.facets.items():
        middles = fine.mesh.points[fine.mesh.facets[name]].mean(axis=1)
        if kind == "hexahedron":
            assert_allclose(order(middles), order(wanted.points[facets].mean(axis=1)), atol=1e-12)
        axis, end = "xyz".index(name[0]), int(name[1])
        assert len(middles) == len(facets)
        assert_allclose(middles[:, axis], end * SIZE[axis], atol=1e-12)
    assert len(outer_facets(fine.mesh)[0]) == sum(map(len, fine.mesh.facets.values()))


def test_parts_of_tetrahedra_are_upright_and_fill_them() -> None:
    mesh = shapes.warped_box((2, 2, 2), SIZE, "tetrahedron")
    parts = finer(body_of(mesh))[0].mesh
    volumes = tet_volumes(parts.points, parts.cells).reshape(-1, 8)
    assert_allclose(volumes, tet_volumes(mesh.points, mesh.cells)[:, None] / 8 * np.ones(8), rtol=1e-9)


@KINDS
def test_parts_of_curved_cells_lie_on_them(kind) -> None:
    """Quadratic maps of the unit cube are followed exactly by quadratic cells: whatever they are cut into."""

    def place(unit):
        return np.column_stack([unit[:, 0] + 0.2 * unit[:, 1] ** 2, unit[:, 1], unit[:, 2] * (1 + 0.1 * unit[:, 0])])

    faces = {"z0": "z0"}
    coarse, fine = (shapes.mapped([shapes.Brick(place, (n, n, n), faces)], kind, 2) for n in (1, 2))
    assert_allclose(order(finer(body_of(coarse))[0].mesh.points), order(fine.points), atol=1e-12)


def test_bodies_that_only_touch_stay_two() -> None:
    """Two boxes with a face at the same place and no node in common."""
    one = shapes.box((1, 1, 1), SIZE, "hexahedron")
    points = np.concatenate([one.points, one.points + [0, 0, SIZE[2]]])
    two = Cells(points, np.concatenate([one.cells, one.cells + 8]), "hexahedron", 1, {"z0": one.facets["z0"]})
    assert len(finer(body_of(two))[0].mesh.points) == 2 * 27


def test_fibres_and_skins_are_where_they_were() -> None:
    mesh = shapes.box((2, 2, 2), SIZE, "tetrahedron")
    random = np.random.default_rng(0)
    vectors, shares = random.normal(size=(48, 3)), random.dirichlet(np.ones(4), size=48)
    points = np.einsum("nc,ncd->nd", shares, mesh.points[mesh.cells])
    skin = Skin(np.arange(48), points, np.ones(48))
    springs = Prescribed("skin", skin, (0,), lambda points, _: 0 * points, stiffness=1.0)
    body = Body(mesh, (), (springs,), (0.0, 1.0), fibre=ByCell(vectors), contact=ContactLaw(skin, 1.0, 0.1))
    fine, _ = finer(body)
    (moved,) = fine.prescribed
    assert moved.on.cells.tolist() == fine.contact.on.cells.tolist()
    assert np.array_equal(fine.fibre(moved.on.cells, points), vectors), "each point keeps the cell that it is in"
    corners = fine.mesh.points[fine.mesh.cells[moved.on.cells]]
    inside = np.linalg.solve(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2), (points - corners[:, 0])[..., None])
    assert inside.min() > -1e-9
    assert inside.sum(axis=1).max() < 1 + 1e-9
