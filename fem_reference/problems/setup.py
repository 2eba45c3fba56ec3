"""The set-up of a muscle before meshing: its surface, bones, attachments and joints, and the requested frames."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import ClassVar

import numpy as np
import platformdirs
from numpy.typing import NDArray

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import join
from fem_reference.geometry.exemption import Exemption
from fem_reference.geometry.regions import Region
from fem_reference.geometry.rigid_bodies import Obstacle
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.signed_distance import cached
from fem_reference.problems.body import Body
from fem_reference.problems.problem import AtRest, Task
from fem_reference.scenes.muscle import MuscleCase, Vector

# Distances to a bone are computed up to this distance [mm] from it.
DISTANCE_MARGIN = 12.0
# Tolerances: the maximum allowed angle [rad] and distance [mm] between the axis of a joint and the rotation axis of its bone.
_SAME_DIRECTION, _SAME_LINE = 1e-6, 1e-3


def kept_distances() -> Path:
    """The folder in which distance grids are stored. It may be deleted."""
    return platformdirs.user_cache_path("fem_reference") / "distances"


@dataclass(frozen=True, eq=False)
class Bone:
    """A rigid bone. ``surface``: its surface at rest; ``motion``: None if the bone is fixed; ``distance_error`` and
    ``distance_rounding`` [mm]: as in ``CaseBone``; ``solid``: the analytic shape on which the vertices of the surface lie, None
    for a surface from a file.
    """

    name: str
    surface: Surface
    motion: RigidMotion | None
    distance_error: float = 0.05
    distance_rounding: float = 1.0
    solid: Obstacle | None = None

    @cached_property
    def shape(self) -> Obstacle:
        """The signed distance to the bone in its rest pose. Raises InputError if a surface from a file is not closed."""
        named = replace(self.surface, place=f'bone "{self.name}": {self.surface.place}')
        error, rounding = self.distance_error, self.distance_rounding
        return self.solid or cached(named, error, DISTANCE_MARGIN, rounding, kept_distances())

    def pose(self, frame: float) -> Floats:
        """The matrix (4, 4) that maps rest positions to positions at ``frame``."""
        return np.eye(4) if self.motion is None else self.motion.pose(frame)

    def distances(self, frame: float, points: Floats) -> Floats:
        """Signed distances (n,) [mm] of ``points`` (n, 3) to the bone at ``frame``, negative inside."""
        return self.shape.distances(apply(np.linalg.inv(self.pose(frame)), points))


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint in which a ``bone`` rotates, right-handed, about the unit vector ``axis`` (3,) through ``centre`` (3,) [mm].

    ``angle_of``: a function of the frame number that returns the angle of the joint [rad], which is 0 at rest.
    """

    name: str
    bone: Bone
    axis: Floats
    centre: Floats
    angle_of: Callable[[float], float]

    def angles(self, frames: Sequence[float]) -> Floats:
        """The angles (f,) [rad] at frame numbers."""
        return np.array([self.angle_of(frame) for frame in frames])


@dataclass(frozen=True, eq=False)
class AttachedVertices:
    """The ``vertices`` (k,) of the surface that belong to an ``attachment`` to a ``bone``. ``stiffness`` [MPa/mm]: the stiffness of
    springs, None if the attachment is exact. ``tendon`` (3,) [mm]: the point on the bone at rest to which fibres that end near
    these vertices continue, None without a tendon.
    """

    attachment: str
    bone: Bone
    vertices: Ints
    stiffness: float | None = None
    tendon: Floats | None = None


@dataclass(frozen=True, eq=False)
class Setup:
    """The set-up of a muscle, which suffices for a surface solver: its ``surface`` at rest, the ``bones``, the ``attached``
    vertices and the requested ``frames``. ``interval`` [s]: the time between consecutive frame numbers, None if the case does not
    state it. ``start``: a function from rest positions (n, 3) to positions at the first frame, None if they are equal. ``joints``:
    the joints in which bones rotate. ``regions``: the regions in which effects act, by name.
    """

    surface: Surface
    bones: tuple[Bone, ...]
    attached: tuple[AttachedVertices, ...]
    frames: tuple[int, ...]
    interval: float | None
    start: Callable[[Floats], Floats] | None = field(default=None, kw_only=True)
    joints: tuple[Joint, ...] = field(default=(), kw_only=True)
    regions: Mapping[str, Region] = field(default_factory=dict, kw_only=True)

    task: ClassVar[Task] = "solve"
    exact: ClassVar[None] = None  # the solution for a muscle is not known as a formula
    field: ClassVar[None] = None

    @property
    def rest(self) -> AtRest:
        """The rest state of the surface, without fibres and tetrahedra."""
        return AtRest(self.surface)

    @property
    def body(self) -> Body | None:
        """The finite element body; None, because a set-up is not filled with elements."""
        return None

    def begin(self, rest: Floats) -> Floats:
        """The positions (n, 3) [mm] at the first frame of points whose rest positions are ``rest`` (n, 3); a new array."""
        return np.array(rest) if self.start is None else np.array(self.start(rest))

    @cached_property
    def attached_vertices(self) -> Ints:
        """The vertices (k,) of the surface that are attached to bones, in the order of the attachments."""
        return np.concatenate([np.zeros(0, np.int64), *(entry.vertices for entry in self.attached)])

    @cached_property
    def exempt(self) -> Exemption:
        """The part of the surface that is exempt from contact with bones."""
        attached = ((one.bone.name, attached_shares(self.surface, one.vertices)) for one in self.attached)
        return Exemption.of(self.surface, attached)

    @cached_property
    def free(self) -> NDArray[np.bool_]:
        """Mask (n,) of the vertices of the surface that may be in contact with bones."""
        return ~self.exempt.vertices


def joints_of(case: MuscleCase, bones: tuple[Bone, ...]) -> tuple[Joint, ...]:
    """The joints of a case. If the case states none, each rotating bone has a joint with the bone's name and axis of rotation.

    Raises InputError if a bone does not rotate about the axis of its joint, because the joint would have no angle.
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
            got = f'the bone "{bone.name}", which {"is fixed" if bone.motion is None else "slides"}'
            raise InputError(join(place, "bone"), got, "a bone that rotates, so that the joint has an angle")
        _check_axis(bone.motion, np.array(joint.axis), np.array(joint.centre), place)
        found.append(_joint(joint.name, bone, bone.motion, joint.axis, joint.centre))
    return tuple(found)


def _joint(name: str, bone: Bone, motion: RigidMotion, axis: Vector, centre: Vector) -> Joint:
    """The joint of a ``bone``. If ``axis`` is opposite to the axis of the bone's ``motion``, the sign of the angle is reversed."""
    unit, sign = np.array(axis) / np.linalg.norm(axis), float(np.sign(np.dot(axis, motion.axis)))
    return Joint(name, bone, unit, np.array(centre), partial(_angle, motion, sign))


def _angle(motion: RigidMotion, sign: float, frame: float) -> float:
    return sign * float(np.interp(frame, motion.frames, motion.amounts))


def _check_axis(motion: RigidMotion, axis: Floats, centre: Floats, place: str) -> None:
    turns, away = motion.along, centre - np.array(motion.centre)
    if np.linalg.norm(np.cross(axis, turns)) > _SAME_DIRECTION * np.linalg.norm(axis):
        want = f"the axis of the bone's motion, {motion.axis}, or its opposite"
        raise InputError(join(place, "axis"), str(tuple(axis.tolist())), want)
    if (off := float(np.linalg.norm(away - (away @ turns) * turns))) > _SAME_LINE:
        raise InputError(
            join(place, "centre"), f"a point {off:.3g} mm off the axis of the bone's motion", "a point on it"
        )
