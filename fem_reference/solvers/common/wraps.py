"""Obstacles around which lines wrap: settings of obstacles, paths around obstacles, and fixed points inside obstacles."""

from dataclasses import dataclass
from functools import partial
from typing import Annotated

import numpy as np
from pydantic import BeforeValidator
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record, join, one_of, rule
from fem_reference.foundations.units import Point, PositiveLength, three
from fem_reference.geometry import winding, wrapping
from fem_reference.geometry.obstacles import Quadric, Ring
from fem_reference.geometry.winding import Winding
from fem_reference.geometry.wrapping import Paths
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone
from fem_reference.scenes.muscle import Axis, CaseSphere, Rod
from fem_reference.solvers.common.lines import index

# A fixed point whose depth inside an obstacle is less than this [mm] counts as on the surface, up to rounding.
_TOUCHES = 1e-6


class Ellipsoid(Record):
    """An ellipsoid at ``centre``. ``radii``: the semi-axes along x, y and z, which are rotated by the rotation vector ``turn``."""

    centre: Point
    radii: tuple[PositiveLength, PositiveLength, PositiveLength]
    turn: Annotated[tuple[float, float, float], BeforeValidator(partial(three, kind="an angle"))] = (0.0, 0.0, 0.0)


class Torus(Record):
    """A ring with a hole through which lines may pass.

    The ring is a tube of radius ``tube`` around a circle, which has a ``centre``, a ``radius`` and an ``axis``.
    """

    centre: Point
    axis: Axis
    radius: PositiveLength
    tube: PositiveLength

    _check = rule(lambda one: one.tube < one.radius, '"tube" less than "radius", so that there is a hole')


class ObstacleOn(Record):
    """An obstacle that moves with a ``bone``: a ``sphere``, ``cylinder``, ``ellipsoid`` or ``torus``.

    Positions and directions are those in the rest state. A cylinder is infinitely long; ``start`` and ``end`` define its axis.
    """

    bone: str
    sphere: CaseSphere | None = None
    cylinder: Rod | None = None
    ellipsoid: Ellipsoid | None = None
    torus: Torus | None = None

    _check = one_of("sphere", "cylinder", "ellipsoid", "torus")

    @property
    def name(self) -> str:
        """The kind of shape, for messages."""
        return next(key for key, given in self if key != "bone" and given is not None)

    def surface(self) -> Quadric | Ring:
        """The surface of the obstacle at rest."""
        if (ball := self.sphere) is not None:
            return Quadric(_pose(Rotation.identity(), ball.centre), np.full(3, ball.radius))
        if (roll := self.cylinder) is not None:
            radii = np.array([roll.radius, roll.radius, np.inf])
            return Quadric(_pose(_onto(np.subtract(roll.end, roll.start)), roll.start), radii)
        if (egg := self.ellipsoid) is not None:
            return Quadric(_pose(Rotation.from_rotvec(egg.turn), egg.centre), np.array(egg.radii))
        ring = self.torus
        assert ring is not None
        return Ring(_pose(_onto(np.array(ring.axis)), ring.centre), ring.radius, ring.tube)


@dataclass(frozen=True, eq=False)
class Wraps:
    """Obstacles on bones. ``given``: the settings of each obstacle. ``bones``: the bone of each obstacle.

    Paths have a closed form if there is a single obstacle and it is a sphere or a cylinder.
    """

    given: tuple[ObstacleOn, ...]
    bones: tuple[Bone, ...]

    def around(self, fixed: Floats, number: int) -> Paths | Winding:
        """The shortest paths at frame ``number`` between successive fixed points of each line, one line after the other.

        ``fixed`` (k, q + 1, 3) [mm]: the fixed points of k lines at this frame.
        """
        starts, ends = fixed[:, :-1].reshape(-1, 3), fixed[:, 1:].reshape(-1, 3)
        if not self.given:
            return wrapping.straight(starts, ends)
        moved = self._moved(number)
        if len(moved) == 1 and isinstance(moved[0], Quadric) and self.given[0].name in ("sphere", "cylinder"):
            return wrapping.around(moved[0], starts, ends)
        return winding.around(moved, starts, ends)

    def inside(self, fixed: Floats, number: int) -> tuple[str, str]:
        """The fixed point that is deepest inside an obstacle at frame ``number``, for an error message.

        Returns the key of the obstacle, and a text with the line and the depth of the point. Both are empty if all of the points
        ``fixed`` (k, q + 1, 3) [mm] are outside all obstacles.
        """
        found = []
        for i, surface in enumerate(self._moved(number)):
            points = fixed.reshape(-1, 3)
            depths = np.linalg.norm(surface.pushed(points) - points, axis=1).reshape(len(fixed), -1).max(axis=1)
            found.append((float(depths.max()), int(depths.argmax()), f"obstacle[{i}]"))
        depth, line, name = max(found, default=(0.0, 0, ""))
        return (
            (name, f"a fixed point {depth:.3g} mm inside the obstacle (line {line})") if depth > _TOUCHES else ("", "")
        )

    def __str__(self) -> str:
        return " and ".join(f"the {one.name} on {one.bone}" for one in self.given)

    def _moved(self, number: int) -> list[Quadric | Ring]:
        return [one.surface().moved(bone.pose(number)) for one, bone in zip(self.given, self.bones, strict=True)]


def wraps_of(problem: MuscleProblem, given: tuple[ObstacleOn, ...], place: str) -> Wraps:
    """The obstacles of a muscle from their settings. Raises InputError, with a key inside ``place``, if a bone does not exist."""
    bones = [index(problem.bones, one.bone, join(place, f"obstacle[{i}].bone")) for i, one in enumerate(given)]
    return Wraps(given, tuple(problem.bones[i] for i in bones))


def _pose(turn: Rotation, centre: tuple[float, float, float]) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn.as_matrix(), centre
    return pose


def _onto(axis: Floats) -> Rotation:
    """A rotation of the z axis onto an ``axis`` (3,)."""
    return Rotation.align_vectors([axis / np.linalg.norm(axis)], [[0, 0, 1]])[0]
