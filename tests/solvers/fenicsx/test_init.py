"""The reference solver: exact where the answer is exact, of the right stiffness, independent of ranks, and honest when it fails."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference import effects
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.mesh import Polylines, TetMesh
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import Settings, processes
from validation.torsion import square_bar_stiffness

pytestmark = pytest.mark.slow

MU, BULK = 0.01, 10.0
MUSCLE = (
    effects.find("neo_hooke").model_validate({"mu": f"{MU} MPa"}),
    effects.find("incompressible").model_validate({"bulk": f"{BULK} MPa"}),
)


def turning(angle: float, axis=(0, 0, 1), centre=(5.0, 5.0, 0.0), last=10.0) -> RigidMotion:
    return RigidMotion(axis, centre, (0.0, last), (0.0, angle))


def solved(problem, **settings) -> tuple[Outcome, list[Frame]]:
    frames: list[Frame] = []
    outcome = fenicsx.solve(problem, Settings(**settings), frames.append)
    return outcome, frames


def test_both_ends_moved_alike_is_a_rigid_motion() -> None:
    # Exact in any finite element space with linear functions: no energy, det F = 1, up to the residual that ends Newton's method.
    motion = turning(1.2, axis=(1, 2, 3), centre=(30, 0, 10))
    outcome, frames = solved(
        shapes.bar((2, 2, 3), (10, 10, 20), {"bottom": motion, "top": motion}, MUSCLE, (0, 5, 10)), ranks=1
    )
    assert outcome.status == "converged"
    assert [frame.number for frame in frames] == [0, 5, 10]
    problem = shapes.bar((2, 2, 3), (10, 10, 20), {"bottom": motion, "top": motion}, MUSCLE, (0, 5, 10))
    for frame in frames:
        expected = apply(motion.pose(frame.number), problem.surface.points)
        assert np.abs(frame.surface - expected).max() < 1e-6
        assert frame.fibres == pytest.approx(apply(motion.pose(frame.number), problem.fibres.points), abs=1e-6)
        assert frame.points == pytest.approx(apply(motion.pose(frame.number), problem.mesh.points), abs=1e-6)
        assert frame.scalars["min_det_F_quadrature"] == pytest.approx(1, abs=1e-7)
        assert frame.scalars["min_det_F_vertices"] == pytest.approx(1, abs=1e-7)
        assert frame.scalars["energy"] == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        (
            {"element": "P1"},
            'element: got "P1", want an element for tetrahedron cells with a pressure, which an effect needs',
        ),
        ({"element": "Q2/Q1"}, 'element: got "Q2/Q1", want an element for tetrahedron cells with a pressure'),
        ({"element": "P1/P1", "quadrature_degree": 1}, "quadrature_degree: got 1, want 2 or more for P1/P1"),
    ],
)
def test_a_problem_made_in_python_is_refused_as_a_case_is(given, wanted) -> None:
    problem = shapes.bar((1, 1, 1), (10, 10, 20), {"bottom": None, "top": None}, MUSCLE, (0,))
    with pytest.raises(InputError, match=wanted):
        solved(problem, **given)


def test_a_pressure_that_no_effect_brings_is_refused() -> None:
    problem = shapes.bar((1, 1, 1), (10, 10, 20), {"bottom": None, "top": None}, MUSCLE[:1], (0,))
    with pytest.raises(InputError, match=r'element: got "P2/P1", want an element for .* without a pressure'):
        solved(problem, element="P2/P1")


def test_torsion_stiffness_of_a_square_bar() -> None:
    # Clamped ends stiffen both bars alike, so the difference of two lengths is free of them. P2 on 4 x 4 cells across: 1
    # %.
    side, angle = 10.0, 0.1
    energy = {}
    for length, cells in ((20, 6), (40, 12)):
        motions = {"bottom": None, "top": turning(angle)}
        outcome, frames = solved(shapes.bar((4, 4, cells), (side, side, length), motions, MUSCLE, (0, 10)), ranks=1)
        assert outcome.status == "converged"
        energy[length] = frames[-1].scalars["energy"]
    compliance = angle**2 / 2 * (1 / energy[40] - 1 / energy[20]) / 20
    assert compliance == pytest.approx(1 / square_bar_stiffness(MU, side), rel=0.01)


@pytest.fixture(scope="module")
def bent():
    """A bar bent by 0.6 rad and back: (problem, outcome, frames) on one rank."""
    motion = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0, 20.0), (0.0, 0.6, 0.0))
    problem = shapes.bar((2, 2, 6), (10, 10, 40), {"bottom": None, "top": motion}, MUSCLE, (0, 5, 10, 15, 20))
    return problem, *solved(problem, ranks=1)


def test_there_and_back_ends_at_rest(bent) -> None:
    problem, outcome, frames = bent
    assert outcome.status == "converged"
    assert np.abs(frames[2].surface - problem.surface.points).max() > 5
    assert np.abs(frames[-1].surface - problem.surface.points).max() < 1e-6
    assert all(frame.scalars["volume_ratio"] == pytest.approx(1, abs=5e-3) for frame in frames)


@pytest.mark.usefixtures("all_cores")
def test_ranks_change_the_time_and_not_the_answer(bent) -> None:
    problem, alone, frames = bent
    outcome, shared = solved(problem, ranks=2)
    assert (alone.cost["ranks"], outcome.cost["ranks"]) == (1, 2)
    for one, two in zip(frames, shared, strict=True):
        for part in ("surface", "fibres", "points"):
            assert getattr(two, part) == pytest.approx(getattr(one, part), abs=1e-6)
        assert two.scalars["energy"] == pytest.approx(one.scalars["energy"], rel=1e-6, abs=1e-9)


@pytest.mark.usefixtures("all_cores")
def test_ranks_do_not_change_what_stabilises_pressures() -> None:
    motion = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.6))
    problem = shapes.bar((2, 2, 4), (10, 10, 40), {"bottom": None, "top": motion}, MUSCLE, (0, 10))
    (_, alone), (_, shared) = (solved(problem, ranks=ranks, element="P1/P1") for ranks in (1, 2))
    assert shared[-1].points == pytest.approx(alone[-1].points, abs=1e-9)
    assert shared[-1].scalars["energy"] == pytest.approx(alone[-1].scalars["energy"], rel=1e-9)


def test_attached_vertices_follow_their_bone(bent) -> None:
    problem, _, frames = bent
    for frame in frames:
        for attached in problem.attached:
            expected = apply(attached.bone.pose(frame.number), problem.surface.points[attached.vertices])
            assert frame.surface[attached.vertices] == pytest.approx(expected, abs=1e-9)


@pytest.mark.usefixtures("all_cores")
def test_more_ranks_than_tets_still_solve() -> None:
    # Of the six tets of a cube, one that is attached below and one above.
    cube = shapes.bar((1, 1, 1), (10, 10, 10), {"bottom": None, "top": turning(0.1)}, MUSCLE, (0, 10))
    ends = [np.isin(cube.mesh.tets, facets[0]).sum(axis=1).argmax() for facets in cube.mesh.facets.values()]
    used, tets = np.unique(cube.mesh.tets[ends], return_inverse=True)
    facets = {name: np.searchsorted(used, triangles[:1]) for name, triangles in cube.mesh.facets.items()}
    problem = replace(cube, mesh=TetMesh(cube.mesh.points[used], tets.reshape(2, 4), facets))
    outcome, frames = solved(problem, ranks=3, time_limit="60 s", store_state=True)
    assert outcome.status == "converged"
    assert len(frames) == 2
    assert frames[-1].state.displacement.shape == (2, 10, 3)
    assert frames[-1].state.displacement[:, :4] == pytest.approx(
        (frames[-1].points - problem.mesh.points)[problem.mesh.tets]
    )


def test_how_far_attached_vertices_are_off_is_recorded(bent) -> None:
    # On this body every attached vertex is a corner of a attached facet.
    _, _, frames = bent
    for frame in frames:
        assert 0 <= frame.scalars["attachment_error_rms"] <= frame.scalars["attachment_error_max"] < 1e-9


def test_missing_software_is_named(bent, monkeypatch) -> None:
    problem, *_ = bent
    with monkeypatch.context() as without:
        without.setattr("importlib.util.find_spec", lambda _: None)
        with pytest.raises(MissingSoftware, match=r"pip install 'fem_reference\[fenicsx\]'"):
            solved(problem)
    monkeypatch.setattr(processes.shutil, "which", lambda _: None)
    monkeypatch.setattr(processes.sys, "executable", "/nowhere/python")
    with pytest.raises(MissingSoftware, match="3 ranks need mpiexec"):
        fenicsx.require(Settings(ranks=3))


def test_a_tendon_pulls_at_the_bone_that_it_goes_to() -> None:
    """The top is lifted by 2 mm, and with it the tendon of a fibre that ends in the middle of a side. Bones take all forces, so
    that their sum is 0, to the residual; without the tendon's it would be the tendon's.
    """
    lift = RigidMotion((0, 0, 1), None, (0.0, 1.0), (0.0, 2.0))
    tendon = effects.make("tendon", on="top", stiffness="1 N/mm", reach="6 mm")
    problem = shapes.bar((2, 2, 4), (10.0, 10.0, 40.0), {"bottom": None, "top": lift}, (*MUSCLE, tendon), (0, 1))
    tied = replace(problem.attached[1], tendon=np.array([40.0, 5.0, 100.0]))
    fibre = Polylines(np.array([[5.0, 5, 0], [10, 5, 20]]), np.array([0, 2]))
    outcome, frames = solved(replace(problem, attached=(problem.attached[0], tied), fibres=fibre))
    assert outcome.status == "converged"
    last = frames[-1].scalars
    assert last["force_top_tendon"] > 0.05
    for axis in "xyz":
        assert sum(last[f"force_on_{one.bone.name}_{axis}"] for one in problem.attached) == pytest.approx(0, abs=1e-6)


def test_volumes_of_several_muscles_add_up_to_that_of_all() -> None:
    """Two bars, one bent: the solver's own integral over both is the mean of theirs, weighted by volume."""
    soft = (MUSCLE[0], effects.find("incompressible").model_validate({"bulk": "20 kPa"}))
    still, bent = turning(0.0), turning(0.8, axis=(0, 1, 0), centre=(0.0, 0.0, 0.0))
    bars = {
        name: shapes.bar((1, 1, 2), size, {"bottom": still, "top": motion}, soft, (0, 10))
        for name, size, motion in (("a", (10, 10, 20), still), ("b", (8, 8, 30), bent))
    }
    outcome, frames = solved(MusclesProblem(bars, (), None, apart=False), ranks=1)
    assert outcome.status == "converged"
    found = frames[-1].scalars
    assert found["a.volume_ratio"] == pytest.approx(1, abs=1e-12)
    assert abs(found["b.volume_ratio"] - 1) > 0.01
    mean = (2000 * found["a.volume_ratio"] + 1920 * found["b.volume_ratio"]) / 3920
    assert found["volume_ratio"] == pytest.approx(mean, rel=1e-12)
