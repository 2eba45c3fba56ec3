"""Moment arms of the fibres about the rotating joint, by the tendon excursion method: ``-dl/dtheta`` (An et al. 1984).

``l`` [mm] is the length of a fibre and ``theta`` [rad] the angle of the joint. The moment arm is positive if the muscle shortens as
the angle increases, as in OpenSim. The slope is that of the parabola through the lengths in the frame and in the two
frames nearest in time that have other angles; its error is of second order in the differences between these angles. If more than
one bone moves, lengths do not depend on a single angle, and the moment arm is NaN. A case without a joint has no moment arms.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.metrics.fibre_length import both_lengths
from fem_reference.problems.setup import Joint
from fem_reference.runs.store import Run

_TITLE = "Moment arm"
STATISTICS = {
    "mean": Statistic(
        "mm", _TITLE, "mean", curve="Moment arm, mean over the fibres", shown={"curve": 25, "angle": 25}, local=True
    ),
    "rms": Statistic("mm", _TITLE, "rms", shown={"solvers": 35, "rank": 40}, local=True),
    "max": Statistic("mm", _TITLE, "worst fibre", shown={"table": 35}, local=True, lone=True),
    "least": Statistic("mm", _TITLE, "least over the fibres", local=True, lone=True),
    "greatest": Statistic("mm", _TITLE, "greatest over the fibres", local=True, lone=True),
}
OF, AGAINST = "lines", "reference"
# Angles [rad], and the entries of pose matrices, count as equal if they differ by at most this.
_SAME = 1e-9


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """Statistics, over the fibres, of ``r - r_reference`` [mm]: ``mean``, ``rms``, minimum (``least``), maximum (``greatest``) and
    maximum magnitude (``max``).
    """
    if not context.joints or len(run.numbers) < 2:
        return ()
    found, expected = both_lengths(run, reference, context)
    arms = excursion_arms(found - expected, context, run.numbers)
    magnitudes = np.abs(arms)
    values = {"mean": arms.mean(axis=1), "rms": np.sqrt(np.mean(arms**2, axis=1)), "max": magnitudes.max(axis=1)}
    values |= {"least": arms.min(axis=1), "greatest": arms.max(axis=1)}
    return measures("moment_arm", values, tuple(f"fibre {fibre}" for fibre in np.argmax(magnitudes, axis=1)))


def excursion_arms(lengths: Floats, context: MeasurementContext, numbers: Sequence[int]) -> Floats:
    """The arms ``-dl/dtheta`` (f, k) [mm] from ``lengths`` (f, k) [mm] at frames ``numbers``; NaN if no joint rotates alone."""
    which, arms = turning(context.joints, context, numbers), np.full(lengths.shape, np.nan)
    for frame, i in enumerate(which):
        if i >= 0:
            angles = context.joints[i].angles(numbers)
            near = _near(angles, frame)
            arms[frame] = -_weights(angles[near] - angles[frame]) @ lengths[near]
    return arms


def turning(joints: Sequence[Joint], context: MeasurementContext, numbers: Sequence[int]) -> Ints:
    """The index (f,) of the joint that rotates just before or after each frame while all other bones are at rest; -1 if none."""
    poses = np.array([[bone.pose(number) for bone in context.bones] for number in numbers])
    names, which = [bone.name for bone in context.bones], np.full(len(numbers), -1)
    for i, joint in enumerate(joints):
        others, angles = np.delete(poses, names.index(joint.bone.name), axis=1), joint.angles(numbers)
        for frame in range(len(numbers)):
            near = _near(angles, frame)
            rest = np.abs(others[near] - others[frame]).max(initial=0.0) <= _SAME
            if len(near) > 1 and rest and which[frame] < 0:
                which[frame] = i
    return which


def _near(angles: Floats, frame: int) -> list[int]:
    """The ``frame`` and up to two frames nearest in time with other angles, between which the joint does not reverse."""
    before = list(_onward(angles, range(frame - 1, -1, -1), frame))
    after = list(_onward(angles, range(frame + 1, len(angles)), frame))
    if before and after and (angles[frame] - angles[before[0]]) * (angles[after[0]] - angles[frame]) > 0:
        return [frame, before[0], after[0]]
    return [frame, *(before or after)]


def _onward(angles: Floats, frames: range, start: int) -> Iterator[int]:
    """Up to two of ``frames`` in which the angle continues in one direction from the angle at ``start``."""
    direction, last, found = 0.0, start, 0
    for frame in frames:
        step = float(angles[frame] - angles[last])
        if abs(step) <= _SAME:
            continue
        if found == 2 or step * direction < 0:
            return
        direction, last, found = step, frame, found + 1
        yield frame


def _weights(offsets: Floats) -> Floats:
    """The weights (k,) of values at ``offsets`` (k,) that give the slope at 0 of the polynomial through these values."""
    powers = np.arange(len(offsets))
    return np.asarray(np.linalg.solve(offsets[None, :] ** powers[:, None], (powers == 1).astype(float)))
