"""Points in the wedge behind a crease feel its edge: force and energy have no jump there, and the tangent is that of the force."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.problems.touching import Touching
from fem_reference.solvers.fenicsx import meshes
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.touching import TouchingForces

K, D = 2.0, 0.02


def valley(element: str, part: float = 1.0) -> tuple[TouchingForces, np.ndarray]:
    """A block whose top, up to x = ``part``, is a valley along x = 0.5 with slopes of 45 degrees, and a small block 1 mm above it;
    with the unknowns (k, 3) of this one.
    """
    kind = "hexahedron" if element[0] == "Q" else "tetrahedron"
    low, high = shapes.box((2, 1, 1), (1.0, 1.0, 0.5), kind), shapes.box((1, 1, 1), (0.04, 0.04, 0.04), kind)
    top = low.points[:, 2] == 0.5
    low.points[top, 2] += np.abs(low.points[top, 0] - 0.5)
    flat = low.facets["z1"]
    low = replace(low, facets={"z1": flat[low.points[flat][..., 0].max(axis=1) <= part + 1e-9]})
    high.points[:] += [0.48, 0.3, 1.5]
    mesh = shapes.joined({"low": low, "high": high})
    local = meshes.distribute(MPI.COMM_SELF, mesh)
    regions = dict(zip(mesh.facets, meshes.local_facets(local, mesh.facets.values()), strict=True))
    displacement = meshes.Displacement(meshes.unknowns(local, element))
    body = Body(mesh, (), (), (0.0, 1.0), touching=(Touching("low_z1", "high_z0", K, D),))
    found = TouchingForces(body, SimpleNamespace(regions=regions), displacement, Spent())
    return found, displacement.dofs[displacement.space.tabulate_dof_coordinates()[:, 2] > 1.4]


def on_high(contact: TouchingForces) -> np.ndarray:
    """The force (3,) on the points of the small block alone: points of the valley come and go at the ends of its face."""
    met, pressed = contact.now[1]
    return pressed.forces @ met.there.normal


def at(contact: TouchingForces, upper: np.ndarray, x: float, depth: float) -> np.ndarray:
    """The residual (n,) with the middle of the small block at ``x`` from the crease, and its lower face at a ``depth`` below it."""
    contact.unknowns.x.array[upper] = [x, 0.0, -1.0 - depth]
    found = np.zeros(len(contact.unknowns.x.array))
    contact.add_residual(found, None)
    return found


@pytest.mark.parametrize("element", ["P1/P1", "P2/P1", "Q1/P0", "Q2/Q1"])
def test_points_behind_a_crease_press_its_edge_in_proportion_to_their_distance(element) -> None:
    """Of 45 degrees on both sides: points at x from the crease and 0.1 below it are in the wedge, nearest to the edge."""
    contact, upper = valley(element)
    force = at(contact, upper, 0.0, 0.1)[upper].sum(axis=0)
    met = contact.now[1][0]
    assert not len(contact.now[0][0].points)
    assert met.on_edge.all()
    x = contact.passes[1].places(contact.seen)[met.points, 0] - 0.5
    distance = np.hypot(x, 0.1)
    assert met.gap == pytest.approx(-distance, abs=1e-14)
    areas = contact.passes[1].areas
    assert areas[met.points].sum() == pytest.approx(0.04**2 / 2, rel=1e-12)  # half of all
    # Pressure K times the depth, along the way to the edge.
    assert -force == pytest.approx([0, 0, K * 0.1 * 0.04**2 / 2], abs=1e-15)


@pytest.mark.parametrize("element", ["P2/P1", "Q1/P0"])
def test_the_force_has_no_jump_as_points_pass_a_crease(element) -> None:
    # By 0.5 um in a step: forces change in proportion, at most as the pressure on all points turns by the step over the depth.
    contact, upper = valley(element)
    forces = [
        (at(contact, upper, x, 0.03), on_high(contact), contact.settle())[1] for x in np.arange(-0.06, 0.06, 5e-4)
    ]
    steps = np.linalg.norm(np.diff(forces, axis=0), axis=1)
    assert np.linalg.norm(forces, axis=1).min() > 1e-5
    assert steps.max() < 4 * K * 5e-4 * 0.04**2 / 2


def test_a_point_in_front_of_a_facet_is_not_deep_behind_others() -> None:
    contact, _ = valley("Q1/P0")
    edges = contact.passes[1].edges
    # 0.2 and 0.4 above a slope of 45 degrees, and as far behind it.
    points = np.array([[0.8, 0.5, 0.8]] * 4) + np.outer([0.2, 0.4, -0.2, -0.4], np.array([-1, 0, 1]) / np.sqrt(2))
    found = edges.before(edges.facets.rest, points, np.full(4, 0.3))
    assert found.tolist() == [True, False, False, False]


def test_beyond_the_end_of_a_part_there_is_no_edge() -> None:
    contact, upper = valley("Q1/P0", 0.5)
    assert not at(contact, upper, 0.04, 0.03).any()


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
def test_forces_at_edges_are_the_slope_of_their_energy_and_the_tangent_theirs(element) -> None:
    contact, upper = valley(element)
    at(contact, upper, 0.003, 0.05)
    unknowns = contact.unknowns.x.array
    unknowns += 0.003 * np.random.default_rng(1).normal(size=unknowns.shape)
    start, direction, step, ends = np.array(unknowns), np.random.default_rng(2).normal(size=unknowns.shape), 1e-6, []
    for sign in (0, 1, -1):
        unknowns[:] = start + sign * step * direction
        residual, energy = np.zeros_like(unknowns), 0.0
        contact.add_residual(residual, None)
        for one, (met, _) in zip(contact.passes, contact.now, strict=True):
            deep = K * met.gap**2 / 2 + K * D**2 / 6
            energy += one.areas[met.points] @ np.where(met.gap < -D, deep, K * (D - met.gap) ** 3 / (12 * D))
        if not sign:
            assert contact.now[1][0].on_edge.sum() > 10
            tangent = contact.tangent()
            forces = residual
        else:
            ends.append((energy, residual))
    (after, above), (before, below) = ends
    # Central differences: the square of the step, over the depth once or twice, and rounding over it.
    assert (after - before) / (2 * step) == pytest.approx(forces @ direction, abs=1e-10)
    assert (above - below) / (2 * step) == pytest.approx(tangent @ direction, abs=1e-8)
    assert abs(tangent - tangent.T).max() < 1e-14


def lost(element: str, x: tuple[float, float], z: tuple[float, float], bend: float = 0.0) -> np.ndarray:
    """True for each point of the small block that went through in a load step, in which the middle of its lower face goes along
    ``x`` and ``z``, over a flat top of which both halves sag by ``bend``.
    """
    contact, upper = valley(element)
    unknowns, one = contact.unknowns.x.array, contact.passes[1]
    across = one.other.rest[..., 0]
    share = 2 * np.where(across < 0.5, across, across - 0.5)
    unknowns[one.other.dofs[..., 2]] = -np.abs(across - 0.5) - 4 * bend * share * (1 - share)
    unknowns[upper] = [x[0] - 0.5, 0.0, z[0] - 1.5]
    contact.settle()
    before, last, unknowns[upper] = np.array(unknowns), contact.now[1][0], [x[1] - 0.5, 0.0, z[1] - 1.5]
    contact.look()
    return np.isin(np.arange(len(one.areas)), one.through(before, last, contact.seen, contact.now[1][0]))


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1"])
def test_a_point_that_stays_in_front_of_a_bent_facet_is_not_refused(element) -> None:
    # At x = 0.125 the facet is at 0.5 - 3/4 0.2 = 0.35, and flat pieces between its nodes at 0.4.
    assert not lost(element, (0.125, 0.125), (0.43, 0.39), 0.2).any()
    assert lost(element, (0.125, 0.125), (0.43, -0.7), 0.2).all()


@pytest.mark.parametrize("element", ["P1/P1", "P2/P1", "Q1/P0", "Q2/Q1"])
@pytest.mark.parametrize("end", [0.25, 0.85])
def test_a_point_that_goes_through_is_found_also_where_it_moves_along(element, end) -> None:
    # Deeper than facets reach: at most 5/4 of the distance of 0.75 of their corners from their middles.
    assert lost(element, (0.25, end), (0.55, -0.7)).all()
