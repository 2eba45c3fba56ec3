"""Frozen records of the case of a muscle: its surface, the bones and their motion, attachments and the requested frames."""

import math
from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from fem_reference.effects import Effect
from fem_reference.foundations.limits import Range
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import Name, Record, directed, increasing, key_rule, one_of, rule
from fem_reference.foundations.units import Angle, AreaStiffness, Length, LengthUnit, Point, PositiveLength, Time
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS
from fem_reference.scenes.case import Case
from fem_reference.scenes.fibres import Fibres
from fem_reference.scenes.regions import CaseRegion

# The smallest error of the distance to a bone, and the smallest rounding, that a grid can resolve [mm].
_FINEST = 1e-3
MOST_FRAMES = 100_000
LAST_FRAME = 1_000_000_000
Vector = tuple[float, float, float]

Axis = Annotated[Vector, AfterValidator(partial(directed, name="an axis"))]


class Keyframe(Record):
    """The amount of a motion at the frame number ``frame``: the ``angle`` of a rotation or the ``distance`` of a translation."""

    frame: float
    angle: Angle | None = None
    distance: Length | None = None


class Motion(Record):
    """A rotation about a fixed ``axis`` through ``centre``, or a translation along ``direction``, linear between ``keyframes``."""

    axis: Axis | None = None
    centre: Point | None = None
    direction: Annotated[Vector, AfterValidator(partial(directed, name="a direction"))] | None = None
    keyframes: tuple[Keyframe, ...] = Field(min_length=2)

    @field_validator("keyframes")
    @classmethod
    def _check_keyframes(cls, keyframes: tuple[Keyframe, ...], info: ValidationInfo) -> tuple[Keyframe, ...]:
        slides = info.data.get("direction") is not None
        wanted, other = ("distance", "angle") if slides else ("angle", "distance")
        if any(getattr(key, wanted) is None or getattr(key, other) is not None for key in keyframes):
            kind = "translation" if slides else "rotation"
            raise ValueError(f'"frame" and "{wanted}" in each keyframe of a {kind}')
        return keyframes

    @model_validator(mode="after")
    def _check(self) -> Self:
        slides = self.direction is not None
        if (self.axis is None, self.centre is None) != (slides, slides):
            raise ValueError('either "axis" and "centre" (a rotation) or "direction" (a translation)')
        increasing([key.frame for key in self.keyframes], "keyframes in the order of their frames")
        return self

    def poses(self) -> RigidMotion:
        """The motion as a function of the frame number."""
        frames = tuple(key.frame for key in self.keyframes)
        axis = self.axis if self.direction is None else self.direction
        assert axis is not None  # a Motion record has an axis or a direction
        return RigidMotion(axis, self.centre, frames, tuple(key.angle or key.distance or 0.0 for key in self.keyframes))


class CaseHalfSpace(Record):
    """The half-space behind the plane through ``point`` with the outward ``normal``."""

    point: Point
    normal: Annotated[Vector, AfterValidator(partial(directed, name="a normal"))]


class CaseBox(Record):
    """An axis-aligned box with a ``centre`` and outer edge lengths ``size``. ``rounding``: the radius of edges and corners."""

    centre: Point
    size: Point
    rounding: Length = 0.0

    _check_size = key_rule("size", lambda size, _: min(size) > 0, "three lengths above zero")
    _check_rounding = key_rule(
        "rounding",
        lambda rounding, keys: "size" not in keys or 0 <= rounding <= min(keys["size"]) / 2,
        "a length from 0 to half of the shortest edge",
    )


class CaseSphere(Record):
    """A sphere with a ``centre`` and a ``radius``."""

    centre: Point
    radius: PositiveLength


class Rod(Record):
    """A capsule or a cylinder, with a ``radius`` and an axis from ``start`` to ``end``."""

    start: Point
    end: Point
    radius: PositiveLength

    _check_end = key_rule(
        "end",
        lambda end, keys: "start" not in keys or math.dist(keys["start"], end) > 1e-9,
        "a point other than the start",
    )


class CaseBone(Record):
    """A rigid body: a ``surface`` file with coordinates in ``unit``, or exactly one analytic shape (``half_space``, ``box``,
    ``sphere``, ``capsule``, ``cylinder``). Without a ``motion`` the bone is fixed.

    ``distance_error``: the allowed root-mean-square error of the distance near the surface, before the distance is smoothed.
    ``distance_rounding``: the standard deviation of the Gaussian filter that smooths the distance, as sharp edges hinder sliding.
    """

    name: Name
    surface: str | None = None
    unit: LengthUnit | None = None
    half_space: CaseHalfSpace | None = None
    box: CaseBox | None = None
    sphere: CaseSphere | None = None
    capsule: Rod | None = None
    cylinder: Rod | None = None
    motion: Motion | None = None
    distance_error: PositiveLength = 0.05
    distance_rounding: PositiveLength = 1.0

    _check_form = one_of("surface", *CLOSED_FORMS)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.surface is None) != (self.unit is None):
            raise ValueError('"unit" if and only if "surface" is given')
        for key, most in (("distance_error", 1.0), ("distance_rounding", 10.0)):
            if self.surface is None and key in self.model_fields_set:
                raise ValueError(f'"{key}" only with "surface", as an analytic shape has none')
            if not _FINEST <= getattr(self, key) <= most:
                raise ValueError(f'"{key}" from {_FINEST:g} to {most:g} mm')
        return self


class CaseJoint(Record):
    """A joint in which a ``bone`` rotates about an ``axis`` through ``centre``. Its right-handed angle is 0 at the first frame."""

    name: Name
    bone: str
    axis: Axis
    centre: Point


class Muscle(Record):
    """A muscle: its closed triangle ``surface``, with coordinates in ``unit``, and the size ``tet_size`` of its tetrahedra before
    refinement. ``refinements``: the number of times that every tetrahedron is cut into eight. ``mesher``: ``"quality"`` for
    well-shaped tetrahedra, or ``"block"`` for a muscle that is an axis-aligned box.
    """

    surface: str
    unit: LengthUnit
    tet_size: PositiveLength
    refinements: int = Field(default=0, ge=0, le=4)
    mesher: Literal["quality", "block"] = "quality"


class VertexList(Record):
    """Vertices, numbered from 0, in a CSV ``file`` with lines ``vertex[,value]``; if ``value`` is given, only those with it."""

    file: str
    value: int | None = None


class Shift(Record):
    """A displacement by the distance ``by`` in the direction ``along``."""

    along: Annotated[Vector, AfterValidator(partial(directed, name="a direction"))]
    by: Length


class Outline(Record):
    """The vertices of the muscle surface within the distance ``reach`` of patches on the bone. Each of the ``clouds`` of landmarks
    in ``file`` spans a patch. ``shift``: a displacement of the landmarks but not of the fibres.
    """

    file: str
    unit: LengthUnit
    clouds: tuple[str, ...] = Field(min_length=1)
    reach: PositiveLength
    shift: Shift | None = None


class Landmarks(Record):
    """The mean of the landmarks of a ``cloud`` in a ``file``."""

    file: str
    unit: LengthUnit
    cloud: str


class Attachment(Record):
    """The part of the muscle surface that is attached to a ``bone``, given by exactly one of ``vertices``, ``within`` (a distance
    from the bone) and ``outline``. Springs with a ``stiffness`` attach this part to the bone; without a ``stiffness``, it moves
    exactly with the bone.

    Fibres that end near the attachment, but more than 2 mm away from it, continue as a straight tendon to the point ``tendon`` on
    the bone. The tendon pulls only if the effect ``tendon`` acts.
    """

    name: Name
    bone: str
    stiffness: AreaStiffness | None = None
    vertices: VertexList | None = None
    within: PositiveLength | None = None
    outline: Outline | None = None
    tendon: Landmarks | None = None

    _check = one_of("vertices", "within", "outline")


class Frames(Record):
    """The requested frame numbers: ``first``, ``first + every``, ... up to ``last``. ``interval``: the time between consecutive
    frame numbers n and n + 1, needed only by ``inertia``, ``damping``, ``viscosity`` and recorded sequences with times.
    """

    first: int = Field(ge=0)
    last: int
    every: int = Field(gt=0)
    interval: Time | None = None

    _check_last = rule(
        lambda one: one.last > one.first and (one.last - one.first) % one.every == 0,
        "last = first + a multiple of every",
    )
    _check_count = rule(lambda one: (one.last - one.first) // one.every < MOST_FRAMES, f"at most {MOST_FRAMES} frames")
    _check_numbers = rule(lambda one: one.last <= LAST_FRAME, f"frame numbers up to {LAST_FRAME}")

    @property
    def numbers(self) -> tuple[int, ...]:
        """All requested frame numbers."""
        return tuple(range(self.first, self.last + 1, self.every))


class Uncertain(Range):
    """The range, from ``low`` to ``high``, of the number at a ``key`` such as ``effect[0].mu``; it replaces the effect's range."""

    key: str


class DrivenCase(Case):
    """The case of one or several muscles driven by bones. ``choice`` (the key ``effects``): ``"listed"`` if all listed effects act,
    ``"auto"`` if only the effects that are needed act.
    """

    choice: Literal["listed", "auto"] = Field(default="listed", alias="effects")
    muscle: Muscle | tuple[Muscle, ...]
    bone: tuple[CaseBone, ...] = Field(min_length=1)
    joint: tuple[CaseJoint, ...] = ()
    frames: Frames

    task = "solve"
    carries = frozenset({"surface", "lines"})
    naming_files = frozenset({"surface", "file"})

    @property
    def numbers(self) -> tuple[int, ...]:
        """The requested frame numbers."""
        return self.frames.numbers


class MuscleCase(DrivenCase):
    """The case of a muscle. ``effect``: a table for each effect, with its ``name`` and its parameters. ``effects``: with
    ``"listed"`` all of these effects act, with ``"auto"`` only the effects that the case needs. ``quick``: new values by key, for a
    faster and less accurate solution. ``unsolved``: the reason, if the reference does not reach the last frame.
    """

    muscle: Muscle
    attachment: tuple[Attachment, ...] = ()
    region: tuple[CaseRegion, ...] = ()
    fibres: Fibres
    uncertain: tuple[Uncertain, ...] = ()

    determined_by = frozenset({"muscle", "bone", "attachment", "region", "fibres", "frames"})

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects, in the order of the file."""
        return self.effect

    @property
    def facts(self) -> dict[str, str]:
        """A summary of the case in words, by heading."""
        return {
            "muscle": f"{self.muscle.surface}, tetrahedra of {self.muscle.tet_size / 2**self.muscle.refinements:g} mm",
            "bones": ", ".join(bone.name for bone in self.bone),
            "attachments": ", ".join(attachment.name for attachment in self.attachment) or "none",
            "frames": f"{self.frames.first} to {self.frames.last}, every {self.frames.every}",
        }
