"""A case as frozen records: what moves what, which effects act, which frames are wanted, and what is expected.

``Scene.key`` names a scene by what determines its solution, the content of its files included.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import Any, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from fem_reference.effects import Effect
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import fact_table
from fem_reference.foundations.records import Record, join
from fem_reference.foundations.units import AreaStiffness, LengthUnit, PositiveLength, Time
from fem_reference.scenes.bones import Bone

DATA_SETTING = "FEM_REFERENCE_DATA"
MOST_FRAMES = 100_000
LAST_FRAME = 1_000_000_000


def home(package: Path) -> Path:
    """Where cases/ and meshes/ are: inside an installed package, beside it in a checkout."""
    return package if (package / "cases").is_dir() else package.parent


HOME = home(Path(__file__).resolve().parent.parent)


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
    """Which part of the muscle surface is attached to a bone: exactly one of ``vertices``, ``within`` (of the bone), ``outline``;
    and how: by springs of a ``stiffness`` over its area, without it exactly.
    """

    name: str
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


class Polylines(Record):
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

    polylines: Polylines | None = None
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


class SolverChoice(Record):
    """A solver by name with its own settings, which the solver checks."""

    model_config = ConfigDict(frozen=True, extra="allow")
    solver: str

    @property
    def settings(self) -> dict[str, Any]:
        """Every key but those that choose the solver."""
        return dict(self.model_extra or {})


class Candidate(SolverChoice):
    """A run to compare with the reference."""

    name: str = Field(pattern=r"^[\w.-]+$")


class Expectation(Record):
    """A number that a measure of this case must have.

    ``of`` is ``"reference"``, a candidate, or ``"candidates"`` for each that is compared; ``frame`` a number or ``"any"``.
    """

    of: str
    metric: str
    statistic: str
    frame: int | Literal["any"]
    truth: str
    within: str
    kind: Literal["closed form", "manufactured", "published", "property", "reference run", "pinned"]
    because: str


class NegativeControl(Record):
    """One change of this scene that must turn its verdict to fail: the ``key`` to change and its ``value``."""

    key: str
    value: str | int | float
    because: str


class SceneFile(Record):
    """The contents of a scene file."""

    title: str
    proves: str
    muscle: Muscle
    bone: tuple[Bone, ...] = Field(min_length=1)
    attachment: tuple[Attachment, ...]
    effect: tuple[Any, ...] = Field(min_length=1)
    fibres: Fibres
    frames: Frames
    reference: SolverChoice
    candidate: tuple[Candidate, ...]
    expect: tuple[Expectation, ...] = Field(min_length=1)
    negative_control: NegativeControl


class Scene(SceneFile):
    """A case, read and checked: the contents of its file, and the name and place of its folder."""

    name: str
    folder: Path

    @property
    def place(self) -> str:
        """The scene file, for messages."""
        return str(self.folder / "case.toml")

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The effects, in the order of the file."""
        return self.effect

    def _repr_html_(self) -> str:
        """What notebooks show."""
        facts = {
            "muscle": f"{self.muscle.surface}, tetrahedra of {self.muscle.tet_size / 2**self.muscle.refinements:g} mm",
            "bones": ", ".join(bone.name for bone in self.bone),
            "attachments": ", ".join(attachment.name for attachment in self.attachment) or "none",
            "effects": ", ".join(effect.title for effect in self.effects),
            "frames": f"{self.frames.first} to {self.frames.last}, every {self.frames.every}",
            "reference": self.reference.solver,
            "candidates": ", ".join(candidate.name for candidate in self.candidate) or "none",
        }
        return fact_table(f"{self.name}: {self.title}", facts)

    def file(self, text: str, key: str) -> Path:
        """The file that ``key`` names; see :func:`locate`."""
        return locate(self.folder, text, key)

    @property
    def key(self) -> str:
        """A hash over everything that determines the solution: body, motion, effects, frames, and the content of their files."""
        tables = self.model_dump(
            mode="json",
            include={"muscle", "bone", "attachment", "fibres", "frames"},
        )
        tables["effect"] = [[type(effect).__name__, effect.model_dump(mode="json")] for effect in self.effects]
        digest = hashlib.sha256(json.dumps(tables, sort_keys=True).encode())
        for key, text in _files(tables):
            digest.update(self.file(text, key).read_bytes())
        return digest.hexdigest()


def locate(folder: Path, text: str, key: str) -> Path:
    """The file that a ``key`` of the scene in ``folder`` names: below the data folder (``data:``), below meshes (``mesh:``), or
    relative to the scene file.
    """
    place = join(str(folder / "case.toml"), key)
    if text.startswith("data:"):
        root = os.environ.get(DATA_SETTING)
        if not root:
            raise InputError(place, f'"{text}" while {DATA_SETTING} is not set', f"the setting {DATA_SETTING}=FOLDER")
        path = Path(root) / text.removeprefix("data:")
    elif text.startswith("mesh:"):
        path = HOME / "meshes" / text.removeprefix("mesh:")
    else:
        path = folder / text
    if not path.exists():
        raise InputError(place, f'"{text}", which is not at {path}', "a file that exists")
    return path


def _files(tables: Any, key: str = "") -> list[tuple[str, str]]:
    """Every (key, text) below ``tables`` that names a file."""
    if isinstance(tables, dict):
        found = [(f"{key}.{name}".lstrip("."), value) for name, value in tables.items() if name in ("surface", "file")]
        below = [(f"{key}.{name}".lstrip("."), value) for name, value in tables.items()]
    else:
        found, below = (
            [],
            [(f"{key}[{i}]", value) for i, value in enumerate(tables)] if isinstance(tables, list) else [],
        )
    named = [(where, text) for where, text in found if isinstance(text, str)]
    return named + [entry for where, value in below for entry in _files(value, where)]
