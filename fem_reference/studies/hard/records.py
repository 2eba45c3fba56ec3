"""A hard case as a file below ``cases/hard`` says it, and its variants."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, Self, get_args

from pydantic import Field, field_validator, model_validator

from fem_reference.assessment import health
from fem_reference.assessment.stress import Bound
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join, parse
from fem_reference.foundations.units import AreaStiffness, Point, PositiveLength
from fem_reference.scenes.bones import Bone, Motion
from fem_reference.scenes.case import HOME, SolverChoice
from fem_reference.scenes.muscle import Frames

FOLDER = HOME / "cases" / "hard"
Face = Literal["x0", "x1", "y0", "y1", "z0", "z1"]
FACES: tuple[Face, ...] = get_args(Face)


class Block(Record):
    """A block of ``size`` from its ``corner``, in so many ``cells`` along each axis, each cut into six tetrahedra.

    ``grading``: along each axis, the last cell over the first. ``jitter``: how far nodes are moved at random inside the block and
    its faces, in cells, by a ``seed``. ``fibre``: the direction of fibres, along which the lines run that are measured.
    ``points_apart`` [mm]: how far apart points are on which bones press and springs pull, by default as on muscles.
    """

    size: Point
    cells: tuple[int, int, int]
    corner: Point = (0.0, 0.0, 0.0)
    grading: tuple[float, float, float] = (1.0, 1.0, 1.0)
    jitter: float = Field(default=0.0, ge=0, lt=0.5)
    seed: int = Field(default=17, ge=0)
    fibre: tuple[float, float, float] = (0.0, 0.0, 1.0)
    points_apart: PositiveLength | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not min(self.size) > 0 or min(self.cells) < 1 or min(self.grading) <= 0:
            raise ValueError("size, cells and grading above 0")
        return self


class Hold(Record):
    """A ``face`` of the block, or the vertex in its ``middle`` alone, that is attached to a bone of its own, which rests or has a
    ``motion``; by springs or exactly.
    """

    face: Face
    middle: bool = False
    motion: Motion | None = None
    stiffness: AreaStiffness | None = None


class Start(Record):
    """What the body is at the first frame in place of its rest state: points moved at ``random`` by an ``amount`` of the size of
    a cell, or the whole body collapsed to its middle ``point`` or ``plane`` across z or turned ``inside out``.
    """

    kind: Literal["random", "point", "plane", "inside out"]
    amount: float = Field(default=1.0, ge=0)


class Shipped(Record):
    """A shipped ``case``, where it is ``quick`` as tests solve it, with ``changes`` of its keys."""

    case: str
    quick: bool = False
    changes: dict[str, Any] = Field(default_factory=dict)


class Steps(Record):
    """Numbers of even load steps (``counts``) in which the reference goes to the frame ``until``: they shall end alike."""

    until: int
    counts: tuple[int, ...] = (1, 10, 40)


class Hard(Record):
    """A hard case: a ``block`` with what acts on it, or a ``shipped`` case.

    ``healthy`` says in words what a healthy run shows, ``bound`` in numbers, the decisive quantity first. ``only``: the solvers
    that it is about, by default all; ``because``: why. ``no_solution``: why physics has no answer, so that a run should end with
    a status; ``contrast``: what it shows that goes wrong, so that a run should pass its bound. ``by_effects``: effects are all
    that acts, and solvers that simulate none have nothing to do. ``settings``: by solver, those that differ from Table 5.1.
    ``steps``: in which numbers of load steps the reference is asked for the same end state.
    """

    title: str
    healthy: str
    bound: tuple[Bound, ...] = Field(min_length=1)
    block: Block | None = None
    hold: tuple[Hold, ...] = ()
    bone: tuple[Bone, ...] = ()
    effect: tuple[dict[str, Any], ...] = ()
    frames: Frames | None = None
    start: Start | None = None
    shipped: Shipped | None = None
    only: tuple[str, ...] = ()
    because: str = ""
    no_solution: str = ""
    contrast: str = ""
    by_effects: bool = False
    settings: dict[str, dict[str, Any]] = Field(default_factory=dict)
    steps: Steps | None = None
    name: str = Field(exclude=True)
    place: str = Field(exclude=True)

    @field_validator("bound")
    @classmethod
    def _check_quantities(cls, bounds: tuple[Bound, ...]) -> tuple[Bound, ...]:
        strange = [bound.quantity for bound in bounds if bound.quantity not in health.QUANTITIES]
        if strange:
            raise ValueError(f"quantities that are among {', '.join(health.QUANTITIES)}, as {strange[0]} is not")
        if all(bound.quantity == "from_reference" for bound in bounds):
            raise ValueError("another quantity beside from_reference, which a run without a reference has not")
        return bounds

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.block is None) == (self.shipped is None):
            raise ValueError('exactly one of "block" and "shipped"')
        if (self.block is None) != (self.frames is None):
            raise ValueError('"frames" beside "block" and only there')
        if bool(self.only) != bool(self.because):
            raise ValueError('"because" beside "only" and only there')
        return self

    def choice(self, defaults: SolverChoice) -> SolverChoice:
        """The solver of ``defaults`` with the settings that this case changes."""
        changes = self.settings.get(defaults.solver, {})
        return SolverChoice(**{"solver": defaults.solver, **defaults.settings, **changes})


def folders() -> list[str]:
    """The folders of hard cases that there are."""
    return sorted(path.parent.name for path in FOLDER.glob("*/case.toml"))


def read_all(names: tuple[str, ...] = ()) -> tuple[Hard, ...]:
    """Every hard case, or those of folders or variants of these ``names``; InputError where there is none of a name."""
    found = [hard for folder in folders() for hard in read(FOLDER / folder / "case.toml")]
    for name in names:
        if not any(_named(hard, name) for hard in found):
            raise InputError("NAME", f'"{name}"', f"one of {', '.join(folders())}")
    return tuple(hard for hard in found if not names or any(_named(hard, name) for name in names))


def _named(hard: Hard, name: str) -> bool:
    return name in (hard.name, hard.name.partition(".")[0])


def read(path: Path) -> Iterator[Hard]:
    """The hard case in a file, or its variants: each is the file with the keys of a ``[[variant]]`` in their place."""
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, str(error), "a TOML file") from error
    variants = table.pop("variant", [{}])
    for i, variant in enumerate(variants):
        changes = dict(variant)
        label = str(changes.pop("name", ""))
        where = join(str(path), f"variant[{i}]") if label else str(path)
        name = f"{path.parent.name}.{label}" if label else path.parent.name
        yield parse(Hard, _merged(table, changes) | {"name": name, "place": where}, where)


def _merged(table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """``table`` with the keys of ``changes`` in place of its own, tables key by key."""
    found = dict(table)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(found.get(key), dict)
        found[key] = _merged(found[key], value) if both else value
    return found
