"""Rigid bodies of a scene as frozen records: a surface in a file or a closed form, and how it moves."""

import math
from functools import partial
from itertools import pairwise
from typing import Annotated, Self

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from fem_reference.foundations.motion import Rotation, Translation
from fem_reference.foundations.records import Name, Record
from fem_reference.foundations.units import Angle, Length, LengthUnit, Point, PositiveLength
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS

# Below this [mm] neither the distance to a bone nor its rounding is resolved by any grid; far above a bone has no shape.
_FINEST = 1e-3


Vector = tuple[float, float, float]


def _checked_direction(direction: Vector, name: str) -> Vector:
    if not 1e-9 < math.hypot(*direction) < 1e9:
        raise ValueError(f"{name} that is not zero, with a length from 1e-9 to 1e9")
    return direction


class Keyframe(Record):
    """The place of a motion at a frame number: at an ``angle`` or at a ``distance``."""

    frame: float
    angle: Angle | None = None
    distance: Length | None = None


class Motion(Record):
    """A rotation about a fixed ``axis`` through a ``centre`` or a translation along a ``direction``, linear between keyframes."""

    axis: Annotated[Vector, AfterValidator(partial(_checked_direction, name="an axis"))] | None = None
    centre: Point | None = None
    direction: Annotated[Vector, AfterValidator(partial(_checked_direction, name="a direction"))] | None = None
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
        given = [self.axis is not None, self.centre is not None, self.direction is not None]
        if given not in ([True, True, False], [False, False, True]):
            raise ValueError('either "axis" and "centre" (a rotation) or "direction" (a translation)')
        if any(late.frame <= early.frame for early, late in pairwise(self.keyframes)):
            raise ValueError("keyframes in the order of their frames")
        return self

    def poses(self) -> Rotation | Translation:
        """The motion as poses over frame numbers."""
        frames = tuple(key.frame for key in self.keyframes)
        if self.direction is not None:
            return Translation(self.direction, frames, tuple(key.distance or 0.0 for key in self.keyframes))
        assert self.axis is not None  # a Motion record has one of the two
        assert self.centre is not None
        return Rotation(self.axis, self.centre, frames, tuple(key.angle or 0.0 for key in self.keyframes))


class CaseHalfSpace(Record):
    """All that lies behind the plane through ``point`` across ``normal``, which points out of it."""

    point: Point
    normal: Annotated[Vector, AfterValidator(partial(_checked_direction, name="a normal"))]


class CaseBox(Record):
    """A box about ``centre`` with edges along the axes, of outer ``size``, edges and corners of radius ``rounding``."""

    centre: Point
    size: Point
    rounding: Length = 0.0

    @field_validator("size")
    @classmethod
    def _check_size(cls, size: Vector) -> Vector:
        if not min(size) > 0:
            raise ValueError("three lengths above zero")
        return size

    @field_validator("rounding")
    @classmethod
    def _check_rounding(cls, rounding: float, info: ValidationInfo) -> float:
        if "size" in info.data and not 0 <= rounding <= min(info.data["size"]) / 2:
            raise ValueError("a length from 0 to half of the shortest edge")
        return rounding


class CaseSphere(Record):
    """A ball of ``radius`` about ``centre``."""

    centre: Point
    radius: PositiveLength


class Rod(Record):
    """A capsule or a cylinder: of ``radius`` about the segment from ``start`` to ``end``."""

    start: Point
    end: Point
    radius: PositiveLength

    @field_validator("end")
    @classmethod
    def _check_end(cls, end: Vector, info: ValidationInfo) -> Vector:
        if "start" in info.data and not math.dist(info.data["start"], end) > 1e-9:
            raise ValueError("another point than the start")
        return end


class CaseBone(Record):
    """A rigid body: exactly one of a ``surface`` in a file, its coordinates in ``unit``, and the closed forms; without ``motion``
    it rests. ``distance_error``: the error allowed in the distance to a surface, root mean square beside it, before
    ``distance_rounding`` takes its Gaussian mean, of this standard deviation: on flat triangles nothing slides smoothly.
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

    @model_validator(mode="after")
    def _check(self) -> Self:
        forms = ("surface", *CLOSED_FORMS)
        if sum(getattr(self, form) is not None for form in forms) != 1:
            raise ValueError(f"exactly one of {', '.join(f'"{form}"' for form in forms)}")
        if (self.surface is None) != (self.unit is None):
            raise ValueError('"unit" beside "surface" and only there')
        for key, most in (("distance_error", 1.0), ("distance_rounding", 10.0)):
            if self.surface is None and key in self.model_fields_set:
                raise ValueError(f'"{key}" beside "surface" only: a closed form has none')
            if not _FINEST <= getattr(self, key) <= most:
                raise ValueError(f'"{key}" from {_FINEST:g} to {most:g} mm')
        return self
