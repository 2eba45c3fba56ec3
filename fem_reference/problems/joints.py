"""Joints of a case: the axes about which bones turn, from its ``joint`` or else from the motions of its bones."""

from functools import partial

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import join
from fem_reference.problems.setup import Bone, Joint
from fem_reference.scenes.muscle import MuscleCase

# An axis of a joint is that of its bone's rotation within this angle [rad], and passes it within this distance [mm].
_SAME_DIRECTION, _SAME_LINE = 1e-6, 1e-3


def joints_of(case: MuscleCase, bones: tuple[Bone, ...]) -> tuple[Joint, ...]:
    """The joints of a case; where it names none, one for each bone that rotates, with the bone's name and the axis of its motion.

    InputError where a bone does not rotate about the axis of its joint: its angle would not be defined.
    """
    if not case.joint:
        moving = ((bone, bone.motion) for bone in bones if bone.motion is not None)
        return tuple(
            _joint(bone.name, bone, one, one.axis, one.centre) for bone, one in moving if one.centre is not None
        )
    by_name = {bone.name: bone for bone in bones}
    found = []
    for i, joint in enumerate(case.joint):
        bone, place = by_name[joint.bone], join(case.place, f"joint[{i}]")
        if bone.motion is None or bone.motion.centre is None:
            got = f'the bone "{bone.name}", which {"rests" if bone.motion is None else "slides"}'
            raise InputError(join(place, "bone"), got, "a bone that rotates, so that the joint has an angle")
        _check_axis(bone.motion, np.array(joint.axis), np.array(joint.centre), place)
        found.append(_joint(joint.name, bone, bone.motion, joint.axis, joint.centre))
    return tuple(found)


def _joint(
    name: str, bone: Bone, motion: RigidMotion, axis: tuple[float, float, float], centre: tuple[float, float, float]
) -> Joint:
    """The joint of a bone; an ``axis`` against that of its ``motion`` counts the angle the other way."""
    unit, sign = _unit(axis), float(np.sign(np.dot(axis, motion.axis)))
    return Joint(name, bone, unit, np.array(centre), partial(_angle, motion, sign))


def _angle(motion: RigidMotion, sign: float, frame: float) -> float:
    return sign * float(np.interp(frame, motion.frames, motion.amounts))


def _check_axis(motion: RigidMotion, axis: Floats, centre: Floats, place: str) -> None:
    turns, away = _unit(motion.axis), centre - np.array(motion.centre)
    if np.linalg.norm(np.cross(_unit(axis), turns)) > _SAME_DIRECTION:
        want = f"that of the bone's motion, {motion.axis}, or its opposite"
        raise InputError(join(place, "axis"), str(tuple(axis.tolist())), want)
    if (off := float(np.linalg.norm(away - (away @ turns) * turns))) > _SAME_LINE:
        raise InputError(join(place, "centre"), f"a point {off:.3g} mm off the axis of the bone's motion", "one on it")


def _unit(axis: tuple[float, float, float] | Floats) -> Floats:
    return np.asarray(axis, float) / np.linalg.norm(axis)
