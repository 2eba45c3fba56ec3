"""Runs of hard cases as their health is measured: by surface solvers, by bodies and of fields; again in other steps and meshes."""

import numpy as np
import pytest
import stand_ins
from hard_cases import CASES

from fem_reference.assessment import health
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import tet_volumes
from fem_reference.problems import of_case
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx, pbd
from fem_reference.studies.hard import blocks, following, records
from fem_reference.studies.hard.following import StalledError, follow


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["pbd", "scikit_fem"])
def test_at_rest_a_surface_stays_where_it_is(solver: str) -> None:
    problem = blocks.problem(CASES["at_rest.millimetres"])
    if solver == "scikit_fem":  # it takes up to 200 tetrahedra
        small = CASES["at_rest.millimetres"].block.model_copy(update={"cells": (2, 2, 3)})
        problem = blocks.problem(CASES["at_rest.millimetres"].model_copy(update={"block": small}))
    outcome, followed = follow(problem, records.choices()[solver])
    assert outcome.status == "converged"
    assert followed.numbers == problem.frames
    assert np.abs(followed.positions - problem.surface.points).max() < 1e-6
    assert (followed.nodes is None) == (solver == "pbd")


def test_a_body_of_many_tetrahedra_is_too_large_for_the_second_solver() -> None:
    block = CASES["at_rest.millimetres"].block.model_copy(update={"cells": (4, 4, 8)})
    problem = blocks.problem(CASES["at_rest.millimetres"].model_copy(update={"block": block}))
    with pytest.raises(InputError, match="got 768 tetrahedra, want at most 200"):
        follow(problem, records.choices()["scikit_fem"])


def test_a_solver_that_moves_lines_has_no_health() -> None:
    with pytest.raises(InputError, match="got a solver that moves lines, want a solver that moves a surface"):
        follow(blocks.problem(CASES["at_rest.millimetres"]), records.choices()["line_of_action"])


def test_a_field_has_the_range_of_its_boundary_values() -> None:
    hard = next(hard for hard in CASES.values() if hard.name.startswith("peclet"))
    case = hard.shipped.read()
    outcome, followed = follow(of_case.problem(case, of_case.setup(case)), SolverChoice(solver="scikit_fem"))
    values = [float(entry.value) for entry in case.boundary if entry.value is not None]
    assert followed.range == (min(values), max(values))
    assert followed.values.shape[0] == 1
    assert outcome.status == "converged"


def test_what_is_solved_at_no_frame_is_where_it_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: Outcome("diverged", "at once"))
    problem = blocks.problem(CASES["at_rest.millimetres"])
    followed = follow(problem, records.choices()["pbd"])[1]
    assert np.array_equal(followed.positions, problem.surface.points[None])
    stand_ins.solve_by(monkeypatch, pbd, lambda *_: Outcome("stalled", "busy"))
    with pytest.raises(StalledError, match="busy"):
        follow(problem, records.choices()["pbd"])


def test_a_reference_that_stalls_says_nothing_of_load_steps(monkeypatch) -> None:
    monkeypatch.setattr(fenicsx, "solve", lambda *_: Outcome("stalled", "the machine was busy"))
    built = blocks.problem(CASES["at_rest.millimetres"])
    with pytest.raises(following.StalledError, match="the machine was busy"):
        following.in_steps(built, records.choices()["fenicsx"], records.StepCounts(until=2))


def test_the_farthest_frame_is_where_load_steps_are_compared() -> None:
    surface = blocks.problem(CASES["at_rest.millimetres"]).surface
    moved = [surface.points + shift for shift in (0.0, 3.0, 1.0)]
    assert following.farthest(health.Followed((0, 5, 10), surface, np.array(moved))).until == 5
    assert following.farthest(health.Followed((0, 5), surface, np.array(moved[:1] * 2))) is None
    assert following.farthest(health.Followed((0,), surface, np.array(moved[:1]))) is None


def test_jitters_are_other_meshes_of_the_same_body_compared_at_the_same_material() -> None:
    hard = CASES["twist.whole_turn"]
    mesh = blocks.problem(hard).mesh
    others = [blocks.problem(following.jittered(hard, number)).mesh for number in (1, 2, 1)]
    assert np.array_equal(others[0].points, others[2].points)
    for other in others[:2]:
        moved = np.linalg.norm(other.points - mesh.points, axis=1)
        assert 0 < moved.max() < 2 * following.MOVED * 20 / 3  # of cells of 20 / 3 mm
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

    same = following.on_meshes(hard, bent(hard), 2, bent)
    assert same == following.SameEnd(
        True, "on other meshes: 2 converged, up to frame 0, apart by 0.5 % at most, 0.25 % in the median"
    )
    assert not following.on_meshes(hard, bent(hard), 3, bent).same


def test_jitters_of_a_shipped_case_have_tetrahedra_of_another_size() -> None:
    hard = CASES["hip.one_radian_at_once"]
    sizes = [following.jittered(hard, number).shipped.read().muscle.tet_size for number in (1, 2)]
    given = hard.shipped.read().muscle.tet_size
    assert sizes[0] != sizes[1]
    assert all(0 < abs(size / given - 1) < following.SIZES for size in sizes)


def test_bodies_in_each_other_are_compared_each_with_itself() -> None:
    """Where two bodies overlap, a point has its place in the mesh of its own."""
    hard = CASES["neighbours.overlap"]

    def lifted(one: records.Hard) -> tuple[Outcome, health.Followed]:
        built = blocks.several(one)
        rest, (_, upper), shift = built.rest, built.spans, np.array([0, 0, 5.0])
        points, nodes = np.array(rest.surface.points), np.array(rest.mesh.points)
        points[upper.vertices] += shift
        nodes[upper.points] += shift
        followed = health.Followed((0,), rest.surface, points[None], rest.mesh, nodes[None], spans=built.spans)
        return Outcome("converged", ""), followed

    meshes = [blocks.several(following.jittered(hard, number)).rest.mesh.points for number in (1, 2)]
    assert not np.array_equal(*meshes)
    same = following.on_meshes(hard, lifted(hard), 2, lifted)
    assert same.same
    assert float(same.sentence.split("apart by ")[1].split(" %")[0]) < 1e-6


def test_a_solver_of_one_body_does_not_apply_to_several() -> None:
    """It ended in an AttributeError, which counted as a failure of the solver."""
    with pytest.raises(InputError, match="xpbd: got a solver of a single body, want a solver of several bodies"):
        follow(blocks.several(CASES["neighbours.squeezed"]), records.choices()["xpbd"])
