"""Contact along own normals: forces balance, are continuous across creases and sharp edges, and have an exact tangent."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.touching import Touching
from fem_reference.solvers.fenicsx.rays import Hits, RayPass, facing
from fem_reference.solvers.fenicsx.touching import TouchingForces
from fem_reference.solvers.fenicsx.touching_passes import Pass
from tests.solvers.fenicsx.test_touching_passes import KINDS, K, contact_of, crumpled, over_a_block, residual


def measured(contact: TouchingForces, kind: type[Pass] = RayPass) -> None:
    """Let a ``contact`` measure gaps along own normals, or to the nearest place."""
    contact.passes = [kind(one.law, one.side, one.other, one.names) for one in contact.passes]
    contact.seen[:], contact.now = np.nan, []
    contact.settle()


def hits(contact: TouchingForces, one: int = 1) -> Hits:
    contact.look()
    found = contact.now[one][0]
    assert isinstance(found, Hits)
    return found


@pytest.mark.parametrize("element", KINDS)
@pytest.mark.parametrize("rough", [1, 5])
def test_forces_balance_and_their_tangent_is_exact(element, rough) -> None:
    contact, displacement = crumpled(element)
    measured(contact)
    unknowns, dofs = contact.unknowns.x.array, displacement.dofs
    unknowns *= rough
    forces, tangent, start = residual(contact), contact.tangent(), np.array(unknowns)
    found = [hits(contact, i) for i in (0, 1)]
    assert all(isinstance(one, RayPass) for one in contact.passes)
    assert min(len(met.gap) for met in found) > 5
    beyond = [one.other.beyond(met.there.at) for one, met in zip(contact.passes, found, strict=True)]
    assert sum((far > 0.01).sum() for far in beyond) > 2  # sharp edges take part
    shares = [facing(met.here, met.there)[0] for met in found]
    # And steep places, on curved facets.
    assert rough == 1 or element[1] == "1" or sum((share < 0.99).sum() for share in shares) > 2
    direction, step, ends = np.zeros_like(unknowns), 1e-7, []
    direction[dofs] = np.random.default_rng(2).normal(size=dofs.shape)
    for sign in (1, -1):
        unknowns[:] = start + sign * step * direction
        ends.append(residual(contact))
    # Central differences of numbers of the order of 1e-3, with lengths of 0.05: the square of the step, and rounding over it.
    assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(tangent @ direction, abs=1e-8)
    unknowns[:] = start
    nodal, places = forces[dofs], displacement.space.tabulate_dof_coordinates() + start[dofs]
    assert np.abs(nodal).sum() > 1e-3
    assert nodal.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)
    assert np.cross(places, nodal).sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-16)
    sums = np.sum([np.concatenate(pair) for pair in contact.forces().values()], axis=0)
    assert sums == pytest.approx(np.zeros(6), abs=1e-15)


def upper_alone(contact: TouchingForces) -> None:
    """Let only the points of the upper part search from now on, of whose force is asked: half of the time."""
    contact.passes, contact.rubbing, contact.now = contact.passes[1:], contact.rubbing[1:], contact.now[1:]
    contact.settled = (contact.settled[0], contact.settled[1][1:], *contact.settled[2:])


def greatest_jumps(contact: TouchingForces, upper: np.ndarray, path: tuple[np.ndarray, ...]) -> tuple[float, float]:
    """The greatest change of the force on the points of a plate in 60 steps along a straight path, and in 600, of which those are
    each the tenth.
    """
    forces = []
    for share in np.linspace(0, 1, 601):
        contact.unknowns.x.array[upper] = path[0] + share * (path[1] - path[0])
        contact.look()
        forces.append(contact.now[0][1].force.sum(axis=0))
    return tuple(float(np.abs(np.diff(forces[::every], axis=0)).max()) for every in (10, 1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "slope"), [("P2/P1", 2.5), ("P2/P1", 0.5), pytest.param("Q1/P0", 2.5, marks=pytest.mark.nightly)]
)
def test_forces_are_continuous_across_a_ridge_and_a_sharp_edge(element, slope) -> None:
    """The plate goes over a block with a ridge along x = 0.5, whose right side falls by ``slope``, 0.02 deep in its left side and
    beyond its end. On the steep side, of a cosine of 0.37, contact fades: it begins from 0.3. In ten times as many steps, forces
    change by a tenth. To the nearest place, they jump.
    """
    contact, upper = over_a_block(element)
    upper_alone(contact)
    measured(contact)
    (one,) = contact.passes
    contact.unknowns.x.array[one.other.dofs[..., 2]] = -slope * np.maximum(one.other.rest[..., 0] - 0.5, 0)
    for ends in ((0.3, 0.7), (0.2, -0.3)):
        path = tuple(np.array([x - 0.5, 0.0, 0.48 - 1.5]) for x in ends)
        few, many = greatest_jumps(contact, upper, path)
        assert few > 1e-6
        assert many < 0.2 * few
    path = tuple(np.array([x - 0.5, 0.0, 0.48 - 1.5]) for x in (0.2, -0.3))
    measured(contact, Pass)
    few, many = greatest_jumps(contact, upper, path)
    assert many > 0.5 * few


def test_contact_fades_where_places_do_not_face_a_point() -> None:
    """A plate is 0.02 deep in a flat block that is turned beneath it: the pressure is the law's, by the length of the line."""
    for slope, share in ((0.0, 1.0), (0.9, 1.0), (4.0, 0.0)):
        contact, upper = over_a_block("P2/P1")
        measured(contact)
        one, unknowns = contact.passes[1], contact.unknowns.x.array
        unknowns[one.other.dofs[..., 2]] = slope * (one.other.rest[..., 0] - 0.5)
        unknowns[upper] = [0.0, 0.0, -1.02]
        met = hits(contact)
        assert len(met.points) == (len(one.areas) if share else 0)
        if share:
            height = one.places(unknowns)[met.points] - [0.5, 0.0, 0.5]
            assert met.gap == pytest.approx(height[:, 2] - slope * height[:, 0], abs=1e-14)
            assert one.pressure(met)[0] == pytest.approx(K * np.maximum(-met.gap, 0), abs=K * 0.02 / 4)


@pytest.mark.parametrize("element", KINDS)
def test_points_above_facets_are_found_up_to_the_smoothing(element) -> None:
    """The plate is above a flat block, whose smoothing is 0.02."""
    contact, upper = over_a_block(element)
    measured(contact)
    for height, share in ((0.019, 1), (0.021, 0)):
        contact.unknowns.x.array[upper] = [0.0, 0.0, height - 1.0]
        met = hits(contact)
        assert len(met.points) == share * len(contact.passes[1].areas)
        assert met.gap == pytest.approx(height, abs=1e-14)


def test_the_first_crossing_decides() -> None:
    """Points below a block are not in it, although the line behind them meets its top from below; from inside, they are in it."""
    contact, upper = over_a_block("Q1/P0")
    measured(contact)
    one, unknowns = contact.passes[1], contact.unknowns.x.array
    unknowns[upper] = [0.0, 0.0, -1.1]
    assert len(hits(contact).points) == len(one.areas)
    # The right half of the top, folded over the left half, faces down: it is the first that the line meets.
    right = one.other.rest[..., 0] > 0.5
    unknowns[one.other.dofs[right]] = np.stack(
        [1 - 2 * one.other.rest[right][:, 0], 0 * right[right], -0.05 + 0 * right[right]], 1
    )
    unknowns[upper] = [-0.2, 0.0, -1.1]
    assert not len(hits(contact).points)


def test_a_line_ends_at_a_sheet_that_is_out_of_reach() -> None:
    """Points of a plate are 0.3 below a top; what is deeper than a facet is wide, 0.7, would be out of reach. A sheet 0.1 thick
    comes between, 0.1 above the points: its bottom, which faces away from them, reaches to 0.05 only.
    """
    boxes = {"low": ((1.0, 1.0, 0.02), 1.0), "sheet": ((1.0, 1.0, 0.1), 3.0), "high": ((0.04, 0.04, 0.001), 2.0)}
    cells = {name: shapes.box((1, 1, 1), size, "tetrahedron") for name, (size, _) in boxes.items()}
    for name, (_, height) in boxes.items():
        cells[name].points[:] += [0.48 * (name == "high"), 0.3 * (name == "high"), height]
    mesh = shapes.joined(cells)
    both = np.concatenate([mesh.facets[name] for name in ("low_z1", "sheet_z0", "sheet_z1")])
    mesh = replace(mesh, facets={"other": both, "points": mesh.facets["high_z0"]})
    contact, displacement = contact_of(mesh, Touching("points", "other", K, 0.02, own_normals=True), "P2/P1")
    rest, unknowns = displacement.space.tabulate_dof_coordinates()[:, 2], contact.unknowns.x.array
    unknowns[displacement.dofs[(rest > 1.9) & (rest < 2.1), 2]] = 0.72 - 2
    assert len(hits(contact, 0).points) == len(contact.passes[0].areas)
    unknowns[displacement.dofs[rest > 2.9, 2]] = 0.82 - 3
    assert not len(hits(contact, 0).points)


@pytest.mark.parametrize("element", KINDS)
def test_points_that_slide_round_an_edge_are_not_lost_and_those_that_go_through_are(element) -> None:
    """The plate begins on the left side of a ridge of 90 degrees, and ends in front of its right side, or below both."""
    for end, went in (([0.3, 0.0, -1.2], False), ([0.1, 0.0, -2.4], True)):
        contact, upper = over_a_block(element)
        measured(contact)
        one, unknowns = contact.passes[1], contact.unknowns.x.array
        unknowns[one.other.dofs[..., 2]] = -np.abs(one.other.rest[..., 0] - 0.5)
        unknowns[upper] = [-0.1, 0.0, -1.09]
        contact.settle()
        before, last, unknowns[upper] = np.array(unknowns), hits(contact), end
        contact.look()
        lost = one.through(before, last, contact.seen, contact.now[1][0])
        assert len(last.points) > 0
        assert len(lost) == went * len(one.areas)


def test_the_force_falls_steadily_as_a_facet_slides_off_a_sharp_edge() -> None:
    """A plate of two facets slides off a block of its size, 0.02 deep. The force on its points falls with the area that is
    left, which ends at half of the width of 0.1 facets of 0.5 over which contact fades. It deviates by at most 2.5 % of the whole,
    as much as one point carries; with 16 points in each facet it would be 4.2 %.
    """
    kind = KINDS["P1/P1"][0]
    low, high = shapes.box((2, 1, 1), (1.0, 1.0, 0.5), kind), shapes.box((1, 1, 1), (1.0, 1.0, 0.001), kind)
    high.points[:] += [0.0, 0.0, 1.5]
    law = Touching("low_z1", "high_z0", K, 0.02)
    contact, displacement = contact_of(shapes.joined({"low": low, "high": high}), law, "P1/P1")
    measured(contact)
    upper = displacement.dofs[displacement.space.tabulate_dof_coordinates()[:, 2] > 1.4]
    off, forces = np.linspace(0.1, 0.9, 81), []
    for x in off:
        contact.unknowns.x.array[upper] = [x, 0.0, -1.02]
        contact.look()
        forces.append(contact.now[1][1].force[:, 2].sum() / (K * 0.02 * 0.5))  # half of the area on either side
    assert forces == pytest.approx(1 - off + 0.1 * 0.5 / 2, abs=0.025)
