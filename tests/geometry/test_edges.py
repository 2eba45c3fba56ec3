"""Edges of surfaces, and the two metrics of them: closed forms on boxes, spheres and bent slabs, and what changes nothing."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.assessment.judge import check, verdict
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface, triangle_areas
from fem_reference.geometry.edges import Edges
from fem_reference.io.files import read_surface
from fem_reference.metrics import (
    Measure,
    MeasurementContext,
    at_rest,
    dihedral_angle,
    edge_extension,
    measure,
    names,
    units,
)
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes.case import Expectation

SIZE = (12.0, 7.0, 3.0)
CELLS = 6
SLAB = shapes.skin(shapes.box((CELLS, 1, 1), SIZE))
FIBRE = Polylines(np.array([[1.0, 1, 1], [2, 1, 1]]), np.array([0, 2]))


def run_of(rest: Surface, *frames: np.ndarray) -> Run:
    numbers = tuple(range(len(frames)))
    return Run("run", "test", Outcome("converged", ""), numbers, rest, np.array(frames))


def taken(run: Run, reference: Run | None = None) -> dict[str, Measure]:
    """The measures of edges by ``metric.statistic``, against rest where there is no reference."""
    reference = at_rest(run) if reference is None else reference
    found = measure(run, reference, MeasurementContext.of(reference, FIBRE, ()))
    return {f"{one.metric}.{one.statistic}": one for one in found if one.metric in ("edge_extension", "dihedral_angle")}


def values(run: Run, reference: Run | None = None) -> dict[str, np.ndarray]:
    return {name: one.values for name, one in taken(run, reference).items()}


def bent(points: np.ndarray, angle: float) -> np.ndarray:
    """A slab bent about the y axis through ``angle`` [rad], the plane of its bottom kept at its length."""
    radius = SIZE[0] / angle
    turn, height = points[:, 0] / radius, radius + points[:, 2]
    return np.column_stack([height * np.sin(turn), points[:, 1], height * np.cos(turn)])


def wavy(points: np.ndarray, size: float) -> np.ndarray:
    return points + size * np.sin(points[:, [1, 2, 0]] / 3)


def angles_one_by_one(surface: Surface) -> dict[tuple[int, int], float]:
    """Angle [rad] at each edge by arccos, negative where the next triangle lies above the plane of the first."""
    normals, found = {}, {}
    for triangle in surface.triangles.tolist():
        a, b, c = surface.points[triangle]
        normal = np.cross(b - a, c - a)
        for i in range(3):
            normals[triangle[i], triangle[(i + 1) % 3]] = (normal / np.linalg.norm(normal), triangle[(i + 2) % 3])
    for (i, j), (normal, _) in normals.items():
        other, tip = normals[j, i]
        above = normal @ (surface.points[tip] - surface.points[i])
        found[i, j] = np.arccos(np.clip(normal @ other, -1, 1)) * (-1 if above > 0 else 1)
    return found


def test_edges_of_a_closed_surface() -> None:
    ball = shapes.sphere(2, 10.0)
    edges = Edges.of(ball)
    assert len(ball.points) - len(edges.ends) + len(ball.triangles) == 2  # Euler
    assert len(np.unique(np.sort(edges.ends), axis=0)) == len(edges.ends)
    # Every triangle gives a third of its area to each of its edges; rounding only.
    assert_allclose(edges.areas.sum(), triangle_areas(ball.points, ball.triangles).sum(), rtol=1e-12)
    sides = {frozenset(triangle) for triangle in ball.triangles.tolist()}
    assert {
        frozenset((*ends, tip)) for ends, tips in zip(edges.ends, edges.opposite, strict=True) for tip in tips
    } == sides


def test_a_box_has_right_angles_outward_and_a_hollow_one_inward() -> None:
    edges = Edges.of(SLAB)
    ends = SLAB.points[edges.ends]
    on_faces = sum(np.isclose(ends, plane).all(axis=1).sum(axis=1) for plane in ([0, 0, 0], SIZE))
    assert_allclose(edges.angles(SLAB.points), np.where(on_faces == 2, np.pi / 2, 0), atol=1e-15)
    inward = Surface(SLAB.points, SLAB.triangles[:, ::-1])
    assert_allclose(Edges.of(inward).angles(SLAB.points).min(), -np.pi / 2, rtol=1e-15)


def test_length_times_angle_is_the_mean_curvature_of_steiner() -> None:
    """The sum of l phi / 2 is pi (a + b + c) of a box, and 4 pi r of a sphere up to the square of the size of its edges."""
    edges = Edges.of(SLAB)
    assert_allclose(edges.lengths(SLAB.points) @ edges.angles(SLAB.points) / 2, np.pi * sum(SIZE), rtol=1e-14)
    errors = []
    for subdivisions in (2, 3):
        ball = shapes.sphere(subdivisions, 10.0)
        of_ball = Edges.of(ball)
        errors.append(of_ball.lengths(ball.points) @ of_ball.angles(ball.points) / 2 / (40 * np.pi) - 1)
    assert 3.5 < errors[0] / errors[1] < 4.5  # second order: four times smaller


def test_angles_have_the_sign_and_size_of_the_definition() -> None:
    ball = shapes.sphere(2, 10.0)
    surface = ball.moved_to(wavy(ball.points, 2.5))
    edges, wanted = Edges.of(surface), angles_one_by_one(surface)
    found = edges.angles(surface.points)
    # arccos loses half of the digits near 0: 1e-8 of 1e-16.
    assert_allclose(found, [wanted[i, j] for i, j in edges.ends.tolist()], atol=1e-7)
    assert found.min() < -0.1  # hollow edges are among them


def test_angles_are_exact_where_arccos_has_no_digits() -> None:
    """Two triangles folded by 1e-10, whose cosine is 1 in double precision."""
    fold = 1e-10
    for sign in (1, -1):
        points = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [1, 0.5, -sign * np.tan(fold)]])
        edges = Edges(np.array([[0, 1]]), np.array([[0, 1]]), np.array([[2, 3]]), np.ones(1))
        assert_allclose(edges.angles(points), sign * fold, rtol=1e-12)


@pytest.mark.parametrize("factor", [0.8, 1.25])
def test_scaling_extends_every_edge_alike_and_bends_nothing(factor: float) -> None:
    ball = shapes.sphere(2, 10.0)
    found = values(run_of(ball, ball.points, factor * ball.points))
    change = 100 * (factor - 1)
    for name in ("mean", "mean_of_edges"):
        assert_allclose(found[f"edge_extension.{name}"], [0, change], rtol=1e-10)
    for name in ("rms", "p95", "max"):
        assert_allclose(found[f"edge_extension.{name}"], [0, abs(change)], rtol=1e-10)
    for name in units():
        if name.startswith("dihedral_angle"):
            assert np.abs(found[name]).max() < 1e-10, name  # rounding of 1e-16 by the size of a triangle


def test_the_difference_of_two_stretches_is_per_rest_length() -> None:
    """20 % longer against 50 % longer is 30 % of the rest length shorter: not 20 % of the reference's, nor 25 % of the run's."""
    ball = shapes.sphere(1, 10.0)
    found = values(run_of(ball, 1.2 * ball.points), run_of(ball, 1.5 * ball.points))
    for name in ("mean", "mean_of_edges"):
        assert_allclose(found[f"edge_extension.{name}"], -30, rtol=1e-12)
    for name in ("rms", "p95", "max"):
        assert_allclose(found[f"edge_extension.{name}"], 30, rtol=1e-12)


@pytest.mark.slow
def test_edges_weigh_by_area() -> None:
    """A box whose long half is stretched: each edge by itself, weighted by a third of its triangles."""
    points = wavy(SLAB.points, 0.4)
    found = values(run_of(SLAB, points))
    weights, changes = [], []
    areas = triangle_areas(SLAB.points, SLAB.triangles)
    for i, j in angles_one_by_one(SLAB):
        if i < j:
            beside = [{i, j} <= set(triangle) for triangle in SLAB.triangles.tolist()]
            weights.append(areas[beside].sum() / 3)
            long, rest = (np.linalg.norm(at[i] - at[j]) for at in (points, SLAB.points))
            changes.append(100 * (long / rest - 1))
    change, weight = np.array(changes), np.array(weights)
    assert_allclose(found["edge_extension.mean"], np.average(change, weights=weight), rtol=1e-10)
    assert_allclose(found["edge_extension.rms"], np.sqrt(np.average(change**2, weights=weight)), rtol=1e-10)
    assert_allclose(found["edge_extension.mean_of_edges"], change.mean(), rtol=1e-10)
    assert_allclose(found["edge_extension.max"], np.abs(change).max(), rtol=1e-10)
    within = weight[np.abs(change) <= found["edge_extension.p95"] * (1 + 1e-12)].sum() / weight.sum()
    below = weight[np.abs(change) < found["edge_extension.p95"] * (1 - 1e-12)].sum() / weight.sum()
    assert below < 0.95 <= within


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1, -1])
def test_a_slab_bent_into_an_arc_has_known_angles(sign: int) -> None:
    """By the angle a in n facets: a / n at the lines across, outward on one face and inward on the other, half of it at its
    two ends; the diagonals and the plane sides stay as they are.
    """
    angle, (length, width, height) = sign * 1.5, SIZE
    found = values(run_of(SLAB, bent(SLAB.points, angle)))
    step = np.degrees(abs(angle)) / CELLS
    cell, cap = length / CELLS * width / 2, width * height / 2  # a triangle of a face, and of an end
    across, ends = 2 * (CELLS - 1) * 2 * cell / 3, 4 * (cell + cap) / 3
    area = 2 * (length * width + width * height + height * length)
    assert_allclose(found["dihedral_angle.max"], step, rtol=1e-10)
    assert_allclose(found["dihedral_angle.mean"], 0, atol=1e-12)  # both faces weigh the same
    assert_allclose(found["dihedral_angle.mean_magnitude"], (across + ends / 2) * step / area, rtol=1e-10)
    assert_allclose(found["dihedral_angle.rms"], step * np.sqrt((across + ends / 4) / area), rtol=1e-10)
    count = (2 * (CELLS - 1) + 4 / 2) / (len(SLAB.triangles) * 3 / 2)
    assert_allclose(found["dihedral_angle.mean_magnitude_of_edges"], count * step, rtol=1e-10)
    assert found["dihedral_angle.p95"] == pytest.approx(step, rel=1e-10)  # the lines across are above a twentieth


def test_a_rounder_slab_is_more_convex_where_it_bulges() -> None:
    """Its top alone raised into a roof: the ridge turns by twice the slope, the two eaves lose the slope each."""
    block = shapes.skin(shapes.box((2, 1, 1), SIZE))
    raised = block.points.copy()
    ridge = np.isclose(raised[:, 0], SIZE[0] / 2) & np.isclose(raised[:, 2], SIZE[2])
    raised[ridge, 2] += 1.0
    slope = np.degrees(np.arctan(1.0 / (SIZE[0] / 2)))
    edges = Edges.of(block)
    turned = np.degrees(edges.angles(raised) - edges.angles(block.points))
    assert_allclose(np.sort(turned[np.abs(turned) > 1e-9]), [-slope, -slope, 2 * slope], rtol=1e-10)


def test_a_fold_beyond_half_a_turn_is_the_smaller_angle() -> None:
    """An edge folded to 170 degrees one side and to 170 the other differs by 20, not by 340."""
    rest = np.array([[0.0, 0, 0], [0, 1, 0], [-1, 0.5, 0], [1, 0.5, -0.5]])
    tet = Surface(rest, np.array([[0, 1, 2], [1, 0, 3], [1, 3, 2], [0, 2, 3]]))
    edges = Edges.of(tet)
    shared = int(np.flatnonzero((np.sort(edges.ends) == [0, 1]).all(axis=1))[0])

    def folded(degrees: float) -> np.ndarray:
        moved = rest.copy()
        moved[3] = [np.cos(np.radians(degrees)), 0.5, -np.sin(np.radians(degrees))]
        return moved

    here, there = folded(170), folded(-170)
    assert_allclose(np.degrees([edges.angles(here)[shared], edges.angles(there)[shared]]), [170, -170], rtol=1e-12)
    for run, reference in ((here, there), (there, here)):
        found = taken(run_of(tet, run), run_of(tet, reference))
        assert found["dihedral_angle.max"].values <= 180
    alone = Edges(edges.ends[[shared]], edges.beside[[shared]], edges.opposite[[shared]], np.ones(1))
    assert_allclose(np.degrees(dihedral_angle.wrapped(alone.angles(there) - alone.angles(here))), 20, rtol=1e-10)
    assert_allclose(dihedral_angle.wrapped(np.array([-np.pi, np.pi, 1e-20])), [np.pi, np.pi, 1e-20], rtol=0, atol=0)


def test_rigid_motion_and_the_order_of_vertices_change_nothing() -> None:
    ball, random = shapes.sphere(2, 10.0), np.random.default_rng(11)
    run, reference = wavy(ball.points, 1.0), wavy(ball.points, -0.7)
    before = values(run_of(ball, run), run_of(ball, reference))
    turn = Rotation.random(rng=random)
    moved = values(run_of(ball, turn.apply(run) + [50, -20, 30]), run_of(ball, reference))
    order = random.permutation(len(ball.points))
    triangles = random.permutation(np.argsort(order)[np.roll(ball.triangles, 1, axis=1)])
    other = Surface(ball.points[order], triangles)
    shuffled = values(run_of(other, run[order]), run_of(other, reference[order]))
    for name, value in before.items():
        # Coordinates of 100 mm carry 1e-14 mm, edges and heights are above 1 mm: 1e-12 deg or %.
        assert_allclose(moved[name], value, atol=1e-10, err_msg=name)
        assert_allclose(shuffled[name], value, atol=1e-10, err_msg=name)


@pytest.mark.parametrize("place", ["run", "reference"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_what_is_not_a_number_never_passes(place: str, bad: float) -> None:
    ball = shapes.sphere(1, 10.0)
    damaged = ball.points.copy()
    damaged[5] = bad
    runs = {"run": run_of(ball, ball.points), "reference": run_of(ball, ball.points)} | {place: run_of(ball, damaged)}
    context = MeasurementContext.of(run_of(ball, ball.points), FIBRE, ())
    measures = [
        one
        for metric in (edge_extension, dihedral_angle)
        for one in metric.measure(runs["run"], runs["reference"], context)
    ]
    for one in measures:
        name = f"{one.metric}.{one.statistic}"
        assert not np.isfinite(one.values).any(), name
        assert np.isnan(one.values).any() or np.isfinite(bad) or name.startswith("edge"), name
        wanted = {"metric": one.metric, "statistic": one.statistic, "truth": f"0 {one.unit}"}
        assert verdict(expectation(**wanted, within=f"1e6 {one.unit}"), measures, (0,)).word == "fail", name


def test_a_triangle_that_collapsed_has_no_angle() -> None:
    ball = shapes.sphere(1, 10.0)
    collapsed = ball.points.copy()
    collapsed[ball.triangles[0, 0]] = collapsed[ball.triangles[0, 1]]
    found = taken(run_of(ball, ball.points, collapsed))
    assert np.isnan(found["dihedral_angle.max"].values).tolist() == [False, True]
    # The edge between the two vertices has lost all of its length, and no edge more.
    assert found["edge_extension.max"].values[1] >= 100


@pytest.mark.parametrize(
    ("name", "longer_100", "longer_300", "bent_100"),
    [("report_pbd_box", 1.219, 0.992, 0.465), ("report_pbd_gluteus_maximus", 1.104, 1.003, None)],
)
def test_the_report_program_measured_the_same(data, name, longer_100, longer_300, bent_100) -> None:
    """Its own figures (candidates/PROGRAM.md): mean l / L over the edges, and mean change of angle [rad], at iterations 100 and
    300, to their last digit. The box's angle is greatest there; that of gluteus maximus at another iteration.
    """
    frames = [read_surface(data / "candidates" / name / f"frame_{number:04d}.ply", 1.0) for number in (0, 100, 300)]
    run = run_of(frames[0], *(frame.points for frame in frames))
    longer, turned = (
        next(one.values for one in metric.measure(run, at_rest(run), None) if one.statistic == statistic)
        for metric, statistic in ((edge_extension, "mean_of_edges"), (dihedral_angle, "mean_magnitude_of_edges"))
    )
    assert_allclose(1 + longer[1:] / 100, [longer_100, longer_300], atol=6e-4)
    assert bent_100 is None or np.radians(turned[1]) == pytest.approx(bent_100, abs=6e-4)


@pytest.mark.slow
def test_where_names_the_worst_edge() -> None:
    moved = SLAB.points.copy()
    corner = int(np.flatnonzero((SLAB.points == SIZE).all(axis=1))[0])
    moved[corner] += [0, 0, 3.0]
    where = taken(run_of(SLAB, moved))["edge_extension.max"].where[0]
    below = int(np.flatnonzero((SLAB.points == (SIZE[0], SIZE[1], 0)).all(axis=1))[0])
    first, second = sorted((corner, below))
    assert where == f"edge {first} to {second} at (12.0, 7.0, 1.5) mm"


def expectation(**changes: str) -> Expectation:
    keys = {"of": "reference", "metric": "dihedral_angle", "statistic": "max", "frame": "any", "truth": "0 deg"}
    return Expectation(**(keys | {"within": "10 deg", "kind": "property", "because": "a test"} | changes))


def checked(wanted: Expectation) -> None:
    case = {"numbers": (0,), "carries": {"surface", "lines"}, "standards": lambda _: {"reference", "itself"}}
    check(SimpleNamespace(expect=(wanted,), place="case.toml", **case))


def test_an_angle_is_expected_in_units_of_angle() -> None:
    found = [Measure("dihedral_angle", "max", "deg", np.array([9.0]))]
    checked(expectation())
    assert verdict(expectation(), found, (0,)).word == "pass"
    in_radians = verdict(expectation(within="0.1 rad"), found, (0,))
    assert in_radians.word == "fail"
    assert in_radians.within == pytest.approx(5.729577951308232)  # 18 / pi
    with pytest.raises(InputError, match=r'expect\[0\].within: got "10 %", want an angle'):
        checked(expectation(within="10 %"))


def test_the_judge_reads_the_unit_of_every_measure() -> None:
    of_unit = {"%": "1 %", "mm": "1 mm", "mm3": "1 mm3", "deg": "1 deg", "N": "1 N", "N mm": "1 N mm", "kPa": "1 kPa"}
    assert {"edge_extension", "dihedral_angle"} <= set(names())
    for name, unit in units({"surface", "lines"}).items():
        metric, statistic = name.split(".")
        checked(expectation(metric=metric, statistic=statistic, truth=of_unit[unit], within=of_unit[unit]))
