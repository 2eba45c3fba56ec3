"""Grids of boxes cut into six tets each: they fill the box, their skins are known and nest, and another body is refused."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, boundary, check_closed, tet_qualities, tet_volumes
from fem_reference.geometry.block import fill, kuhn, lattice_skin

LOW, SIZE = np.array([-50.0, 10, -50]), (100.0, 80.0, 60.0)


def box(cells: tuple[int, int, int] = (4, 3, 2)) -> Surface:
    surface = shapes.skin(shapes.box(cells, SIZE))
    return Surface(surface.points + LOW, surface.triangles, "box.ply")


def rows(triangles: np.ndarray) -> set[tuple[int, ...]]:
    """Triangles as the set of their corners, each from its lowest, in the order it runs."""
    first = triangles.argmin(axis=1)
    return {tuple(np.roll(row, -k).tolist()) for row, k in zip(triangles, first, strict=True)}


@pytest.mark.parametrize(("size", "counts"), [(20, (5, 4, 3)), (25, (4, 3, 2)), (60, (2, 1, 1))])
def test_a_box_is_filled_with_as_many_cells_as_the_size_goes_into_it(size: float, counts: tuple[int, ...]) -> None:
    mesh = fill(box(), size)
    assert mesh.maker == "block"
    assert len(mesh.tets) == 6 * np.prod(counts)
    assert len(mesh.points) == np.prod(np.add(counts, 1))
    # Six tets of one volume in each cell.
    assert_allclose(tet_volumes(mesh.points, mesh.tets), np.prod(SIZE) / len(mesh.tets), rtol=1e-12)
    assert_allclose(mesh.points.min(axis=0), LOW)
    assert_allclose(mesh.points.max(axis=0), LOW + SIZE)
    check_closed(shapes.skin(mesh))


def test_a_tet_of_a_cube_has_the_quality_of_kuhns() -> None:
    # Volume 1/6; squares of the edges 1, 1, 1, 2, 2, 3: 12 (3 / 6)^(2/3) / 10.
    mesh = fill(box(), 20)
    assert_allclose(tet_qualities(mesh.points, mesh.tets), 1.2 * 0.5 ** (2 / 3), rtol=1e-12)


def test_a_grid_that_refines_another_nests_in_it() -> None:
    coarse, fine = fill(box(), 20), fill(box(), 10)
    small = fine.points[fine.tets]
    big = tets_around(coarse.points[coarse.tets], small.mean(axis=1))
    inverse = np.linalg.inv(np.swapaxes(big[:, 1:] - big[:, :1], 1, 2))
    shares = np.einsum("nij,nkj->nki", inverse, small - big[:, :1])
    # All four corners of each fine tet are in the one coarse tet that contains its middle.
    assert shares.min() > -1e-12
    assert shares.sum(axis=2).max() < 1 + 1e-12


def tets_around(tets: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The tet (n, 4, 3) among ``tets`` (k, 4, 3) that each of ``points`` (n, 3) is in."""
    inverse = np.linalg.inv(np.swapaxes(tets[:, 1:] - tets[:, :1], 1, 2))
    found = []
    for part in np.array_split(points, 50):
        share = np.einsum("kij,nkj->nki", inverse, part[:, None] - tets[None, :, 0])
        found.append(np.minimum(share.min(axis=2), 1 - share.sum(axis=2)).argmax(axis=1))
    return tets[np.concatenate(found)]


@pytest.mark.parametrize("counts", [(1, 1, 1), (3, 1, 2)])
def test_the_skin_of_a_lattice_is_that_of_its_tets(counts: tuple[int, int, int]) -> None:
    nodes, tets = kuhn(counts)
    skin_nodes, triangles = lattice_skin(counts)
    number = {tuple(node): i for i, node in enumerate(nodes.tolist())}
    name = np.array([number[tuple(node)] for node in skin_nodes.tolist()])
    assert rows(name[triangles]) == rows(boundary(tets)[0])
    assert len(name) == len(np.unique(name))


def test_the_body_may_be_rounded_as_single_precision_does() -> None:
    given = box()
    rounded = given.moved_to(given.points.astype(np.float32).astype(float) + 3e-6)
    assert_array_equal(fill(rounded, 20).tets, fill(given, 20).tets)


def bent(surface: Surface) -> Surface:
    points = np.array(surface.points)
    points[:, 0] += 0.01 * (points[:, 1] == points[:, 1].max())
    return surface.moved_to(points)


def tray(surface: Surface) -> Surface:
    """Five faces of the box, and the same again from inside: no volume, though every triangle is in a face."""
    top = surface.points[surface.triangles][:, :, 1].min(axis=1) == surface.points[:, 1].max()
    outside = surface.triangles[~top]
    return Surface(
        np.concatenate([surface.points, surface.points]),
        np.concatenate([outside, outside[:, ::-1] + len(surface.points)]),
        surface.place,
    )


@pytest.mark.parametrize(
    ("surface", "got"),
    [
        (bent(box()), r"\d+ triangles outside the faces of the bounding box, the first at \(.*\) mm"),
        (shapes.sphere(2, 30.0), "320 triangles outside the faces of the bounding box"),
        (tray(box()), r".* mm3 in a box of 480000 mm3"),
    ],
)
def test_another_body_is_refused(surface: Surface, got: str) -> None:
    want = 'want the surface of an axis-aligned box, or muscle.mesher = "quality"'
    with pytest.raises(InputError, match=f"{surface.place}: got {got}.*, {want}"):
        fill(surface, 20)


@pytest.mark.parametrize(
    ("size", "got"),
    [(0.1, "more than 3 million tetrahedra of 0.1 mm"), (61, "tetrahedra of 61 mm in a body 60 mm thick")],
)
def test_a_size_far_from_the_body_is_refused(size: float, got: str) -> None:
    with pytest.raises(InputError, match=f"box.ply: got {got}"):
        fill(box(), size)
