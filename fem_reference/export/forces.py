"""Forces on bones in runs, as a table with moment arms about joints, and as points with vectors."""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.mesh import Floats
from fem_reference.io.formats.vtk import DataBlock
from fem_reference.metrics import MeasurementContext, find
from fem_reference.metrics.moment_arm import turning
from fem_reference.problems.setup import Bone, Setup
from fem_reference.runs.contents import vector_names
from fem_reference.runs.store import Run
from fem_reference.solvers.common.open_formats import write_csv

FILE = "forces.csv"
_ARMS = ("mean", "least", "greatest")
_VECTORS = ("force_{}_N", "at_{}_mm", "moment_{}_N_mm")
COLUMNS = (
    *("run", "frame", "bone", "joint", "angle_deg"),
    *(name.format(axis) for name in _VECTORS for axis in "xyz"),
    *("moment_about_axis_N_mm", *(f"moment_arm_{one}_mm" for one in _ARMS), "moment_arm_by_force_mm", "force_bar_N"),
)
_NOWHERE = np.zeros(3)


def write_table(comparison: Comparison, path: Path) -> None:
    """Write a table with a row for each run, each frame and each bone that has a force or a joint.

    Values that are unknown or infinite are empty.
    """
    found = (row for run in comparison.runs for bone in comparison.setup.bones for row in _rows(comparison, run, bone))
    cells = (["" if isinstance(one, float) and not math.isfinite(one) else one for one in row] for row in found)
    write_csv(path, COLUMNS, cells)


def _rows(comparison: Comparison, run: Run, bone: Bone) -> Iterator[tuple[object, ...]]:
    setup, numbers, context = comparison.setup, comparison.reference.numbers, comparison.context
    assert isinstance(context, MeasurementContext)  # the case is of a muscle
    i = next((i for i, joint in enumerate(setup.joints) if joint.bone.name == bone.name), None)
    joint, lost = None if i is None else setup.joints[i], np.full((len(numbers), 3), np.nan)
    known = bone.name in vector_names(run.scalars, "force_on_")
    if joint is None and not known:
        return
    centre = _NOWHERE if joint is None else joint.centre
    force, moment = (run.force(bone.name), run.moment(bone.name, centre)) if known else (lost, lost)
    at = applied(run, bone, setup) if known else lost
    about = lost[:, 0] if joint is None else moment @ joint.axis
    angles = lost[:, 0] if joint is None else np.degrees(joint.angles(numbers))
    alone = turning(setup.joints, context, numbers) == i
    names = [*(("moment_arm", one) for one in _ARMS), ("joint_moment", "arm")]
    measures = [find(comparison.changes[run.name], *name) for name in names]
    arms = np.array([lost[:, 0] if one is None else np.where(alone, one.values, np.nan) for one in measures])
    bars = None if run is not comparison.reference else comparison.error_bars
    bar = None if bars is None else bars.find("change", "force_on_bone", bone.name)
    width = lost[:, 0] if bar is None else bar.values
    columns = np.column_stack([angles, force, at, moment, about, arms.T, width]).tolist()
    for number, values in zip(numbers, columns, strict=True):
        yield run.name, number, bone.name, "" if joint is None else joint.name, *values


def applied(run: Run, bone: Bone, setup: Setup) -> Floats:
    """The points of application (f, 3) [mm] of the force on a ``bone``, NaN if the force is 0.

    The central axis consists of the points about which the moment is parallel to the force. The point of application is the point
    on this axis that is nearest to the mean of the attached vertices, or to the origin for a bone without an attachment.
    """
    attached = [one.vertices for one in setup.attached if one.bone.name == bone.name]
    vertices = np.concatenate(attached) if attached else np.zeros(0, np.int64)
    force = run.force(bone.name)
    middle = np.zeros_like(force)
    if len(vertices):
        rest = setup.surface.points[vertices].mean(axis=0)
        middle = np.array([bone.pose(number)[:3] @ np.append(rest, 1.0) for number in run.numbers])
    left = run.moment(bone.name) - np.cross(middle, force)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(middle + np.cross(force, left) / (force**2).sum(axis=1, keepdims=True))


def block(run: Run, setup: Setup, i: int) -> DataBlock | None:
    """The points of application with the vectors ``force`` [N] at the frame with index ``i``; None if there is no force."""
    known = [bone for bone in setup.bones if bone.name in vector_names(run.scalars, "force_on_")]
    points = np.array([applied(run, bone, setup)[i] for bone in known]).reshape(-1, 3)
    forces = np.array([run.force(bone.name)[i] for bone in known]).reshape(-1, 3)
    shown = np.isfinite(points).all(axis=1)
    if not shown.any():
        return None
    arrays = {"displacement": np.zeros((int(shown.sum()), 3)), "force": forces[shown]}
    return DataBlock(points[shown], np.zeros((0, 3), np.int64), arrays)
