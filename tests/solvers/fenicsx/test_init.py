"""The reference solver: exact where the answer is exact, of the right stiffness, independent of ranks, and honest when it fails."""

import json
import signal
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference import effects
from fem_reference.foundations.mesh import TetMesh
from fem_reference.foundations.motion import Rotation, apply
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import Settings, processes
from fem_reference.solvers.fenicsx.processes import MARK, running
from validation.torsion import square_bar_stiffness

pytestmark = pytest.mark.slow

MU, BULK = 0.01, 10.0
MUSCLE = (
    effects.find("neo_hooke").model_validate({"mu": f"{MU} MPa"}),
    effects.find("incompressible").model_validate({"bulk": f"{BULK} MPa"}),
)


def turning(angle: float, axis=(0, 0, 1), centre=(5.0, 5.0, 0.0), last=10.0) -> Rotation:
    return Rotation(axis, centre, (0.0, last), (0.0, angle))


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
    motion = Rotation((1, 0, 0), (5, 5, 0), (0.0, 10.0, 20.0), (0.0, 0.6, 0.0))
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
        for part in ("surface", "fibres", "tets"):
            assert getattr(two, part) == pytest.approx(getattr(one, part), abs=1e-6)
        assert two.scalars["energy"] == pytest.approx(one.scalars["energy"], rel=1e-6, abs=1e-9)


@pytest.mark.usefixtures("all_cores")
def test_ranks_do_not_change_what_stabilises_pressures() -> None:
    motion = Rotation((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.6))
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


def test_cost_says_where_the_time_went(bent) -> None:
    _, outcome, frames = bent
    cost = outcome.cost
    # And those to states halfway, where forces change much within a load step.
    assert 2 * sum(frame.scalars["newton_iterations"] for frame in frames) >= cost["newton_iterations"]
    assert cost["newton_iterations"] >= sum(frame.scalars["newton_iterations"] for frame in frames)
    assert cost["seconds_processor_solve"] == pytest.approx(sum(frame.scalars["seconds_processor"] for frame in frames))
    # Of a body so small one for each iteration, and one for the stability of each frame but the last two, which were solved before.
    assert cost["factorisations"] == cost["newton_iterations"] + len(frames) - 2
    assert cost["krylov_iterations"] >= cost["newton_iterations"]
    assert cost["load_steps"] >= 2
    spent = cost["seconds_solve"] + cost["seconds_stability"]
    assert spent >= cost["seconds_assembly"] + cost["seconds_factorisation"]
    phases = ("mesh", "set_up", "solve", "assembly", "contact", "factorisation", "krylov", "stability")
    assert all(cost[f"seconds_{phase}"] >= 0 for phase in phases)
    assert cost["unknowns"] == 3 * 5 * 5 * 13 + 3 * 3 * 7  # P2 nodes of a 2 x 2 x 6 Kuhn box, P1 nodes
    assert cost["peak_memory_mb"] > 10


def test_an_old_factorisation_serves_as_long_as_it_is_worth_it(bent) -> None:
    problem, direct, frames = bent
    for precision in ("single", "double"):
        lagged, found = solved(problem, ranks=1, linear_solver="lagged", precision=precision)
        assert lagged.cost["factorisations"] <= direct.cost["factorisations"] / 2
        for one, other in zip(frames, found, strict=True):
            assert np.abs(one.points - other.points).max() < 1e-9
            assert one.scalars["negative_modes"] == other.scalars["negative_modes"]


def test_a_pose_that_was_solved_before_needs_no_iteration(bent) -> None:
    """At rest again, and halfway there."""
    _, _, frames = bent
    assert [frame.scalars["newton_iterations"] > 0 for frame in frames] == [False, True, True, False, False]


def test_what_cannot_be_reached_is_a_status_that_keeps_the_frames_before() -> None:
    # The top is turned through half a circle about an axis within the bar: no admissible state, and no step is small enough.
    motion = Rotation((1, 0, 0), (5, 5, 9), (0.0, 1.0, 10.0), (0.0, 0.02, 3.1))
    problem = shapes.bar((1, 1, 1), (10, 10, 10), {"bottom": None, "top": motion}, MUSCLE, (0, 1, 10))
    outcome, frames = solved(problem, ranks=1, smallest_step=1.0)
    assert outcome.status in ("diverged", "inverted")
    assert outcome.message.endswith("try a smaller motion or smaller cells (muscle.tet_size)")
    assert "of cell" in outcome.message
    assert [frame.number for frame in frames] == [0, 1]


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


@pytest.mark.usefixtures("all_cores")
def test_an_error_on_one_rank_ends_all(tmp_path) -> None:
    # The first rank finds no job and stops; the other would wait for it for ever.
    code = "from mpi4py import MPI; comm = MPI.COMM_WORLD; 1 / comm.rank; comm.Barrier()"
    (tmp_path / "half.py").write_text(code)
    (*start, _) = fenicsx._command(Settings(ranks=2), tmp_path)
    outcome = fenicsx._run([*start[:-2], str(tmp_path / "half.py")], Settings(time_limit="30 s"), lambda _: None)
    assert outcome.status == "crashed"
    assert "ended with exit status" in outcome.message  # and why, unless mpiexec ended before it had passed that on


def test_how_far_attached_vertices_are_off_is_recorded(bent) -> None:
    # On this body every attached vertex is a corner of a attached facet.
    _, _, frames = bent
    for frame in frames:
        assert 0 <= frame.scalars["attachment_error_rms"] <= frame.scalars["attachment_error_max"] < 1e-9


def test_a_process_that_dies_is_a_status() -> None:
    command = [sys.executable, "-c", "import sys; sys.exit('no memory')"]
    outcome = fenicsx._run(command, Settings(), lambda _: None)
    assert outcome.status == "crashed"
    assert "exit status 1 (no memory); no frame was reached" in outcome.message


def test_a_time_limit_is_a_status() -> None:
    command = [sys.executable, "-c", "while True: pass"]
    outcome = fenicsx._run(command, Settings(time_limit="0.5 s"), lambda _: None)
    assert outcome.status == "timed out"
    assert "stopped after 0.5 s of processor time, the time limit" in outcome.message


@pytest.mark.usefixtures("all_cores")
def test_a_time_limit_is_of_each_process(tmp_path) -> None:
    (tmp_path / "busy.py").write_text("from mpi4py import MPI\nwhile MPI.COMM_WORLD.rank < 9: pass")
    (*start, _) = fenicsx._command(Settings(ranks=2), tmp_path)
    outcome = fenicsx._run([*start[:-2], str(tmp_path / "busy.py")], Settings(time_limit="1 s"), lambda _: None)
    assert outcome.status == "timed out"


def test_a_machine_that_is_busy_is_no_time_limit(monkeypatch) -> None:
    """A process that waits for three times its limit, as one does that gets no processor, goes on; at last it says nothing."""
    report = json.dumps({"status": "converged", "message": "done", "cost": {}})
    waits = f"import time; time.sleep(1.5); print({MARK + report!r}, flush=True)"
    outcome = fenicsx._run([sys.executable, "-c", waits], Settings(time_limit="0.5 s"), lambda _: None)
    assert outcome.status == "converged"
    monkeypatch.setattr(processes, "CLOCK", 0.5)
    outcome = fenicsx._run(
        [sys.executable, "-c", waits.replace("1.5", "60")], Settings(time_limit="0.5 s"), lambda _: None
    )
    assert outcome.status == "stalled"
    assert "the machine was busy, or something waited; that says nothing of what was solved" in outcome.message


@pytest.mark.usefixtures("all_cores")
def test_an_interrupt_right_after_the_start_ends_all_ranks(tmp_path) -> None:
    (tmp_path / "sleep.py").write_text("import time; time.sleep(60)")
    (*start, _) = fenicsx._command(Settings(ranks=2), tmp_path)
    begin = time.perf_counter()
    with pytest.raises(KeyboardInterrupt), running([*start[:-2], str(tmp_path / "sleep.py")], None) as started:
        raise KeyboardInterrupt  # mpiexec has no processes yet, and ignores what comes before them
    assert started.process.returncode != 0
    assert time.perf_counter() - begin < 20


@pytest.fixture
def deaf(monkeypatch):
    """The command line of a process that does not listen to signals, once it has reported 1."""
    monkeypatch.setattr(processes, "_PATIENCE", 0.3)
    ignore = "import signal, time; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
    return [sys.executable, "-c", f"{ignore}; print({MARK!r} + '1', flush=True)\nwhile True: pass"]


def test_an_interrupt_kills_a_process_that_does_not_listen(deaf) -> None:
    def interrupt(started) -> None:
        next(started.events())
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), running(deaf, None) as started:
        interrupt(started)
    assert started.process.returncode == -signal.SIGKILL


def test_a_time_limit_kills_a_process_that_does_not_listen(deaf) -> None:
    with running(deaf, None) as started:
        assert next(started.events()) == 1
        with started.limited(0.2):
            assert list(started.events()) == []
        ended = started.ending("nothing is kept")
    assert (ended.status, ended.message) == (
        "timed out",
        "stopped after 0.2 s of processor time, the time limit; nothing is kept",
    )
    assert started.process.returncode == -signal.SIGKILL


def test_missing_software_is_named(bent, monkeypatch) -> None:
    problem, *_ = bent
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises(fenicsx.MissingSoftware, match=r"pip install 'fem_reference\[fenicsx\]'"):
        solved(problem)
    monkeypatch.setattr(fenicsx.shutil, "which", lambda _: None)
    monkeypatch.setattr(fenicsx.sys, "executable", "/nowhere/python")
    with pytest.raises(fenicsx.MissingSoftware, match="3 ranks need mpiexec"):
        fenicsx._command(Settings(ranks=3), None)
