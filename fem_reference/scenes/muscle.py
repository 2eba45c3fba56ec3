"""The case of a muscle as frozen records: what moves what, which effects act and which frames are wanted."""

from typing import Literal, Self

from pydantic import Field, model_validator

from fem_reference.effects import Effect
from fem_reference.foundations.records import Name, Record
from fem_reference.foundations.units import AreaStiffness, LengthUnit, PositiveLength, Time
from fem_reference.scenes.bones import CaseBone
from fem_reference.scenes.case import Case

MOST_FRAMES = 100_000
LAST_FRAME = 1_000_000_000


class Muscle(Record):
    """The muscle: a closed triangle surface, the size of the tetrahedra it is filled with, how often each of them is then
    cut into eight (``refinements``), and how it is filled: with good tetrahedra (``"quality"``), or an axis-aligned box with a
    grid of boxes, each cut into six (``"block"``).
    """

    surface: str
    unit: LengthUnit
    tet_size: PositiveLength
    refinements: int = Field(default=0, ge=0, le=4)
    mesher: Literal["quality", "block"] = "quality"


class VertexList(Record):
    """Vertices of the muscle surface from a CSV of ``vertex[,value]`` lines; with ``value`` only the lines that carry it."""

    file: str
    value: int | None = None


class Outline(Record):
    """Landmarks around an attachment: vertices within ``reach`` of the patch that the points of each cloud span on the bone."""

    file: str
    unit: LengthUnit
    clouds: tuple[str, ...] = Field(min_length=1)
    reach: PositiveLength


class Attachment(Record):
    """The part of the muscle surface that is attached to a bone: exactly one of ``vertices``, ``within`` (of the bone),
    ``outline``; and how: by springs of a ``stiffness`` over its area, without it exactly.
    """

    name: Name
    bone: str
    stiffness: AreaStiffness | None = None
    vertices: VertexList | None = None
    within: PositiveLength | None = None
    outline: Outline | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if sum(one is not None for one in (self.vertices, self.within, self.outline)) != 1:
            raise ValueError('exactly one of "vertices", "within", "outline"')
        return self


class PolylineFile(Record):
    """Fibres given as polylines in a file."""

    file: str
    unit: LengthUnit


class Traced(Record):
    """Fibres traced along the gradient of a Laplace field that is 0 on the attachment ``start`` and 1 on ``end``."""

    count: int = Field(gt=0, le=100_000)
    start: str
    end: str


class Fibres(Record):
    """The fibres whose lengths are measured: exactly one of ``polylines`` and ``traced``."""

    polylines: PolylineFile | None = None
    traced: Traced | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.polylines is None) == (self.traced is None):
            raise ValueError('exactly one of "polylines", "traced"')
        return self


class Frames(Record):
    """The frame numbers wanted: ``first``, ``first + every``, ... up to ``last``; ``interval`` is the time from a number to the
    next, needed only where a recorded sequence states times.
    """

    first: int = Field(ge=0)
    last: int
    every: int = Field(gt=0)
    interval: Time | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.last <= self.first or (self.last - self.first) % self.every:
            raise ValueError("last = first + a multiple of every")
        if (self.last - self.first) // self.every >= MOST_FRAMES:
            raise ValueError(f"at most {MOST_FRAMES} frames")
        if self.last > LAST_FRAME:
            raise ValueError(f"frame numbers up to {LAST_FRAME}")
        return self

    @property
    def numbers(self) -> tuple[int, ...]:
        """Every frame number wanted."""
        return tuple(range(self.first, self.last + 1, self.every))


class MuscleCase(Case):
    """The case of a muscle: what moves what, which effects act, and which frames are wanted.

    The key ``effects`` (``choice``) says whether all effects that are listed act, or those of them that the scene needs: "auto".
    """

    choice: Literal["listed", "auto"] = Field(default="listed", alias="effects")
    muscle: Muscle
    bone: tuple[CaseBone, ...] = Field(min_length=1)
    attachment: tuple[Attachment, ...] = ()
    fibres: Fibres
    frames: Frames

    task = "solve"
    carries = frozenset({"surface", "lines"})
    determined_by = frozenset({"muscle", "bone", "attachment", "fibres", "frames"})
    naming_files = frozenset({"surface", "file"})

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects, in the order of the file."""
        return self.effect

    @property
    def acting(self) -> dict[str, Effect]:
        """The effects by what each is called beside the others."""
        return {effect.title: effect for effect in self.effects}

    @property
    def numbers(self) -> tuple[int, ...]:
        """The frame numbers wanted."""
        return self.frames.numbers

    @property
    def facts(self) -> dict[str, str]:
        """The contents of the case in words, by name."""
        return {
            "muscle": f"{self.muscle.surface}, tetrahedra of {self.muscle.tet_size / 2**self.muscle.refinements:g} mm",
            "bones": ", ".join(bone.name for bone in self.bone),
            "attachments": ", ".join(attachment.name for attachment in self.attachment) or "none",
            "frames": f"{self.frames.first} to {self.frames.last}, every {self.frames.every}",
        }
