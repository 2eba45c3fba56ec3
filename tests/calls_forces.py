"""Forces on bones and moment arms of runs, with numbers that no solver gives, and a second look at tables of them."""

import csv
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st
from odd import INF, NAN, often, rarely

import fem_reference as fr
from fem_reference.foundations.mesh import Floats, Polylines, Surface
from fem_reference.foundations.motion import RigidMotion
from fem_reference.metrics import MeasurementContext, joint_moment, moment_arm
from fem_reference.problems.setup import Bone, Joint
from fem_reference.runs.store import Outcome, Run

BALL = Surface(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
CENTRE = np.array([1.0, 2.0, 3.0])
NUMBERS = [0.0, 1.0, -2.5, 1e-300, 1e-12, 1e12, 1e300, NAN, INF, -INF]
ANGLES = [
    (0.0, 0.1, 0.2, 0.3),
    (0.0, 0.3, 0.1, 0.1),
    (0.0, 0.0, 0.0, 0.0),
    (0.0, 1e-10, 2e-10, 1e-9),
    (0.0, 1e-8, 1.0, 6.0),
]
ANGLES += [(0.0, 1e6, -1e6, 0.0), (0.0, NAN, 0.1, 0.2), (0.0, INF, 0.1, 0.2), (0.3, 0.2, 0.1, 0.0)]


@st.composite
def force_calls(draw: Any, world: Any) -> Callable[[], Any]:
    """Forces asked for, measured, and written."""
    what = draw(st.integers(0, 3))
    if what == 0:
        pulled, bone, centre = (
            draw(runs(BALL.points)),
            draw(often(["femur"])),
            draw(often([(0, 0, 0), CENTRE, [1, 2], (NAN, 0, 0), (1e300, 0, 0)], 3)),
        )
        return lambda: asked(pulled, bone, centre)
    if what == 1:
        one, other, angles = draw(runs(BALL.points)), draw(runs(BALL.points)), draw(st.sampled_from(ANGLES))
        return lambda: measured(one, other, angles)
    values = {
        name: np.array([draw(st.sampled_from(NUMBERS)) for _ in range(3)])
        for name in names(draw(st.sampled_from(["lid", "floor", "lid", "x"])))
    }
    if rarely(draw, 8):
        values.pop(draw(st.sampled_from(sorted(values))))
    return lambda: written(world, values)


def names(bone: str) -> list[str]:
    """The scalars of the force on a ``bone``."""
    return [f"{kind}_on_{bone}_{axis}" for kind in ("force", "moment") for axis in "xyz"]


@st.composite
def runs(draw: Any, points: Floats) -> Run:
    """A run of two fibres that pull a bone, in a few frames with numbers that are none."""
    lines = np.array([[[0.0, 60, 5], [45 - frame, frame, 5], [0, 50, -5], [30, 2.0 * frame, -5]] for frame in range(4)])
    for _ in range(draw(st.integers(0, 2))):
        lines[draw(st.integers(0, 3)), draw(st.integers(0, 3)), draw(st.integers(0, 2))] = draw(
            st.sampled_from(NUMBERS)
        )
    scalars = {name: np.array([draw(st.sampled_from([0.0, 1.0, 3.0])) for _ in range(4)]) for name in names("femur")}
    for name in draw(st.sets(st.sampled_from(names("femur")), max_size=2)):
        scalars[name][draw(st.integers(0, 3))] = draw(st.sampled_from(NUMBERS))
    if rarely(draw, 8):
        scalars.pop("moment_on_femur_y")
    return Run(
        "pulled", "recorded", Outcome("converged", ""), (0, 1, 2, 3), BALL, np.broadcast_to(points, (4, *points.shape)),
        Polylines(np.array([[0.0, 60, 5], [45, 0, 5], [0, 50, -5], [30, 0, -5]]), np.array([0, 2, 4])), lines, scalars,
    )  # fmt: skip


def asked(pulled: Run, bone: Any, centre: Any) -> None:
    """Force and moment as anybody may ask for them, by the lever."""
    force, moment = pulled.force(bone), pulled.moment(bone, centre)
    assert force.shape == moment.shape == (4, 3)
    back = pulled.moment(bone) - np.cross(np.asarray(centre, float), force)
    assert np.array_equal(np.isfinite(back).all(axis=1), np.isfinite(moment).all(axis=1))


def measured(one: Run, other: Run, angles: tuple[float, ...]) -> None:
    """Moments and arms; what depends on a number that is none is none."""
    motion = RigidMotion((0, 0, 1), tuple(CENTRE.tolist()), (0.0, 1.0, 2.0, 3.0), angles)
    bone = Bone("femur", BALL, motion)
    joint = Joint(
        "hip", bone, np.array([0.0, 0, 1]), CENTRE, lambda frame: float(np.interp(frame, motion.frames, angles))
    )
    assert one.fibres is not None
    context = MeasurementContext.of(one, one.fibres, (bone,), None, (joint,))
    for found in (*joint_moment.measure(one, other, context), *moment_arm.measure(one, other, context)):
        assert found.values.shape == (4,)
        if found.metric == "joint_moment":
            wanted = [run.scalars[name] for run in (one, other) for name in names("femur") if found.statistic in name]
            lost = ~np.isfinite(wanted).all(axis=0)
            assert not np.isfinite(found.values[lost]).any(), "a number of what is none"


def written(world: Any, values: dict[str, Floats]) -> None:
    """The table of forces, whose cells are numbers or empty."""
    reference = replace(world.reference, scalars=world.reference.scalars | values)
    result = fr.compare(world.case, reference, [replace(world.pbd, name="mine")])
    place = world.new()
    fr.export_runs(result, place)
    with (place / "forces.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert rows
    for row in rows:
        for key, cell in row.items():
            if key not in ("run", "bone", "joint"):
                assert cell == "" or math.isfinite(float(cell)), f"{key}: {cell}"
