"""Forces and moments at the joint: statics by hand, virtual work, and what has no force."""

from dataclasses import replace

import numpy as np
import pytest
import small
from numpy.testing import assert_allclose
from scipy.integrate import simpson

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import Rotation
from fem_reference.metrics import MeasurementContext, at_rest, context_of, find, measure
from fem_reference.problems.of_case import setup
from fem_reference.problems.setup import Bone, Joint
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Outcome, Run
from fem_reference.studies import workflow

BALL = Surface(
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
)
FORCES = np.array([[0.0, 0, 0], [0, 3, 4], [0, 6, 8]])
POINT, CENTRE, AXIS = np.array([7.0, 10, 0]), np.array([1.0, 2, 0]), np.array([1.0, 0, 0])


def pulled(forces: np.ndarray = FORCES) -> Run:
    """A run whose muscle pulls the femur at ``POINT``."""
    kinds = {"force": forces, "moment": np.cross(POINT, forces)}
    scalars = {
        name: np.array(values)
        for kind, vectors in kinds.items()
        for name, values in zip(vector_scalars(f"{kind}_on_femur", np.zeros(3)), vectors.T, strict=True)
    }
    lines = Polylines(np.array([[0.0, 0, 0], [0, 0, 9]]), np.array([0, 2]))
    moved = np.broadcast_to(lines.points, (3, 2, 3))
    still = np.broadcast_to(BALL.points, (3, 4, 3))
    return Run("run", "fenicsx", Outcome("converged", ""), (0, 1, 2), BALL, still, lines, moved, scalars)


def context(run: Run, angles: tuple[float, ...] = (0.0, 0.1, 0.2)) -> MeasurementContext:
    motion = Rotation((1, 0, 0), (1, 2, 0), (0.0, 1.0, 2.0), angles)
    bone = Bone("femur", BALL, motion)
    joint = Joint("hip", bone, AXIS, CENTRE, lambda frame: float(np.interp(frame, motion.frames, motion.angles)))
    assert run.fibres is not None
    return MeasurementContext.of(run, run.fibres, (bone,), None, (joint,))


def test_a_moment_is_the_lever_times_the_force() -> None:
    """8 mm along y times 4 N along z, about x; the part along the axis of the lever does nothing."""
    run = pulled()
    moment, force = measure(run, at_rest(run), context(run), ["joint_moment"])
    assert_allclose(moment.values, [0, 32, 64])
    assert_allclose(force.values, [0, 5, 10])
    assert_allclose(run.force("femur"), FORCES)
    assert_allclose(run.moment("femur", POINT), 0, atol=1e-12)  # its point of application


def test_differences_and_missing_forces() -> None:
    run, twice = pulled(), pulled(2 * FORCES)
    moment, _ = measure(twice, run, context(run), ["joint_moment"])
    assert_allclose(moment.values, [0, 32, 64])
    assert all((one.values == 0).all() for one in measure(run, run, context(run), ["joint_moment"]))
    bare = replace(run, scalars={})
    assert measure(bare, run, context(run), ["joint_moment"]) == ()
    assert measure(run, bare, context(run), ["joint_moment"]) == ()  # no deviation from forces that are not known
    with pytest.raises(InputError, match='bone: got "tibia", want one of femur'):
        run.force("tibia")
    with pytest.raises(InputError, match="no force is known"):
        bare.force("femur")


def test_a_joint_that_never_turns_has_no_moment() -> None:
    run = pulled()
    found = measure(run, at_rest(run), context(run, (0.0, 0.0, 0.0)), ["joint_moment"])
    assert all(np.isnan(one.values).all() for one in found)


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, MeasurementContext]:
    folder = tmp_path_factory.mktemp("work")
    case = workflow.load_case(small.write(folder / "bar"), {"frames.last": 10, "frames.every": 1})
    run = workflow.solve(case, store=folder / "store")
    assert run.outcome.status == "converged", run.outcome.message
    return run, context_of(setup(case), run)


def test_virtual_work(bar: tuple[Run, MeasurementContext]) -> None:
    """Without dissipation the moment is minus the slope of the energy, so that its integral over the angle is the energy.

    1 % leaves room for Simpson's rule in steps of 0.04 rad; an axis 1 mm off changes more than 3 %.
    """
    run, given = bar
    moment = find(measure(run, at_rest(run), given, ["joint_moment"]), "joint_moment", "moment")
    assert moment is not None
    angles, energy = given.joints[0].angles(run.numbers), run.scalars["energy"]
    assert_allclose(-simpson(moment.values, angles), energy[-1], rtol=0.01)
    assert moment.values[-1] < 0 < angles[-1]  # the muscle resists
    off = replace(given.joints[0], centre=given.joints[0].centre + [0, 0, 1])
    wrong = find(measure(run, at_rest(run), replace(given, joints=(off,)), ["joint_moment"]), "joint_moment", "moment")
    assert wrong is not None
    assert abs(-simpson(wrong.values, angles) / energy[-1] - 1) > 0.03


def test_forces_on_all_bones_balance(bar: tuple[Run, MeasurementContext]) -> None:
    run, _ = bar
    forces = {name: run.force(name) for name in ("floor", "lid")}
    greatest = np.abs(forces["lid"]).max()
    assert greatest > 0.01
    assert_allclose(forces["floor"] + forces["lid"], 0, atol=1e-6 * greatest)
    moments = run.moment("floor") + run.moment("lid")
    assert_allclose(moments, 0, atol=1e-6 * np.abs(run.moment("lid")).max())


def test_a_case_without_a_joint_has_no_moment() -> None:
    run = pulled()
    assert measure(run, at_rest(run), replace(context(run), joints=()), ["joint_moment"]) == ()
