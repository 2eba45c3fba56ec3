"""Force of the muscle on the bone of the rotating joint, by attachments and contact, and its moment about the axis of the joint.

A moment is positive if it rotates the bone towards larger angles. The moment arm is the moment divided by the force. The axis is
fixed in space. By virtual work, without dissipation, the moment is minus the derivative of the stored energy with respect to the
angle. Lines of action pull at their ends, at via-points and at obstacles. The force is unknown for lines without the Hill model
(``hill``) and for most fast solvers.

This moment arm differs from that of ``moment_arm``, which follows from the excursion of fibres: a bent muscle matrix carries a
moment with little force (docs/measures.md).
"""

from functools import partial

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.metrics.moment_arm import turning
from fem_reference.problems.setup import Joint
from fem_reference.runs.contents import vector_names
from fem_reference.runs.store import Run

_of_one = partial(Statistic, local=True, lone=True)
STATISTICS = {
    "moment": Statistic(
        "N mm",
        "Joint",
        "moment",
        curve="Moment of the muscle about the joint",
        shown={"curve": 26, "angle": 26, "rank": 50},
    ),
    "force": _of_one(
        "N", "Joint", "force", curve="Force of the muscle on the bone of the joint", shown={"curve": 27, "angle": 27}
    ),
    "arm": _of_one(
        "mm", "Joint", "moment arm by force", curve="Moment arm: moment / force", shown={"curve": 28, "angle": 28}
    ),
}
OF, AGAINST = "lines", "reference"
_LEAST = 1e-6  # a force below this fraction of the maximum force is round-off and has no moment arm


def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """Differences of ``moment`` [N mm], ``force`` [N] and ``arm`` [mm] from the reference; NaN in frames in which no joint rotates
    alone. Without force, the arm is NaN too.
    """
    joints = [joint for joint in context.joints if _has_force(run, joint)]
    # The rest state of a run, which has no force, is the standard for its change from rest.
    if not joints or not (reference.solver == "rest" or all(_has_force(reference, joint) for joint in joints)):
        return ()
    which, found = turning(joints, context, run.numbers), np.full((3, len(run.numbers)), np.nan)
    for i, joint in enumerate(joints):
        expected = 0.0 if reference.solver == "rest" else _values(reference, joint)
        found[:, which == i] = (_values(run, joint) - expected)[:, which == i]
    return measures("joint_moment", dict(zip(STATISTICS, found, strict=True)))


def _has_force(run: Run, joint: Joint) -> bool:
    return joint.bone.name in vector_names(run.scalars, "force_on_")


def _values(run: Run, joint: Joint) -> Floats:
    """The moment, the force and the moment arm (3, f) in each frame.

    For a muscle that is a line between two bones, or around obstacles on these bones, the arm is ``-dl/dtheta``. For any other
    muscle it is, by virtual work, the mean of ``-dl/dtheta`` over all parts that pull, weighted by their shares of the resultant.
    """
    moment = run.moment(joint.bone.name, joint.centre) @ joint.axis
    force = np.linalg.norm(run.force(joint.bone.name), axis=1)
    known = force > _LEAST * force.max(initial=0.0)
    return np.array([moment, force, np.divide(moment, force, out=np.full(len(force), np.nan), where=known)])
