"""Forces of contact between parts of a surface are the slope of its energy, and their tangent is theirs, on curved facets too."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Cells
from fem_reference.problems.overlaps import unseen
from fem_reference.problems.touching import Touching
from fem_reference.solvers.fenicsx import meshes
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.touching import TouchingForces

K, D = 2.0, 0.05
KINDS = {
    "P1/P1": ("tetrahedron", 1),
    "P2/P1": ("tetrahedron", 1),
    "Q1/P0": ("hexahedron", 1),
    "Q2/Q1": ("hexahedron", 2),
}


def crumpled(element: str, friction: float | None = None) -> tuple[TouchingForces, meshes.Displacement]:
    """Two boxes on each other with unrelated meshes, each node of them moved somewhere near."""
    kind, degree = KINDS[element]
    low, high = (
        shapes.warped_box((2, 2, 1), (1.0, 1.0, 0.5), kind, degree),
        shapes.box((1, 2, 1), (1.1, 1.2, 0.5), kind, degree),
    )
    high.points[:] += [-0.05, -0.1, 0.49]
    mesh = shapes.joined({"low": low, "high": high})
    found, displacement = contact_of(mesh, Touching("low_z1", "high_z0", K, D, friction), element)
    dofs = displacement.dofs
    found.unknowns.x.array[dofs] = 0.02 * np.random.default_rng(1).normal(size=dofs.shape)
    return found, displacement


def contact_of(mesh: Cells, law: Touching, element: str) -> tuple[TouchingForces, meshes.Displacement]:
    """The contact of a ``law`` on a ``mesh`` at rest."""
    local = meshes.distribute(MPI.COMM_SELF, mesh)
    regions = dict(zip(mesh.facets, meshes.local_facets(local, mesh.facets.values()), strict=True))
    displacement = meshes.Displacement(meshes.unknowns(local, element))
    body = Body(mesh, (), (), (0.0, 1.0), touching=(law,))
    return TouchingForces(body, SimpleNamespace(regions=regions), displacement, Spent()), displacement


def energy(contact: TouchingForces) -> float:
    """The integral of the law's pressure over the gap, summed over the points of both sides."""
    contact.look()
    total = 0.0
    for one, (met, _) in zip(contact.passes, contact.now, strict=True):
        deep = K * met.gap**2 / 2 + K * D**2 / 6
        total += one.areas[met.points] @ np.where(met.gap < -D, deep, K * (D - met.gap) ** 3 / (12 * D))
    return total


def residual(contact: TouchingForces) -> np.ndarray:
    found = np.zeros(len(contact.unknowns.x.array))
    contact.add_residual(found, None)
    return found


@pytest.mark.parametrize("element", KINDS)
def test_forces_are_the_slope_of_the_energy_and_the_tangent_theirs(element) -> None:
    contact, displacement = crumpled(element)
    unknowns, dofs = contact.unknowns.x.array, displacement.dofs
    forces, tangent = residual(contact), contact.tangent()
    assert min(len(met.gap) for met, _ in contact.now) > 5
    assert min(met.gap.min() for met, _ in contact.now) < 0
    start, direction, step = np.array(unknowns), np.zeros_like(unknowns), 1e-6
    direction[dofs] = np.random.default_rng(2).normal(size=dofs.shape)
    ends = []
    for sign in (1, -1):
        unknowns[:] = start + sign * step * direction
        ends.append((energy(contact), residual(contact)))
    (after, above), (before, below) = ends
    # Central differences of numbers of the order of 1e-3: the square of the step, and rounding over it.
    assert (after - before) / (2 * step) == pytest.approx(forces @ direction, abs=1e-9)
    assert (above - below) / (2 * step) == pytest.approx(tangent @ direction, abs=1e-8)
    assert abs(tangent - tangent.T).max() < 1e-15
    # Of the forces on the nodes, which a rigid motion does not change: sum and moment.
    unknowns[:] = start
    nodal, places = forces[dofs], displacement.space.tabulate_dof_coordinates() + start[dofs]
    assert np.abs(nodal).sum() > 1e-3
    assert nodal.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)
    assert np.cross(places, nodal).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)


@pytest.mark.parametrize("element", KINDS)
def test_friction_balances_and_its_tangent_is_exact(element) -> None:
    contact, displacement = crumpled(element, 0.3)
    unknowns, dofs = contact.unknowns.x.array, displacement.dofs
    forces, tangent, start = residual(contact), contact.tangent(), np.array(unknowns)
    mets = [met for met, _ in contact.now]
    pairs = zip(contact.passes, mets, strict=True)
    limits = [0.3 * one.areas[met.points] * one.law.pressure(met.gap)[0] for one, met in pairs]
    drags = [np.linalg.norm(one.pull[:, :3], axis=1) for one in contact.rubbed]
    # On facets that bend, a force at a gap has the lever of that gap: it is another by gap times curvature.
    bends = [met.there.metric - met.gap[:, None, None] * met.there.bend for met in mets]
    levers = [
        np.abs(np.linalg.eigvals(np.linalg.solve(m, met.there.metric))).max(axis=1)
        for m, met in zip(bends, mets, strict=True)
    ]
    for drag, limit, lever in zip(drags, limits, levers, strict=True):
        assert (drag <= 1.000001 * lever * limit + 1e-15).all()
    assert all((one.lost >= 0).all() for one in contact.rubbed)
    assert sum((one.lost > 1e-12).sum() for one in contact.rubbed) > 3
    assert sum(((one.lost <= 1e-12) & (drag > 1e-9)).sum() for one, drag in zip(contact.rubbed, drags, strict=True)) > 0
    direction, step, ends = np.zeros_like(unknowns), 1e-6, []
    direction[dofs] = np.random.default_rng(2).normal(size=dofs.shape)
    for sign in (1, -1):
        unknowns[:] = start + sign * step * direction
        ends.append(residual(contact))
    # As without friction: the square of the step, and rounding over it.
    assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(tangent @ direction, abs=1e-7)
    unknowns[:] = start
    nodal, places = forces[dofs], displacement.space.tabulate_dof_coordinates() + start[dofs]
    assert nodal.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)
    assert np.cross(places, nodal).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)
    sums = np.sum([np.concatenate(pair) for pair in contact.forces().values()], axis=0)
    assert sums == pytest.approx(np.zeros(6), abs=1e-15)


def test_points_that_face_the_same_way_do_not_meet() -> None:
    # The top of the upper box is behind the facets of the lower one once this box is moved into the lower one, far enough.
    contact, _ = crumpled("Q1/P0")
    first = contact.passes[0]
    met = first.met(contact.unknowns.x.array, D)
    normals = np.einsum("ni,ni->n", met.here.normal, met.there.normal)
    assert (normals < 0).all()
    first.other.outward[:] *= -1  # inside out, facets face the same way as the points
    assert not len(first.met(contact.unknowns.x.array, D).points)


def test_a_point_stays_on_its_facet_a_little_beyond_the_edge() -> None:
    contact, _ = crumpled("P1/P1")
    one, unknowns = contact.passes[0], contact.unknowns.x.array
    first = one.met(unknowns, D)
    assert (one.other.beyond(first.there.at) <= 0.02).all()
    moves = np.zeros_like(unknowns)
    moves[one.side.dofs] = [0.01, 0.02, 0.0]  # along the facets, of 0.6 to 1.2 mm
    fresh, kept = one.met(unknowns + moves, D), one.met(unknowns + moves, D, first)
    common = np.intersect1d(first.points, np.intersect1d(fresh.points, kept.points))
    was, by_itself, held = (dict(zip(met.points, met.facets, strict=True)) for met in (first, fresh, kept))
    changed = [point for point in common if was[point] != by_itself[point]]
    assert changed
    assert all(held[point] == was[point] for point in changed)


def test_a_failed_attempt_changes_no_facet_that_a_point_stays_on() -> None:
    contact, _ = crumpled("P1/P1", 0.3)
    unknowns, start = contact.unknowns.x.array, np.array(contact.unknowns.x.array)
    small, far = np.zeros_like(start), np.zeros_like(start)
    dofs = contact.passes[0].side.dofs
    small[dofs], far[dofs] = [0.01, 0.02, 0.0], [0.3, 0.2, 0.0]
    contact.settle()
    unknowns[:] = start + small
    once = residual(contact)
    unknowns[:] = start + far
    residual(contact)
    unknowns[:] = start + small
    assert abs(residual(contact) - once).max() > 1e-6 * abs(once).max()  # without going back
    contact.go_back()
    unknowns[:] = start + small
    assert np.array_equal(residual(contact), once)


def over_a_block(element: str) -> tuple[TouchingForces, np.ndarray]:
    """A block of two by one cells with its top at z = 0.5, and a small plate at (0.5, 0.32, 1.5) with its unknowns (n, 3)."""
    kind = KINDS[element][0]
    low, high = shapes.box((2, 1, 1), (1.0, 1.0, 0.5), kind), shapes.box((1, 1, 1), (0.04, 0.04, 0.001), kind)
    high.points[:] += [0.48, 0.3, 1.5]
    mesh = shapes.joined({"low": low, "high": high})
    contact, displacement = contact_of(mesh, Touching("low_z1", "high_z0", K, 0.02), element)
    return contact, displacement.dofs[displacement.space.tabulate_dof_coordinates()[:, 2] > 1.4]


@pytest.mark.parametrize("element", KINDS)
def test_a_point_stays_on_its_facet_unless_another_is_nearer_by_more_than_the_smoothing(element) -> None:
    # The top of the block falls by 45 degrees to both sides of a ridge along x = 0.5. The plate comes 0.1 below the ridge.
    contact, upper = over_a_block(element)
    unknowns, one = contact.unknowns.x.array, contact.passes[1]
    unknowns[one.other.dofs[..., 2]] = -np.abs(one.other.rest[..., 0] - 0.5)
    for x in (0.03, -0.01):  # first below the right side alone
        unknowns[upper] = [x, 0.0, -1.1]
        contact.look()
    met = contact.now[1][0]
    right = one.places(contact.seen)[met.points, 0] - 0.5
    # The left side is nearer by sqrt(2) times the distance to the left.
    stays = np.sqrt(2) * -right <= 0.02
    assert 0 < (stays & (right < 0)).sum() < (right < 0).sum()
    assert met.gap == pytest.approx(-(0.1 - np.where(stays, right, -right)) / np.sqrt(2), abs=1e-14)


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("element", ["P2/P1", "Q1/P0"])
def test_a_nearer_facet_just_beyond_its_edge_comes_before_a_deeper_one(element, held) -> None:
    """The ridge of the test above, whose left side is skewed beside its end, so that some points are just beyond its edge. They
    begin in contact with the right side, if ``held``, or without contact.
    """
    contact, upper = over_a_block(element)
    unknowns, one = contact.unknowns.x.array, contact.passes[1]
    x, y = one.other.rest[..., 0], one.other.rest[..., 1]
    unknowns[one.other.dofs[..., 2]] = -np.abs(x - 0.5)
    unknowns[one.other.dofs[..., 1]] = 0.2 * np.maximum(0.5 - x, 0) * (1 - y)
    for away in (0.03, -0.02)[not held :]:
        unknowns[upper] = [away, -0.3, -1.1]
        contact.look()
    met = contact.now[1][0]
    assert len(met.points) == len(one.areas)
    left = (0.1 + one.places(contact.seen)[met.points, 0] - 0.5) / np.sqrt(2)
    assert (-met.gap - left).max() <= 0.02


def lost(element: str, x: tuple[float, float], z: tuple[float, float], sag: float = 0.0) -> np.ndarray:
    """True for each point of the lower face of a plate that went through in a load step, in which the middle of the face goes
    along ``x`` and ``z``, over a block of which both halves sag by ``sag``.
    """
    contact, upper = over_a_block(element)
    unknowns, one = contact.unknowns.x.array, contact.passes[1]
    share = 2 * one.other.rest[..., 0] % 1
    unknowns[one.other.dofs[..., 2]] = -4 * sag * share * (1 - share)
    unknowns[upper] = [x[0] - 0.5, 0.0, z[0] - 1.5]
    contact.settle()
    before, last, unknowns[upper] = np.array(unknowns), contact.now[1][0], [x[1] - 0.5, 0.0, z[1] - 1.5]
    contact.look()
    return np.isin(np.arange(len(one.areas)), one.through(before, last, contact.seen, contact.now[1][0]))


@pytest.mark.parametrize("element", KINDS)
@pytest.mark.parametrize("end", [0.25, 0.85])
@pytest.mark.parametrize("start", [0.55, 0.51, 0.49, 0.4])
def test_a_point_that_goes_through_is_found_also_where_it_moves_along(element, end, start) -> None:
    # From in front, near, and inside; deeper than facets reach: at most half the thickness of 0.5. Ends beside the facet, or below.
    assert lost(element, (0.25, end), (start, -0.7)).all()


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
@pytest.mark.parametrize("end", [0.25, 0.85])
def test_a_point_between_a_curved_facet_and_its_flat_pieces_is_not_lost(element, end) -> None:
    # At x = 0.125 the facet is at 0.5 - 3/4 0.2 = 0.35, and flat pieces between its nodes at 0.4.
    assert lost(element, (0.125, end), (0.39, -0.7), 0.2).all()
    assert lost(element, (0.125, end), (0.43, -0.7), 0.2).all()
    # From in front of the pieces to behind, and still in front of the facet.
    assert not lost(element, (0.125, 0.125), (0.43, 0.39), 0.2).any()


@pytest.mark.parametrize("element", KINDS)
def test_points_that_leave_or_slide_off_are_not_lost(element) -> None:
    assert not lost(element, (0.25, 0.8), (0.45, 0.55)).any()
    assert not lost(element, (0.9, 1.1), (0.49, 0.48)).any()


@pytest.mark.parametrize("element", KINDS)
def test_a_point_that_leaves_a_narrow_valley_past_its_end_is_not_lost(element) -> None:
    """Walls z = 10 |x - 0.5|, 0.1 apart where the plate is, end at y = 0. Points of the plate are 0.02 to 0.06 deep in the left
    wall, and come to 0.005 to 0.045 in front of the right one, by at most 0.02 beyond the end. Their path raised from the left
    wall passes the right one.
    """
    contact, upper = over_a_block(element)
    unknowns, one = contact.unknowns.x.array, contact.passes[1]
    unknowns[one.other.dofs[..., 2]] = 10 * np.abs(one.other.rest[..., 0] - 0.5)
    unknowns[upper] = [-0.09, 0.013 - 0.32, -0.5]
    contact.settle()
    before, last = np.array(unknowns), contact.now[1][0]
    unknowns[upper] = [0.025, -0.32, -0.5]
    contact.look()
    assert len(last.points) > 0
    assert not len(one.through(before, last, contact.seen, contact.now[1][0]))


def test_a_point_outside_beside_the_edge_of_a_wall_is_not_deep_in_the_wall() -> None:
    """Two boxes that no motion has brought together: normals of top and walls are at right angles, to rounding of either sign."""
    low, high = (shapes.box(counts, (20.0, 20.0, 10.0), "tetrahedron", 1) for counts in ((4, 4, 2), (3, 3, 1)))
    high.points[:] += [-2.0, -2.0, 10.16]  # further away than the smoothing, and nearer than 0.02 of an edge
    mesh = shapes.joined({"low": low, "high": high})
    facets = {
        name: np.concatenate([mesh.facets[f"{name}_{side}"] for side in ("x0", "x1", "y0", "y1", face)])
        for name, face in (("low", "z1"), ("high", "z0"))
    }
    mesh = replace(mesh, facets=facets)
    contact, _ = contact_of(mesh, Touching("low", "high", K, D), "P2/P1")
    assert [len(met.points) for met, _ in contact.now] == [0, 0]


def test_ridges_that_cross_between_points_are_refused_at_rest_unless_their_overlap_is_removed() -> None:
    """Roofs whose ridges cross, 0.02 deep, with slopes of 0.1. A facet reaches beyond the plane of another by (0.05 + 0.02) over
    sqrt(1.01). Between the points a right-angled edge could reach 1/16 of the longest edge, sqrt(1 + 0.5**2 + 0.05**2).
    """
    low, high = (shapes.box(counts, (1.0, 1.0, 1.0), "tetrahedron") for counts in ((2, 1, 1), (1, 2, 1)))
    low.points[:, 2] -= 0.1 * low.points[:, 2] * np.abs(low.points[:, 0] - 0.5)
    high.points[:, 2] += 0.98 + 0.1 * (1 - high.points[:, 2]) * np.abs(high.points[:, 1] - 0.5)
    mesh, law = shapes.joined({"low": low, "high": high}), Touching("low_z1", "high_z0", K, 0.02)
    with pytest.raises(ArithmeticError, match=f"overlap by {0.07 / np.sqrt(1.01):.3g} mm; at most 0.02 mm is allowed"):
        contact_of(mesh, law, "P2/P1")
    contact, _ = contact_of(mesh, replace(law, relaxed=(0.0, 1.0)), "P2/P1")
    assert 0 < contact.overlap <= 0.02
    assert unseen(mesh, law) == pytest.approx(np.sqrt(1 + 0.5**2 + 0.05**2) / 16)
