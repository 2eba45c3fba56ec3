"""The reference in few load steps and in many, and on other meshes of the same body."""

import numpy as np
import pytest

from fem_reference.assessment import health
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.runs.store import Outcome
from fem_reference.solvers import fenicsx
from fem_reference.studies.hard import blocks, records, repeats

CASES = {hard.name: hard for hard in records.read_all()}


def test_a_reference_that_stalls_says_nothing_of_load_steps(monkeypatch) -> None:
    monkeypatch.setattr(fenicsx, "solve", lambda *_: Outcome("stalled", "the machine was busy"))
    built = blocks.problem(CASES["at_rest.millimetres"])
    with pytest.raises(repeats.StalledError, match="the machine was busy"):
        repeats.in_steps(built, records.choices()["fenicsx"], records.StepCounts(until=2))


def test_the_farthest_frame_is_where_load_steps_are_compared() -> None:
    surface = blocks.problem(CASES["at_rest.millimetres"]).surface
    moved = [surface.points + shift for shift in (0.0, 3.0, 1.0)]
    assert repeats.farthest(health.Followed((0, 5, 10), surface, np.array(moved))).until == 5
    assert repeats.farthest(health.Followed((0, 5), surface, np.array(moved[:1] * 2))) is None
    assert repeats.farthest(health.Followed((0,), surface, np.array(moved[:1]))) is None


def test_jitters_are_other_meshes_of_the_same_body_compared_at_the_same_material() -> None:
    hard = CASES["twist.whole_turn"]
    mesh = blocks.problem(hard).mesh
    others = [blocks.problem(repeats.jittered(hard, number)).mesh for number in (1, 2, 1)]
    assert np.array_equal(others[0].points, others[2].points)
    for other in others[:2]:
        moved = np.linalg.norm(other.points - mesh.points, axis=1)
        assert 0 < moved.max() < 2 * repeats.MOVED * 20 / 3  # of cells of 20 / 3 mm
        assert tet_volumes(other.points, other.tets).sum() == pytest.approx(20 * 20 * 60)
    assert not np.array_equal(others[0].points, others[1].points)

    def bent(one: records.Hard) -> tuple[Outcome, health.Followed]:
        """By a linear motion, which every mesh has exactly, and half a per cent of the size more by a mesh of the number 2."""
        built = blocks.problem(one)
        more = 0.005 * np.linalg.norm([20, 20, 60]) * (one.block.seed == 2)
        points, nodes = (
            where @ np.diag([1.0, 1.1, 0.9]) + [more, 0, 0] for where in (built.surface.points, built.mesh.points)
        )
        followed = health.Followed((0,), built.surface, points[None], built.mesh, nodes[None])
        return Outcome("diverged" if one.block.seed == 3 else "converged", "so"), followed

    same = repeats.on_meshes(hard, bent(hard), 2, bent)
    assert same == repeats.SameEnd(
        True, "jitters: 2 converged, up to frame 0, apart by 0.5 % at most, 0.25 % in the median"
    )
    assert not repeats.on_meshes(hard, bent(hard), 3, bent).same


def test_jitters_of_a_shipped_case_have_tetrahedra_of_another_size() -> None:
    hard = CASES["hip.one_radian_at_once"]
    sizes = [repeats.jittered(hard, number).shipped.read().muscle.tet_size for number in (1, 2)]
    given = hard.shipped.read().muscle.tet_size
    assert sizes[0] != sizes[1]
    assert all(0 < abs(size / given - 1) < repeats.SIZES for size in sizes)
