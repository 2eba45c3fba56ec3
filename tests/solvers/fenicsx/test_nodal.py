"""Results of runs by FEniCSx: closed forms of a block, what the solver recorded itself, any number of ranks, and the run folder."""

import json

import numpy as np
import pytest
import shapes
import small
from acting import make

from fem_reference.foundations.mesh import TetMesh
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.problems.shapes import box
from fem_reference.runs import results
from fem_reference.runs.results import NAMES, Results
from fem_reference.runs.store import Frame
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import BodySettings, Settings
from fem_reference.studies.execution import Bench
from validation import homogeneous, laws

pytestmark = pytest.mark.slow

MU, BULK = 0.01, 10.0
MATRIX = (make("neo_hooke"), make("incompressible"))
PENALTY = (make("neo_hooke"), make("incompressible_penalty"))
CORNERS = np.eye(4)


@pytest.mark.parametrize("element", ["P2/P1", "P2/P0", "P1/P1", "P2", "P1"])
def test_a_block_stretched_by_a_half_with_free_sides(fem_lab, element: str) -> None:  # noqa: ARG001
    mesh = box((2, 2, 2), (1.0, 1.0, 1.0), "tetrahedron")
    fixed = [Prescribed(f"low {axis}", f"{axis}0", (i,), Rest()) for i, axis in enumerate("xyz")]
    fixed += [Prescribed("pulled", "x1", (0,), Affine(((0.5, 0, 0), (0, 0, 0), (0, 0, 0))))]
    effects = MATRIX if "/" in element else PENALTY
    body = Body(mesh, effects, tuple(fixed), (0.0, 1.0))
    solved = fenicsx.solve_body(body, BodySettings(element=element, first_step=1, residual=1e-12, store_state=True))
    states = {state.number: state.state for state in (solved.states[0], solved.last)}
    made = Results(TetMesh(mesh.points, mesh.cells), effects, states)
    rest, found = (made.evaluate(mesh.points * 0.98 + 0.01, frame) for frame in (0.0, 1.0))
    assert np.abs(rest["cauchy_stress"]).max() < 1e-15
    truth = homogeneous.uniaxial(laws.neo_hooke(MU), BULK, 1.5)
    J, pull = np.linalg.det(truth.F), truth.P[0, 0] * truth.F[0, 0] / np.linalg.det(truth.F)
    assert found["det_F"] == pytest.approx(np.full(27, J), rel=1e-9)
    assert found["cauchy_stress"] == pytest.approx(np.tile(np.diag([pull, 0, 0]), (27, 1, 1)), abs=1e-8 * pull)
    assert pull == pytest.approx(MU * (1.5**2 - 1 / 1.5), rel=2e-3)  # what an incompressible block takes
    if "/" in element:
        assert found["pressure"] == pytest.approx(np.full(27, BULK * (J - 1)), rel=1e-6)


@pytest.fixture(scope="module")
def turned(fem_lab, all_cores):  # noqa: ARG001
    """A bar bent by 0.6 rad, on one rank and on two: (problem, frames, frames)."""
    motion = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.6))
    problem = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": motion}, MATRIX, (0, 10))
    both: list[list[Frame]] = []
    for ranks in (1, 2):
        frames: list[Frame] = []
        assert fenicsx.solve(problem, Settings(ranks=ranks, store_state=True), frames.append).status == "converged"
        both.append(frames)
    return problem, *both


def test_det_F_is_what_the_run_recorded_at_the_vertices(turned) -> None:
    problem, frames, _ = turned
    made = Results(problem.mesh, problem.effects, {frame.number: frame.state for frame in frames})
    tets = np.repeat(np.arange(len(problem.mesh.tets)), 4)
    for frame in frames:
        corners = made.evaluate_in(tets, np.tile(CORNERS, (len(problem.mesh.tets), 1)), frame.number)
        assert corners["det_F"].min() == pytest.approx(frame.scalars["min_det_F_vertices"], rel=1e-12)
        places = problem.mesh.points[problem.mesh.tets].reshape(-1, 3) + corners["displacement"]
        assert places == pytest.approx(frame.points[problem.mesh.tets].reshape(-1, 3), abs=1e-12)


@pytest.fixture(scope="module")
def integrated(turned):
    """Means over the bent bar by the rule that it was solved with: (mean of the pressure, of det F, of P = J sigma F^-T)."""
    from fem_reference.solvers.fenicsx import dolfinx_door  # noqa: F401 - first
    from fem_reference.solvers.fenicsx.meshes import with_vertices

    problem, frames, _ = turned
    points, weights = with_vertices()
    places = np.column_stack([1 - points.sum(axis=1), points])
    count = len(problem.mesh.tets)
    made = Results(problem.mesh, problem.effects, {10: frames[-1].state})
    found = made.evaluate_in(np.repeat(np.arange(count), len(points)), np.tile(places, (count, 1)), 10)
    back = np.linalg.inv(found["deformation_gradient"])
    nominal = found["det_F"][:, None, None] * found["cauchy_stress"] @ np.swapaxes(back, 1, 2)
    weights = np.tile(weights / weights.sum(), count) / count  # its tets are all of one size
    return weights @ found["pressure"], weights @ found["det_F"], np.einsum("q,qik->ik", weights, nominal)


def test_the_mean_pressure_is_the_bulk_modulus_times_the_change_of_volume(turned, integrated) -> None:
    # The weak form of p = K (J - 1) with the test function 1, which the linear pressures contain.
    _, frames, _ = turned
    pressure, volume, _ = integrated
    assert volume == pytest.approx(frames[-1].scalars["volume_ratio"], rel=1e-12)
    assert pressure / BULK == pytest.approx(volume - 1, abs=1e-11)


def test_the_stress_does_the_work_of_the_force_that_was_recorded(turned, integrated) -> None:
    # Virtual work with the displacement z/L along each axis: the force on the top is the integral of P e_z over the body, over L.
    _, frames, _ = turned
    force = np.linalg.norm(integrated[2][:, 2] * 10 * 10)
    assert force == pytest.approx(frames[-1].scalars["force_top"], rel=1e-7)


def test_ranks_change_nothing(turned) -> None:
    problem, alone, shared = turned
    points = np.random.default_rng(5).uniform(0.1, 0.9, (200, 3)) * [10, 10, 30]
    one, two = (
        Results(problem.mesh, problem.effects, {10: frames[-1].state}).evaluate(points, 10)
        for frames in (alone, shared)
    )
    assert set(one) == set(NAMES) - {"fibre_stretch", "fibre_stress"}
    for name, values in one.items():
        assert two[name] == pytest.approx(values, abs=1e-6 * np.abs(values).max())


def test_viscosity_stores_the_step_it_took(fem_lab) -> None:  # noqa: ARG001
    # A cube sheared by 0.1 in a step of 1 s: sigma_xy = mu g + eta g' to first order in the step.
    effects = (*PENALTY, make("viscosity"))
    mesh = box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    path = Affine(((0, 1e-4, 0), (0, 0, 0), (0, 0, 0)))
    fixed = tuple(Prescribed(side, side, (0, 1, 2), path) for side in ("x0", "x1", "y0", "y1", "z0", "z1"))
    body = Body(mesh, effects, fixed, (0.0, 1.0), interval=1.0)
    state = fenicsx.solve_body(body, BodySettings(element="P2", first_step=0.5, store_state=True)).last.state
    assert state.rate == 2
    found = Results(TetMesh(mesh.points, mesh.cells), effects, {1.0: state}).evaluate([[0.3, 0.4, 0.6]], 1.0)
    assert found["cauchy_stress"][0, 0, 1] == pytest.approx((MU + 0.3) * 1e-4, rel=1e-3)


def test_a_run_keeps_its_states_where_it_was_asked_to(fem_lab, tmp_path) -> None:  # noqa: ARG001
    changes = {"reference": {"solver": "fenicsx", "first_step": 5, "store_state": True}, "frames.last": 5}
    scene = casefile.read(small.write(tmp_path / "bar"), changes=changes)
    plain = casefile.read(tmp_path / "bar", changes={"frames.last": 5})
    assert plain.key == scene.key
    bench, other = (Bench(case, tmp_path / "runs", ranks=1) for case in (scene, plain))
    keys = {made.key("fenicsx", made.settings(made.scene.reference, "reference")) for made in (bench, other)}
    assert len(keys) == 1  # what is kept of a run is no part of what determines it
    run = bench.obtain("reference", scene.reference, "reference")
    assert "state" in json.loads((run.folder / "run.json").read_text())["parts"]
    made = results.of_run(run.folder, scene)
    assert made.frames == (0, 5)
    line = run.fibre_positions[0]
    found = made.evaluate(line, 5)
    there = np.isfinite(found["det_F"])
    assert there.mean() > 0.9
    assert line[there] + found["displacement"][there] == pytest.approx(run.fibre_positions[1][there], abs=1e-10)
