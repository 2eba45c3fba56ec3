"""Fibres by area: a flow of closed form, its lines, and their evenness at both ends."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, TetMesh, boundary, tet_volumes, triangle_areas
from fem_reference.geometry.embedding import embed
from fem_reference.geometry.fibres import fibre_field, trace
from fem_reference.geometry.flux_fibres import MOST, Flow, area_flux, streamlines
from fem_reference.problems.fibre_ends import ends_of

LENGTH, WIDTH, HEIGHT = 60.0, 20.0, 10.0  # [mm] of a sheet along x, attached by all of its bottom and by its end


def sheet(fineness: int = 1) -> TetMesh:
    """Its cells are longer and longer along x, so that facets and areas are not the same."""
    mesh = shapes.box((12 * fineness, 4 * fineness, 4 * fineness), (LENGTH, WIDTH, HEIGHT))
    points = np.column_stack([LENGTH * (mesh.points[:, 0] / LENGTH) ** 1.5, mesh.points[:, 1:]])
    faces, _ = boundary(mesh.tets)
    end = faces[np.isclose(points[faces][:, :, 0], LENGTH).all(axis=1)]
    return TetMesh(points, mesh.tets, {"bottom": mesh.facets["bottom"], "end": end})


SHEET = sheet()


def bar() -> TetMesh:
    return shapes.box((4, 4, 12), (10.0, 10.0, 50.0))


def covered(mesh: TetMesh, facets: Ints, ends: Floats) -> float:
    """The share of the area of ``facets`` that is within a mean spacing, the root of the area for each end, of an end."""
    rng, areas = np.random.default_rng(1), triangle_areas(mesh.points, facets)
    weights = rng.dirichlet((1, 1, 1), 20_000)
    places = np.einsum("nc,ncx->nx", weights, mesh.points[rng.choice(facets, 20_000, p=areas / areas.sum())])
    away, _ = cKDTree(ends).query(places)
    return float((away <= np.sqrt(areas.sum() / len(ends))).mean())


def each(lines: Polylines) -> Floats:
    """The points of each line (k, 40, 3)."""
    return lines.points.reshape(len(lines), -1, 3)


def test_in_a_bar_fibres_are_straight_and_the_flux_is_one() -> None:
    flux = area_flux(bar(), "bottom", "top")
    assert_allclose(flux.slopes, np.broadcast_to([0, 0, 1 / 100], flux.slopes.shape), atol=1e-12)
    lines = streamlines(flux, 9)
    assert_allclose(lines.lengths(), 50, rtol=1e-9)
    assert_allclose(each(lines)[:, :, :2], np.broadcast_to(each(lines)[:, :1, :2], (9, 40, 2)), atol=1e-9)
    assert_allclose(flux.field(np.zeros(1, int), np.array([[3.0, 4, 5]])), [[0, 0, 1]], atol=1e-9)


def test_what_leaves_a_tetrahedron_enters_the_next() -> None:
    """The flux through each triangle is the same from both sides; through the free boundary it is 0."""
    flux = area_flux(SHEET, "bottom", "end")
    volumes = tet_volumes(SHEET.points, SHEET.tets)
    outward = -3 * volumes[:, None] * np.einsum("kia,ka->ki", flux.rises, flux.slopes)  # area times normal is -3 V grad
    net = np.bincount(flux.faces.ravel(), weights=outward.ravel())
    once = np.bincount(flux.faces.ravel()) == 1
    assert np.abs(net[~once]).max() < 1e-12
    assert_allclose(np.abs(net[once]).sum(), 2, rtol=1e-9)
    assert (np.abs(net[once]) > 1e-12).sum() == len(flux.start) + len(flux.end)


def closed_form(points: Floats) -> Floats:
    """Directions (n, 3) of ``u = (x^2 - (z - h)^2) / 2``: even flux through z = 0 and x = L, none through x = 0 and z = h."""
    along = np.stack([points[:, 0], np.zeros(len(points)), HEIGHT - points[:, 2]], axis=1)
    return np.asarray(along / np.linalg.norm(along, axis=1)[:, None])


@pytest.mark.slow
def test_directions_in_a_sheet_attached_by_its_face_are_those_of_the_closed_form() -> None:
    """The root mean square of the angles, by volume, falls with the mesh."""
    found = []
    for fineness in (1, 2):
        mesh = sheet(fineness)
        middles, volumes = mesh.points[mesh.tets].mean(axis=1), tet_volumes(mesh.points, mesh.tets)
        given = area_flux(mesh, "bottom", "end").field(np.arange(len(middles)), middles)
        angles = np.arccos(np.clip(np.sum(given * closed_form(middles), axis=1), -1, 1))
        found.append(np.degrees(np.sqrt(np.average(angles**2, weights=volumes))))
    assert found[0] < 5
    assert found[1] < found[0] / 1.5  # the middle line between order 0 and 1 in the angle; measured 1.9


@pytest.mark.slow
def test_lines_in_a_sheet_are_hyperbolas_that_end_as_evenly_as_they_start() -> None:
    """``x (h - z)`` is constant: from ``x0`` on the bottom to the height ``h (1 - x0 / L)`` at the end."""
    lines = each(streamlines(area_flux(sheet(2), "bottom", "end"), 30))
    starts, lasts = lines[:, 0, 0], lines[:, -1]
    assert_allclose(lasts[:, 0], LENGTH, atol=1e-9)
    cell = HEIGHT / 8
    assert_allclose(lasts[:, 2], HEIGHT * (1 - starts / LENGTH), atol=cell)
    assert_allclose(
        lines[:, :, 0] * (HEIGHT - lines[:, :, 2]), starts[:, None] * HEIGHT * np.ones(40), atol=cell * LENGTH
    )


def test_lines_cover_both_attachments_where_those_of_a_potential_gather_at_their_rims() -> None:
    by_potential = ends_of(trace(fibre_field(SHEET, "bottom", "end"), 20))
    assert covered(SHEET, SHEET.facets["bottom"], by_potential[:, 0]) < 0.5
    by_area = ends_of(streamlines(area_flux(SHEET, "bottom", "end"), 20))
    for side, name in enumerate(("bottom", "end")):
        # Groups that are compact at the start alone leave 4 % of the end.
        assert covered(SHEET, SHEET.facets[name], by_area[:, side]) > 0.99


def test_each_line_stands_for_the_same_area() -> None:
    """So the mean place at the start is the middle of the bottom, within a third of the spacing; cells are smaller at x = 0."""
    starts = ends_of(streamlines(area_flux(SHEET, "bottom", "end"), 100))[:, 0]
    assert_allclose(starts.mean(axis=0), [LENGTH / 2, WIDTH / 2, 0], atol=np.sqrt(LENGTH * WIDTH / 100) / 3)


def test_attachments_that_touch_still_give_fibres() -> None:
    """The bottom and the end share an edge, at which a potential would be 0 and 1."""
    lines = streamlines(area_flux(SHEET, "bottom", "end"), 200)
    assert lines.lengths().min() < 2  # beside it they are short
    assert np.isfinite(lines.points).all()


@pytest.mark.parametrize("seed", range(3))
def test_turned_moved_scaled_and_renumbered_meshes_have_the_same_directions_and_lines(seed: int) -> None:
    """Lines start along the facets in their order: in another order they are others, as evenly over the same area."""
    turn, shift = Rotation.random(rng=np.random.default_rng(seed)), np.array([30.0, -70, 20])
    moved = TetMesh(3 * turn.apply(SHEET.points) + shift, SHEET.tets, SHEET.facets)
    fluxes = [area_flux(mesh, "bottom", "end") for mesh in (SHEET, moved, shapes.renumbered(moved, seed))]
    one, other, again = (streamlines(flux, 12) for flux in fluxes)
    assert_allclose(other.points, 3 * turn.apply(one.points) + shift, atol=1e-6)
    fields = []
    for flux, at in zip(fluxes, (SHEET.points, moved.points, moved.points), strict=True):
        middles = at[SHEET.tets].mean(axis=1)
        cells = embed(flux.mesh, middles).tets
        fields.append(flux.field(cells, middles))
    assert_allclose(fields[1], turn.apply(fields[0]), atol=1e-9)
    assert_allclose(fields[2], fields[1], atol=1e-9)
    assert again.lengths().mean() == pytest.approx(other.lengths().mean(), rel=0.05)


def test_the_other_way_round_lines_run_the_other_way() -> None:
    for line in each(streamlines(area_flux(SHEET, "end", "bottom"), 5)):
        assert line[0, 0] == pytest.approx(LENGTH, abs=1e-9)
        assert line[-1, 2] == pytest.approx(0, abs=1e-9)


def test_lines_that_leave_beside_the_end_do_not_count() -> None:
    """A flow that goes aside by 1 mm in 10: of a bar 10 mm wide and 50 mm long, the half that starts at x < 5 comes to the top."""
    straight = area_flux(bar(), "bottom", "top")
    aside = replace(straight, slopes=np.broadcast_to([0.001, 0, 0.01], straight.slopes.shape))
    lines = each(streamlines(aside, 20))
    assert_allclose(lines[:, -1, 2], 50, atol=1e-9)
    assert lines[:, 0, 0].max() < 5
    beside = replace(straight, slopes=np.broadcast_to([0.01, 0, 0.01], straight.slopes.shape))
    with pytest.raises(InputError, match="got 4, want at most 0, the number that could be traced"):
        streamlines(beside, 4)


def test_too_many() -> None:
    with pytest.raises(InputError, match=rf"fibres.traced.count: got {MOST + 1}, want at most {MOST} with flux"):
        streamlines(area_flux(bar(), "bottom", "top"), MOST + 1)
    still = area_flux(bar(), "bottom", "top")
    still = Flow(still.mesh, still.start, still.end, still.faces, still.rises, 0 * still.slopes)
    with pytest.raises(InputError, match="got 4, want at most 0, the number that could be traced"):
        streamlines(still, 4)
