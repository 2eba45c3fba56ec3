"""The second check denies runs in which something is wrong, by closed forms and planted faults; true runs pass."""

import json
import shutil
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference import cli, effects
from fem_reference.assessment import comparison, second_check
from fem_reference.assessment.run_checks import RunCheck, of_body, of_muscle
from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.motion import Rotation as Turn
from fem_reference.foundations.motion import Translation
from fem_reference.geometry.intersections import crossings, overlaps, self_crossings
from fem_reference.geometry.penetrations import ClosedSurface, depths
from fem_reference.geometry.rigid_bodies import Box, Sphere
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import attached_skin
from fem_reference.geometry.tessellation import tessellated
from fem_reference.io import files
from fem_reference.problems import of_case
from fem_reference.problems import shapes as bodies
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.paths import Affine
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome, Run, collected
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench
from fem_reference.verification import second_check as catalogue
from fem_reference.verification.lab import lab

STILL = np.eye(4)
CONVERGED = Outcome("converged", "all frames reached")


def ball(radius: float, at=(0.0, 0.0, 0.0)) -> tuple[Surface, Sphere]:
    form = Sphere(at, radius)
    return tessellated(form, np.zeros((1, 3)), "ball"), form


def deepest(body: Surface, radius: float, at) -> float:
    surface, form = ball(radius, at)
    return depths(ClosedSurface(body), surface, form, STILL).deepest()[0]


BLOCK = shapes.skin(shapes.box((2, 2, 3), (10, 10, 40)))


@pytest.mark.parametrize("at", [-3.0, -2.0, -1.0, 0.0, 1.5])
def test_a_ball_in_the_side_of_a_coarse_block_is_as_deep_as_it_is(at) -> None:
    # Its lowest point is at + radius inside the side x = 0, and nothing of the block but that side is as near.
    assert_allclose(deepest(BLOCK, 2.5, (at, 4.1, 19.3)), max(at + 2.5, 0.0), atol=2.5 * 0.0036)


def test_a_ball_wholly_inside_crosses_no_surface_and_is_deep() -> None:
    surface, _ = ball(2.0, (5.0, 5.0, 20.0))
    assert len(crossings(BLOCK, surface)) == 0
    assert 3.0 <= deepest(BLOCK, 2.0, (5.0, 5.0, 20.0)) <= 5.0  # all of it is 3 to 5 mm deep
    assert deepest(BLOCK, 2.0, (-9.0, 5.0, 20.0)) == 0


def test_a_thin_needle_between_the_vertices_of_a_coarse_block_is_found_all_along() -> None:
    # 0.2 mm thick: no vertex of either is in the other but those of its tip, 7 mm deep.
    needle = shapes.skin(shapes.box((1, 1, 60), (0.2, 0.2, 12.0)))
    turned = needle.moved_to(needle.points[:, [2, 0, 1]] + [-5.0, 3.3, 17.7])
    low, high = turned.points.min(axis=0), turned.points.max(axis=0)
    form = Box(tuple((low + high) / 2), tuple(high - low), 0.0)
    found, place = depths(ClosedSurface(BLOCK), turned, form, STILL).deepest()
    # The nearest side of the block: y = 0 from 3.3, or the way back along x.
    assert_allclose(found, 3.4, atol=0.2)
    assert place[0] > 3.0


def test_exact_pairs_are_those_of_brute_force() -> None:
    rng = np.random.default_rng(3)
    one, other = (Surface(rng.uniform(-1, 1, (30, 3)), np.arange(30).reshape(10, 3)) for _ in range(2))
    joined = Surface(np.concatenate([one.points, other.points]), np.arange(60).reshape(20, 3))
    pairs = self_crossings(joined)
    between = {(min(a, b), max(a, b) - 10) for a, b in pairs if min(a, b) < 10 <= max(a, b)}
    assert {tuple(pair) for pair in crossings(one, other).tolist()} == between
    assert len(between) > 5


def test_how_far_two_triangles_reach_through_each_other() -> None:
    flat = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])
    upright = np.array([[[1.0, 1, -0.3], [1, 1, 5], [2, 1.5, 5]]])
    turn = Rotation.random(rng=np.random.default_rng(1))
    assert_allclose(overlaps(flat, upright), [0.3])
    assert_allclose(overlaps(turn.apply(upright[0])[None], turn.apply(flat[0])[None]), [0.3])
    assert_array_equal(overlaps(flat, flat[:, [0, 0, 1]]), [0.0])


SCENE = """
title = "A ball through a coarse bar"
proves = "what crosses is denied"
effects = "listed"
[muscle]
surface = "bar.ply"
unit = "mm"
tet_size = "5 mm"
mesher = "block"
[[bone]]
name = "floor"
box = { centre = "5, 5, -5.5 mm", size = "20, 20, 10 mm", rounding = "0 mm" }
[[bone]]
name = "lid"
box = { centre = "5, 5, 45.5 mm", size = "20, 20, 10 mm", rounding = "0 mm" }
[[bone]]
name = "ball"
sphere = { centre = "-6, 5, 20 mm", radius = "3 mm" }
[bone.motion]
direction = [1, 0, 0]
keyframes = [{ frame = 0, distance = "0 mm" }, { frame = 20, distance = "22 mm" }]
[[attachment]]
name = "low"
bone = "floor"
within = "1 mm"
[[attachment]]
name = "high"
bone = "lid"
within = "1 mm"
[[effect]]
name = "neo_hooke"
mu = "10 kPa"
[[effect]]
name = "incompressible"
bulk = "10 MPa"
[[effect]]
name = "contact"
stiffness = "500 kPa/mm"
[fibres.traced]
count = 4
start = "low"
end = "high"
[frames]
first = 0
last = 20
every = 5
[reference]
solver = "fenicsx"
[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "0.5 %"
kind = "property"
because = "it is next to incompressible"
[[expect]]
of = "candidates"
metric = "surface_deviation"
statistic = "max"
frame = "any"
truth = "0 mm"
within = "1 mm"
kind = "property"
because = "it is the same"
"""


@cache
def coarse(folder: Path) -> MuscleProblem:
    """The bar whose surface has 2 x 2 x 3 cells."""
    files.write_surface(folder / "bar.ply", BLOCK, BLOCK.points)
    (folder / "case.toml").write_text(SCENE.replace('effects = "listed"\n', ""))
    case = casefile.read(folder)
    return of_case.problem(case, of_case.setup(case))


def resting(problem: MuscleProblem, **scalars) -> Run:
    positions = np.broadcast_to(problem.surface.points, (len(problem.frames), *problem.surface.points.shape))
    return Run("reference", "fenicsx", CONVERGED, problem.frames, problem.surface, positions, scalars=scalars)


def lost(problem: MuscleProblem, run: Run) -> list[str]:
    return [one.name for one in of_muscle(problem, run) if not one.met]


def test_a_ball_that_goes_through_a_bar_that_does_not_move_is_denied(tmp_path) -> None:
    problem = coarse(tmp_path)
    run = resting(problem, contact_pressure=np.zeros(5))
    assert lost(problem, run) == ["ball in the muscle"]
    (check,) = (one for one in of_muscle(problem, run) if not one.met)
    assert check.value >= 3.0 - 0.02  # its radius at least: it goes through the middle
    assert check.frame in (5, 10, 15)
    # Whatever pressure was recorded: at its middle nothing gives way any more.
    assert lost(problem, replace(run, scalars={"contact_pressure": np.full(5, 100.0)})) == ["ball in the muscle"]
    denied = second_check.confirmed(CONVERGED, of_muscle(problem, run))
    assert denied.status == "denied"
    assert denied.message.startswith("denied by the second check: ball in the muscle: ")


def test_what_large_triangles_pass_through_and_tetrahedra_do_not_is_not_crossed(tmp_path) -> None:
    problem = coarse(tmp_path)
    aside = problem.mesh.points + [0.0, 0.0, 100.0]
    for nodes, met in ((aside, True), (problem.mesh.points, False)):
        checks = {one.name: one.met for one in of_muscle(problem, resting(problem), lambda _, nodes=nodes: nodes)}
        assert checks["ball in the muscle"] is met


def test_no_verdict_rests_on_a_denied_reference(tmp_path) -> None:
    problem = coarse(tmp_path)
    case, run = casefile.read(tmp_path), resting(problem)
    fibres = np.broadcast_to(problem.fibres.points, (5, *problem.fibres.points.shape))
    run = replace(run, fibres=problem.fibres, fibre_positions=fibres)
    mine = replace(run, name="mine", solver="recorded")
    words = {}
    for status in ("converged", "denied"):
        reference = replace(run, outcome=Outcome(status, "so it ended"))
        result = comparison.compare(case, problem, reference, (mine,))
        words[status] = (result.word, *((one.expectation.of, one.word) for one in result.verdicts))
    assert words["converged"] == ("pass", ("reference", "pass"), ("mine", "pass"))
    assert words["denied"] == ("fail", ("reference", "fail"), ("mine", "inconclusive"))
    alone = case.model_copy(update={"expect": case.expect[1:]})
    assert comparison.compare(alone, problem, reference, (mine,)).word == "fail"


def test_what_is_no_number_is_never_met() -> None:
    assert [RunCheck("a", value, 1.0, "mm", 0).met for value in (0.0, 1.0, 1.1, np.nan, np.inf)] == [
        True,
        True,
        *[False] * 3,
    ]
    assert not RunCheck("a", 0.0, np.nan, "mm", 0).met


def test_what_is_so_at_rest_is_no_crossing(tmp_path) -> None:
    problem = coarse(tmp_path)
    still = tuple(replace(bone, motion=None) for bone in problem.bones)
    sphere = Sphere((-1.0, 5.0, 20.0), 3.0)
    inside = replace(still[2], surface=tessellated(sphere, BLOCK.points, "ball"), solid=sphere)
    problem = replace(problem, bones=(*still[:2], inside))
    run = resting(problem)
    assert lost(problem, run) == []
    free = np.setdiff1d(np.arange(len(BLOCK.points)), problem.attached_vertices)
    for farther, found in ((0.1, []), (2.0, ["ball in the muscle"])):  # into the ball, which is 2 mm in the bar at rest
        moved = np.array(run.positions)
        moved[2, free] -= [farther, 0.0, 0.0]
        assert lost(problem, replace(run, positions=moved)) == found


def test_bones_that_are_not_in_contact_may_cross(tmp_path) -> None:
    problem = coarse(tmp_path)
    problem = replace(
        problem, effects=(*problem.effects[:2], effects.make("contact", stiffness="1 MPa/mm", bones=("lid",)))
    )
    assert lost(problem, resting(problem)) == []


def away(problem: MuscleProblem) -> MuscleProblem:
    """Without the ball."""
    return replace(problem, bones=problem.bones[:2])


def test_frames_and_what_is_not_finite(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    run = resting(problem)
    assert lost(problem, run) == []
    for numbers in ((0, 10, 5, 15, 20), (0, 5, 10, 15)):
        assert lost(problem, replace(run, numbers=numbers, positions=run.positions[: len(numbers)])) == [
            "frames that are missing or out of order"
        ]
    for bad in (np.nan, np.inf):
        spoilt = np.array(run.positions)
        spoilt[3, 7, 1] = bad
        (check,) = (one for one in of_muscle(problem, replace(run, positions=spoilt)) if not one.met)
        assert (check.name, check.frame, check.value) == ("positions that are not finite", 15, 1)


def test_exact_attachments_are_where_their_bones_are(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=Translation((1.0, 0.0, 0.0), (0.0, 20.0), (0.0, 4.0)))
    high = replace(problem.attached[1], bone=lid)
    problem = replace(problem, bones=(problem.bones[0], lid), attached=(problem.attached[0], high))
    assert lost(problem, resting(problem)) == ["high off lid"]
    followed = np.array(resting(problem).positions)
    followed += np.arange(5)[:, None, None] * [1.0, 0.0, 0.0] * (BLOCK.points[:, 2:] / 40)
    run = replace(resting(problem), positions=followed)
    assert lost(problem, run) == []
    assert lost(problem, replace(run, positions=followed[[0, 1, 3, 2, 4]])) == ["high off lid"]


def test_springs_yield_as_far_as_the_recorded_force_says(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    low = replace(problem.attached[0], stiffness=0.1)
    skin = attached_skin(BLOCK, attached_shares(BLOCK, low.vertices), problem.mesh, 1.0)
    problem = replace(problem, attached=(low, problem.attached[1]), attached_skins={"low": skin})
    yielded = np.array(resting(problem).positions)
    yielded[2][low.vertices] += [0.0, 0.0, 0.5]  # over 100 mm2: 5 N
    run = replace(resting(problem), positions=yielded)
    assert lost(problem, replace(run, scalars={"force_low": np.array([0.0, 0, 5, 0, 0])})) == []
    assert lost(problem, replace(run, scalars={"force_low": np.array([0.0, 0, 1, 0, 0])})) == ["springs of low, mean"]


@pytest.mark.parametrize(("last", "steps", "met"), [(2.0, 1, False), (2.0, 2, False), (2.0, 4, True), (20.0, 1, True)])
def test_a_turn_takes_steps_enough(tmp_path, last, steps, met) -> None:
    # Once round by frame 2 of the first interval of 5, or a quarter of it by then.
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=Turn((0, 0, 1), (5, 5, 0), (0.0, last), (0.0, 2 * np.pi)))
    problem = replace(problem, bones=(problem.bones[0], lid))
    run = resting(problem, load_steps=np.array([0.0, steps, steps, steps, steps]))
    assert ("lid turns by load step" in lost(problem, run)) is not met
    (check,) = (one for one in of_muscle(problem, run) if one.name == "lid turns by load step")
    assert_allclose(check.value, 2 * np.pi / (steps if last == 2 else 4 * steps))


def test_there_and_back_counts_twice(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=Turn((0, 0, 1), (5, 5, 0), (0.0, 1.0, 2.0), (0.0, np.pi, 0.0)))
    problem = replace(problem, bones=(problem.bones[0], lid))
    run = resting(problem, load_steps=np.array([0.0, 2, 1, 1, 1]))
    assert lost(problem, run) == ["lid turns by load step"]


def test_forces_that_are_not_in_balance(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    run = replace(
        resting(problem, net_force=np.zeros(5), net_moment=np.zeros(5)),
        origin={"settings": {"residual": 1e-8}},
        outcome=replace(CONVERGED, cost={"unknowns": 1e4}),
    )
    assert lost(problem, run) == []
    for kind in ("force", "moment"):
        scalars = run.scalars | {f"net_{kind}": np.array([0.0, 0, 0, 1e-2, 0])}
        assert lost(problem, replace(run, scalars=scalars)) == [f"{kind}s out of balance"]
        # What is no number in one frame is not forgotten for what is well in the next.
        lost_number = run.scalars | {f"net_{kind}": np.array([0.0, np.nan, 0, 0, 0])}
        assert lost(problem, replace(run, scalars=lost_number)) == [f"{kind}s out of balance"]
        ramp = [{"frame": 0.0, "amount": 1.0}, {"frame": 20.0, "amount": 1.0}]
        weighs = effects.make("gravity", density="1000 kg/m^3", acceleration="0, 0, -9.81 m/s^2", ramp=ramp)
        assert lost(replace(problem, effects=(*problem.effects, weighs)), replace(run, scalars=scalars)) == []


def test_a_surface_through_itself(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    side = np.flatnonzero((BLOCK.points[:, 0] == 10) & (BLOCK.points[:, 2] > 10) & (BLOCK.points[:, 2] < 30))
    through = np.array(resting(problem).positions)
    through[3, side] -= [12.0, 0.0, 0.0]
    assert lost(problem, replace(resting(problem), positions=through)) == ["the muscle through itself"]


def test_bodies_reach_their_frames_and_meet_what_is_prescribed() -> None:
    mesh = bodies.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    path = Affine(((0.0, 0.0, 0.5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    body = Body(mesh, (), (Prescribed("top", "z1", (0, 1), path),), (0.0, 0.5, 1.0))

    def solved(points: list, frames=(0.0, 0.5, 1.0)) -> Run:
        return collected([Frame(f, points=p) for f, p in zip(frames, points, strict=True)], CONVERGED)

    def wrong(one: Run) -> list[str]:
        return [check.name for check in of_body(body, one) if not check.met]

    true = [mesh.points + path(mesh.points, frame) for frame in body.frames]
    assert wrong(solved(true)) == []
    assert second_check.confirmed_body(body, solved(true)).outcome == CONVERGED
    assert wrong(solved([true[0], true[2], true[1]])) == ["prescribed at top"]
    assert wrong(solved(true, (0.0, 1.0, 0.5))) == ["frames that are missing or out of order"]
    assert wrong(solved(true[:2], (0.0, 0.5))) == ["frames that are missing or out of order"]
    nothing = [true[0], np.full_like(true[1], np.nan), true[2]]
    assert wrong(solved(nothing)) == ["positions that are not finite"]
    denied = second_check.confirmed_body(body, solved(nothing))
    assert denied.outcome.status == "denied"
    with pytest.raises(ArithmeticError, match="denied by the second check"):
        _ = denied.last
    free = [true[0], true[1] + [0.0, 0.0, 3.0], true[2]]  # z is not prescribed
    assert wrong(solved(free)) == []


@pytest.mark.slow
def test_every_shipped_control_is_denied_and_the_true_run_passes() -> None:
    with lab() as own:
        assert catalogue.denials(own).value == 0
        for entry in catalogue.ENTRIES:
            assert entry.find(own, with_negative_control=True).value >= 1, entry.name


@pytest.mark.slow
def test_a_denied_run_is_no_truth_anywhere(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    scene, out = small.write(tmp_path / "bar"), tmp_path / "out"
    words = ["run", str(scene), "--quiet", "--out", str(out), "--json", str(tmp_path / "facts.json")]
    assert cli.main(words) == cli.DONE
    assert "second check: passed, " in capsys.readouterr().out
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert (facts["verdict"], facts["status"]) == ("pass", "converged")
    record = facts["second_check"]
    assert all(one["met"] for one in record["checks"])
    assert {"lid turns by load step", "forces out of balance", "moments out of balance"} <= {
        one["name"] for one in record["checks"]
    }
    (folder,) = (out / "runs").glob("fenicsx-*")
    # Two frames of the stored run in each other's place; its record is of another check, so that it is asked again.
    frames = [folder / "surface" / f"frame_{number:04d}.vtp" for number in (5, 10)]
    shutil.copy(frames[0], tmp_path / "kept")
    shutil.copy(frames[1], frames[0])
    shutil.copy(tmp_path / "kept", frames[1])
    stored = json.loads((folder / "run.json").read_text())
    stored["origin"]["second_check"]["code"] = "another"
    (folder / "run.json").write_text(json.dumps(stored))
    for _ in range(2):  # as it is asked, and as it is taken from the store
        assert cli.main(words) == cli.SOLVER_FAILED
        facts = json.loads((tmp_path / "facts.json").read_text())
        assert (facts["verdict"], facts["status"]) == ("fail", "denied")
        assert "reference: denied, denied by the second check: " in capsys.readouterr().out
        assert {one["verdict"] for one in facts["verdicts"]} == {"fail"}
        assert "off lid" in facts["message"]
    assert store.load(folder).outcome.status == "denied"
    (page,) = (path for path in out.rglob("report*.html"))
    assert "denies what the solver calls converged" in page.read_text()
    case = casefile.read(scene)
    bench = Bench(case, out / "runs")
    run = bench.obtain("reference", case.reference, "reference")
    result = comparison.compare(case, bench.setup(), run, ())
    assert result.word == "fail"


def test_a_path_that_writes_into_its_points_is_asked_like_any_other() -> None:
    mesh = bodies.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")

    def still(points, _frame):
        return np.multiply(points, 0, out=points)

    body = Body(mesh, (effects.make("neo_hooke", mu=0.01),), (Prescribed("low", "z0", (0, 1, 2), still),), (0.0,))
    solved = collected([Frame(0.0, points=mesh.points)], Outcome("converged", ""))
    assert all(one.met for one in of_body(body, solved))
