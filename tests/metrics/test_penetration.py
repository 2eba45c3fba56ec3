"""How deep a surface is in bones and how much of it: spheres and floors of known depth, moved bones, attached vertices, NaN."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation as Turn

from fem_reference.assessment.comparison import compare
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.exemption import Exemption
from fem_reference.geometry.rigid_bodies import Box, HalfSpace, Sphere
from fem_reference.io.files import read_surface, write_surface
from fem_reference.metrics import Measure, MeasurementContext, at_rest, measure, penetration
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.runs.store import Outcome, Run

RADIUS = 20.0
BALL = shapes.sphere(
    4, RADIUS
)  # 2562 vertices on the sphere, one of them at its lowest point; facets up to 0.024 mm below it
FIBRE = Polylines(np.array([[0.0, 0, -5], [0, 0, 5]]), np.array([0, 2]))
PLATE = shapes.skin(shapes.box((1, 1, 1), (60.0, 60.0, 10.0)))
LOW = float(BALL.points[:, 2].min())  # [mm]


def floor(height: float, motion: RigidMotion | None = None) -> Bone:
    """All below z = ``height`` [mm]."""
    return Bone("floor", PLATE, motion, solid=HalfSpace((0, 0, height), (0, 0, 1)))


def run_of(*frames: np.ndarray, numbers: tuple[int, ...] | None = None, rest: Surface = BALL) -> Run:
    numbers = numbers or tuple(range(len(frames)))
    inside = np.broadcast_to(FIBRE.points, (len(frames), 2, 3))
    return Run("run", "test", Outcome("converged", ""), numbers, rest, np.array(frames), FIBRE, inside)


def taken(run: Run, *bones: Bone, exempt: Exemption | None = None) -> tuple[Measure, Measure]:
    """``deepest`` and ``volume``."""
    deepest, volume = penetration.measure(run, run, MeasurementContext.of(at_rest(run), FIBRE, bones, exempt))
    assert (deepest.statistic, deepest.unit, volume.statistic, volume.unit) == ("deepest", "mm", "volume", "mm3")
    return deepest, volume


def cap(height: float) -> float:
    return np.pi * height**2 * (3 * RADIUS - height) / 3


@pytest.mark.slow
def test_a_ball_pressed_into_a_floor_is_as_deep_as_it_went() -> None:
    depths = np.array([-1.0, 0.0, 0.5, 3.0, 8.0])
    deepest, volume = taken(run_of(*(BALL.points - [0, 0, depth] for depth in depths)), floor(LOW))
    assert_allclose(deepest.values, np.maximum(depths, 0), atol=1e-12)  # round-off of coordinates near 20 mm
    wanted = [cap(max(0, depth - RADIUS - LOW)) for depth in depths]
    # Counted to 1 or 2 %; facets up to 0.024 mm inside the sphere take 10 % from a cap of 0.5 mm, less from a higher one.
    assert_allclose(volume.values[3:], wanted[3:], rtol=0.04)
    assert_allclose(volume.values[:3], wanted[:3], rtol=0.15)
    assert deepest.where[:2] == volume.where[:2] == ("", "")
    assert deepest.where[4] in {
        f"vertex {vertex} at ({a:.1f}, {b:.1f}, {c:.1f}) mm in floor"
        for vertex in np.flatnonzero(BALL.points[:, 2] < LOW + 1e-9)
        for a, b, c in [BALL.points[vertex] - [0, 0, 8.0]]
    }
    assert volume.where[4] == "most in floor"


def test_a_bone_is_where_its_frame_number_takes_it() -> None:
    # The floor turns by a quarter about x through the origin from frame 0 to 10: then it is the wall y > 15, to the left of which
    # the ball rests that was above it. Frames are numbered 0, 10, 20.
    wall = floor(-15.0, RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 10.0), (0.0, np.pi / 2)))
    behind = BALL.points + [0, -4.0, 0]
    deepest, _ = taken(run_of(BALL.points, behind, BALL.points, numbers=(0, 10, 20)), wall)
    side = float(BALL.points[:, 1].max())
    assert_allclose(deepest.values, [-LOW - 15, side - 4 - 15, side - 15], atol=1e-9)


def test_turning_everything_changes_nothing_but_the_draw() -> None:
    turn = Turn.random(rng=np.random.default_rng(8))
    frames = [turn.apply(BALL.points - [0, 0, depth]) for depth in (2.0, 6.0)]
    ground = Bone("floor", PLATE, None, solid=HalfSpace(tuple(turn.apply([0, 0, LOW])), tuple(turn.apply([0, 0, 1]))))
    deepest, volume = taken(run_of(*frames), ground)
    assert_allclose(deepest.values, [2, 6], atol=1e-12)
    assert_allclose(volume.values, [cap(2), cap(6)], rtol=0.06)


def test_a_bone_of_triangles_is_met_in_its_own_frame() -> None:
    # A head of 15 mm at z = 40 mm that a half turn about x takes to z = -40 mm.
    head = shapes.sphere(3, 15.0)
    head = Surface(head.points + [0, 0, 40], head.triangles)
    bone = Bone("head", head, RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 10.0), (0.0, np.pi)))
    lowered = BALL.points - [0, 0, 7.0]
    deepest, volume = taken(run_of(lowered, lowered, numbers=(0, 10)), bone)
    exact = (15 - np.linalg.norm(lowered - [0, 0, -40], axis=1)).max()
    assert exact > 1.9
    # The facets of the head lie up to 0.09 mm below its sphere; the grid adds 0.05 mm, as the bone asks for.
    assert_allclose(deepest.values, [0, exact], atol=0.15)
    assert 0.8 < volume.values[1] / np.pi / (2**2 * 35 * 15 * 20 / 35**2) < 1.1  # a thin lens: pi h^2 R r / (R + r)
    assert volume.values[0] == 0


@pytest.mark.slow
def test_the_deepest_bone_decides_and_volumes_add() -> None:
    ground, stone = floor(LOW + 2), Bone("stone", PLATE, None, solid=Sphere((0, 0, RADIUS + 5), 10.0))
    one, other, both = (taken(run_of(BALL.points), *bones) for bones in ((ground,), (stone,), (ground, stone)))
    assert_allclose(both[0].values, [max(one[0].values[0], other[0].values[0])])
    assert_allclose(both[1].values, one[1].values + other[1].values)
    assert "in stone" in both[0].where[0]


@pytest.mark.slow
def test_what_is_attached_is_exempt_and_what_is_near_to_it() -> None:
    # A cap of 3 mm is attached that is 3 mm deep in the floor.
    low = np.flatnonzero(BALL.points[:, 2] < LOW + 3)
    rest = Setup(BALL, (floor(LOW + 3),), (AttachedVertices("origin", floor(LOW + 3), low),), (0,), None)
    around = np.linalg.norm(BALL.points[:, None] - BALL.points[low], axis=2).min(axis=1)
    assert (
        set(low) < set(np.flatnonzero(~rest.free)) <= set(np.flatnonzero(around < rest.exempt.reach + 1.5))
    )  # an edge
    deepest, volume = taken(run_of(BALL.points), *rest.bones, exempt=rest.exempt)
    assert (deepest.values, volume.values) == ([0], [0])
    # Without the springs of the lower left half the right half is met: nearly as deep as before, and half of the volume of the cap.
    left = low[BALL.points[low, 0] < 0]
    half = Setup(BALL, rest.bones, (AttachedVertices("origin", rest.bones[0], left),), (0,), None)
    deepest, volume = taken(run_of(BALL.points), *half.bones, exempt=half.exempt)
    whole = cap(RADIUS + LOW + 3)
    assert 2.5 < deepest.values < 3
    assert 0.3 * whole < volume.values < 0.5 * whole  # 0.9 mm of a cap of 10.5 mm are exempt too


@pytest.mark.slow
@pytest.mark.parametrize(("slides", "attached", "wanted", "at"), [(False, 0.5, 1.0, 0.5), (True, 2.0, 2.0, 0.0)])
def test_where_contact_is_exempt_what_has_been_added_since_rest_counts(slides, attached, wanted, at) -> None:
    # A bar attached at z = 0, whose side x = 0 is 0.3 mm deep in a wall at rest. What is exempt beside the attachment, up to
    # 0.53 mm off, goes 1 mm deeper, and what is attached by 0.5 or 2 mm, which counts where the wall moves otherwise than its
    # bone. All the rest goes out.
    bar = shapes.skin(shapes.box((1, 1, 80), (10.0, 10.0, 40.0)))
    z = bar.points[:, 2]
    aside = RigidMotion((0, 1, 0), None, (0.0, 1.0), (0.0, 5.0)) if slides else None
    wall = Bone("wall", PLATE, aside, solid=HalfSpace((0.3, 0, 0), (1, 0, 0)))
    base = floor(-5.0)
    rest = Setup(bar, (base, wall), (AttachedVertices("origin", base, np.flatnonzero(z == 0)),), (0, 1), None)
    assert np.array_equal(~rest.free, z < 0.6)
    moves = np.where(z == 0, -attached, np.where(z < 0.6, -1.0, 30.0))
    moved = bar.points + np.column_stack([moves, 0 * z, 0 * z])
    deepest, _ = taken(run_of(bar.points, moved, rest=bar), *rest.bones, exempt=rest.exempt)
    assert_allclose(deepest.values, [0.3, wanted], atol=1e-9)
    assert f", {at}) mm in wall" in deepest.where[1]


def in_a_dent(cells: int, radius: float) -> tuple[Run, Bone]:
    """A plate whose upper vertices are all on a ball of a ``radius`` or beside it, which is 2 mm lower than the plate."""
    plate = shapes.skin(shapes.box((cells, cells, 1), (60.0, 60.0, 10.0)))
    points, centre = np.array(plate.points), np.array([30.0, 30.0, 8 + radius])
    top = np.flatnonzero(points[:, 2] == 10)
    across = np.linalg.norm(points[top, :2] - 30, axis=1)
    points[top, 2] = np.minimum(10, centre[2] - np.sqrt(radius**2 - across**2))
    return run_of(points, rest=plate), Bone("stone", PLATE, None, solid=Sphere(tuple(centre), radius))


@pytest.mark.slow
def test_what_flat_triangles_cut_off_a_round_bone_does_not_count_unless_they_are_large() -> None:
    # In the middle of an edge of a length it is length^2 / 8 R deep: edges of 4.2 mm, where contact is felt every 1.07 mm, follow
    # the ball; those of 14.1 mm do not.
    fine, coarse = (taken(*in_a_dent(cells, 100.0))[0] for cells in (20, 6))
    assert_allclose(fine.values, 0, atol=1e-9)
    assert_allclose(coarse.values, 200 / 8 / 100, rtol=0.05)
    assert coarse.where[0].startswith("between vertices at (")


@pytest.mark.slow
def test_a_bone_between_the_vertices_of_a_coarse_surface_is_met() -> None:
    # A ball of 3 mm goes through a bar, both its sides 10 mm away from any vertex; its own middle is in it for 10 mm.
    bar = shapes.skin(shapes.box((1, 1, 1), (10.0, 10.0, 40.0)))
    stone = RigidMotion((1, 0, 0), None, (0.0, 22.0), (0.0, 22.0))
    ball = Bone("ball", shapes.sphere(2, 3.0).moved_to(shapes.sphere(2, 3.0).points + [-4, 5, 20]), stone)
    ball = replace(ball, solid=Sphere((-4, 5, 20), 3.0))
    numbers = (0, 2, 3, 6, 9, 13, 16, 18, 20)
    deepest, volume = taken(run_of(*[bar.points] * 9, numbers=numbers, rest=bar), ball)
    places = np.array(numbers) - 4.0
    surface = np.maximum(3 - np.minimum(np.abs(places), np.abs(places - 10)), 0)
    middle = (places > 0) & (places < 10)
    # Pieces of 0.5 mm: at the side they are up to 0.3 mm off the axis, 0.02 mm less deep. Points drawn in the ball come within
    # 0.4 mm of its middle.
    assert_allclose(deepest.values, np.where(middle, 3, surface), atol=0.4)
    assert_allclose(deepest.values[~middle], surface[~middle], atol=0.03)
    assert deepest.where[4] == "near the centre of ball"
    whole = 4 / 3 * np.pi * 27
    assert_allclose(volume.values[4], whole, rtol=0.03)
    assert_allclose(volume.values[1], np.pi * 1**2 * (9 - 1) / 3, rtol=0.06)


@pytest.mark.slow
def test_of_the_run_alone_whatever_it_is_compared_with() -> None:
    pressed = run_of(BALL.points - [0, 0, 2.0], BALL.points - [0, 0, 4.0])
    rest = Setup(BALL, (floor(LOW),), (), (0, 1), None)
    name, reference = "candidate", replace(run_of(BALL.points, BALL.points), name="reference")

    class Scene:
        expect, place = (), "case.toml"

        def standards(self, _: str) -> set[str]:
            return {"reference", "itself"}

    found = compare(Scene(), rest, reference, (replace(pressed, name=name),))
    depths = [
        next(one.values.tolist() for one in measures if (one.metric, one.statistic) == ("penetration", "deepest"))
        for measures in (found.deviations[name], found.changes[name], found.changes["reference"])
    ]
    assert_allclose(depths, [[2, 4], [2, 4], [0, 0]], atol=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_a_frame_that_is_no_body_is_not_a_number(bad: float) -> None:
    torn = np.array(BALL.points - [0, 0, 1.0])
    torn[7] = bad
    for one in taken(run_of(BALL.points - [0, 0, 1.0], torn), floor(LOW)):
        assert one.values[0] > 0.9
        assert np.isnan(one.values[1])
        assert one.where[1] == ""


def test_a_surface_blown_up_has_a_depth_and_no_volume() -> None:
    burst = np.array(BALL.points - [0, 0, 1.0])
    burst[BALL.points[:, 2] > 10] *= 1e6
    beyond = np.array(BALL.points - [0, 0, 1.0])
    beyond[int(np.argmax(BALL.points[:, 2])), 1] = 1e200
    deepest, volume = taken(run_of(burst, beyond), floor(LOW))
    assert_allclose(deepest.values, [1, 1], atol=1e-12)
    assert np.isnan(volume.values).all()


def test_without_bones_nothing_is_inside() -> None:
    deepest, volume = taken(run_of(BALL.points))
    assert (deepest.values, volume.values, deepest.where, volume.where) == ([0], [0], ("",), ("",))


def test_a_bone_that_is_not_closed_has_no_inside(tmp_path, caplog) -> None:
    write_surface(tmp_path / "open.vtp", Surface(PLATE.points, PLATE.triangles[1:]), PLATE.points)
    bone = Bone("femur", read_surface(tmp_path / "open.vtp", 1.0), None)
    with pytest.raises(
        InputError, match=r'bone "femur": .*open\.vtp: got 3 edges that belong to only one triangle, .* closed surface'
    ):
        _ = bone.shape
    for one in taken(run_of(BALL.points, BALL.points), floor(LOW), bone):
        assert np.isnan(one.values).all()
        assert one.where[0].startswith('not known: bone "femur": ')
    assert "penetration is not measured" in caplog.text
    assert measure(run_of(BALL.points), run_of(BALL.points), MeasurementContext.of(run_of(BALL.points), FIBRE, (bone,)))


@pytest.mark.slow
def test_a_box_that_stands_out_on_both_sides_is_counted_whole() -> None:
    # A rod of 6 x 6 mm through the middle: 36 mm2 times 2 R, less by (x^2 + y^2) / 2 R^2 with means of 3 mm2 each.
    rod = Bone("rod", PLATE, None, solid=Box((0, 0, 0), (60, 6, 6), 0))
    deepest, volume = taken(run_of(BALL.points), rod)
    assert_allclose(volume.values, 36 * 2 * RADIUS * (1 - 6 / (2 * RADIUS**2)), rtol=0.03)
    assert 2 < deepest.values <= 3  # nowhere in the rod is deeper
