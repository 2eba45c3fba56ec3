"""Records of hard cases, read from files inside ``cases/hard``, with their variants."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import Field, field_validator

from fem_reference import solvers
from fem_reference.assessment import health
from fem_reference.assessment.stress import Bound
from fem_reference.effects import Effect
from fem_reference.effects.touching import among as touching_among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import FileName, Name, Record, join, key_rule, keys, one_of, parse, rule
from fem_reference.foundations.units import AreaStiffness, Point, PositiveLength
from fem_reference.io import texts
from fem_reference.problems.problem import Task
from fem_reference.scenes import casefile, consistency
from fem_reference.scenes.case import HOME, Case, SolverChoice
from fem_reference.scenes.muscle import CaseBone, Frames, Motion

FOLDER = HOME / "cases" / "hard"
Face = Literal["x0", "x1", "y0", "y1", "z0", "z1"]
FACES: tuple[Face, ...] = get_args(Face)
_MOST_CELLS = 50_000  # the maximum number of cells of a block; no solver solves that many within its time limit
FIRST = "block"  # the name of the first of several bodies
REFERENCE, SECOND = "fenicsx", "scikit_fem"
LIMIT = 120.0  # the limit of processor time of a run [s]
_OWN: dict[str, dict[str, Any]] = {
    REFERENCE: {"ranks": 1, "time_limit": f"{LIMIT:g} s", "residual": 1e-8},
    SECOND: {},
    "line_of_action": {},
}


class Lattice(Record):
    """A block of the given ``size``, whose lower corner is ``corner``. It has a number of ``cells`` along each axis, and each cell
    is cut into six tetrahedra.

    ``grading``: for each axis, the ratio of the length of the last cell to that of the first. ``jitter``: the maximum random
    displacement of nodes, in cell sizes; nodes on faces and edges stay on them. ``seed``: the seed of the random displacements.
    ``rounding``: 0 for a block; values close to 1 turn it into an ellipsoid. ``fibre``: the direction of fibres; measured lines
    follow the axis nearest to it. ``points_apart`` [mm]: the spacing of points for contact and springs, by default as on muscles.
    """

    size: Point
    cells: tuple[int, int, int]
    corner: Point = (0.0, 0.0, 0.0)
    grading: tuple[float, float, float] = (1.0, 1.0, 1.0)
    jitter: float = Field(default=0.0, ge=0, lt=0.5)
    seed: int = Field(default=17, ge=0)
    rounding: float = Field(default=0.0, ge=0, lt=1)
    fibre: tuple[float, float, float] = (0.0, 0.0, 1.0)
    points_apart: PositiveLength | None = None

    _check_sizes = rule(lambda one: min(*one.size, *one.cells, *one.grading) > 0, "size, cells and grading above 0")
    _check_cells = rule(lambda one: math.prod(one.cells) <= _MOST_CELLS, f"at most {_MOST_CELLS} cells")
    _check_fibre = rule(lambda one: any(one.fibre), "a fibre that has a direction")


class Hold(Record):
    """A ``face`` of a block that is attached to a bone; with ``middle``, only the vertex at the centre of the face is attached.

    Without ``motion`` the bone stays in place. With ``stiffness`` springs connect the face to the bone; otherwise the face moves
    exactly with the bone.
    """

    face: Face
    middle: bool = False
    motion: Motion | None = None
    stiffness: AreaStiffness | None = None


class OtherBody(Record):
    """A further body and its ``name``: a ``block``, its attachments (``hold``) and its effects (``effect``), by default those of
    the first body.
    """

    name: Name
    block: Lattice
    hold: tuple[Hold, ...] = ()
    effect: tuple[Effect, ...] = ()


class Start(Record):
    """A state at the first frame that replaces the rest state.

    ``random``: points are displaced at random by up to ``amount`` cell sizes. ``point``: the body is collapsed to its centre.
    ``plane``: the body is collapsed onto the plane normal to z through its centre. ``inside out``: the body is reflected in this
    plane.
    """

    kind: Literal["random", "point", "plane", "inside out"]
    amount: float = Field(default=1.0, ge=0)


class Shipped(Record):
    """A shipped ``case``, at its quick size if ``quick``, with ``changes`` to its keys."""

    case: str
    quick: bool = False
    changes: dict[str, Any] = Field(default_factory=dict)

    def read(self) -> Case:
        """Read the case with its changes. Raises InputError if the changed case is invalid."""
        quick = casefile.read(self.case).quick if self.quick else {}
        return casefile.read(self.case, changes=quick | self.changes)


class StepCounts(Record):
    """Numbers of equal load steps (``counts``) with which the reference is solved up to frame ``until``. The state at this frame
    should be the same for every number of steps.
    """

    until: int
    counts: tuple[Annotated[int, Field(gt=0)], ...] = Field(default=(1, 10, 40), min_length=1)


class Hard(Record):
    """A hard case: a ``block`` with its effects, bones and attachments, and further bodies (``beside``); or a ``shipped`` case.

    ``healthy`` describes a healthy run in words; ``bound`` limits its quantities, the decisive quantity first. ``only``: the
    solvers that the case is about, by default all; ``because``: the reason. ``no_solution``: the reason why no equilibrium exists;
    a run should then end with a status other than ``converged``. ``contrast``: the defect that the case demonstrates; a run should
    then violate a bound. ``by_effects``: the case depends on its effects and does not apply to solvers that simulate none.
    ``settings``: for each solver, changes to its usual settings (mostly those of Table 5.1). ``steps``: see ``StepCounts``.
    """

    title: str
    healthy: str
    bound: tuple[Bound, ...] = Field(min_length=1)
    block: Lattice | None = None
    hold: tuple[Hold, ...] = ()
    beside: tuple[OtherBody, ...] = ()
    bone: tuple[CaseBone, ...] = ()
    effect: tuple[Effect, ...] = ()
    frames: Frames | None = None
    start: Start | None = None
    shipped: Shipped | None = None
    only: tuple[str, ...] = ()
    because: str = ""
    no_solution: str = ""
    contrast: str = ""
    by_effects: bool = False
    settings: dict[str, dict[str, Any]] = Field(default_factory=dict)
    steps: StepCounts | None = None
    name: FileName = Field(exclude=True)
    place: str = Field(exclude=True)

    @field_validator("bound")
    @classmethod
    def _check_quantities(cls, bounds: tuple[Bound, ...]) -> tuple[Bound, ...]:
        strange = [bound.quantity for bound in bounds if bound.quantity not in health.QUANTITIES]
        if strange:
            raise ValueError(f"quantities among {', '.join(health.QUANTITIES)}; {strange[0]} is not one of them")
        return bounds

    _check_bounds = key_rule(
        "bound",
        lambda bounds, _: any(bound.quantity != "from_reference" for bound in bounds),
        "another quantity besides from_reference, which a run without a reference lacks",
    )
    _check_touching = key_rule(
        "beside",
        lambda others, _: not any(touching_among(one.effect) for one in others),
        '"touching" among the effects of the first block, as it acts between all bodies',
    )
    _check_faces = key_rule(
        "hold", lambda holds, _: len({hold.face for hold in holds}) == len(holds), "every face at most once"
    )
    _check_forms = key_rule(
        "bone", lambda bones, _: not any(bone.surface for bone in bones), "bones in closed form, not from files"
    )
    _check_form = one_of("block", "shipped")
    _check_frames = rule(
        lambda one: (one.block is None) == (one.frames is None), '"frames" with "block", and only with it'
    )
    _check_beside = rule(
        lambda one: (
            not one.beside
            or (one.block is not None and one.start is None and FIRST not in (other.name for other in one.beside))
        ),
        f'"beside" with a "block", without a "start", and no body named "{FIRST}", the name of the first',
    )
    _check_because = rule(lambda one: bool(one.only) == bool(one.because), '"because" with "only", and only with it')

    def choice(self, defaults: SolverChoice) -> SolverChoice:
        """The solver and settings of ``defaults``, with the settings that this case changes."""
        changes = self.settings.get(defaults.solver, {})
        return SolverChoice(**{"solver": defaults.solver, **defaults.settings, **changes})


def choices() -> dict[str, SolverChoice]:
    """The settings of each solver for hard cases: those in ``_OWN`` or, for other solvers, those of the first candidate of
    Table 5.1 that uses the solver.
    """
    found = {name: SolverChoice(solver=name, **settings) for name, settings in _OWN.items()}
    for candidate in solvers.in_table():
        found.setdefault(candidate.solver, SolverChoice(solver=candidate.solver, **candidate.settings))
    return {name: found[name] for name in (REFERENCE, SECOND, *sorted(set(found) - {REFERENCE, SECOND}))}


def task_of(solver: str, task: Task) -> Task:
    """The task that a solver performs in a case with this ``task``: scikit-fem solves muscles as bodies."""
    return "solve_body" if task == "solve" and solver == SECOND else task


def folders() -> list[str]:
    """The names of the folders of hard cases."""
    return sorted(path.parent.name for path in FOLDER.glob("*/case.toml"))


def read_all(names: tuple[str, ...] = ()) -> tuple[Hard, ...]:
    """Read every hard case or, if there are ``names`` of folders or variants, only those. Raises InputError for an unknown name."""
    found = [hard for folder in folders() for hard in read(FOLDER / folder / "case.toml")]
    own = [{hard.name, hard.name.partition(".")[0]} for hard in found]
    for name in names:
        if not any(name in one for one in own):
            raise InputError("NAME", f'"{name}"', f"one of {', '.join(folders())}")
    return tuple(hard for hard, one in zip(found, own, strict=True) if not names or one & set(names))


def read(path: Path) -> Iterator[Hard]:
    """Read the hard cases of a file: a single case, or one for each ``[[variant]]``, whose keys replace those of the file. Raises
    InputError if a case is invalid.
    """
    table, folder = texts.toml(path), path.parent.name
    if "variant" not in table:
        yield _hard(table, folder, str(path))
        return
    variants = table.pop("variant")
    if not isinstance(variants, list) or not variants or not all(isinstance(one, dict) for one in variants):
        raise InputError(join(str(path), "variant"), repr(variants), "a list of tables, each under [[variant]]")
    found = set[str]()
    for i, variant in enumerate(variants):
        where, label = join(str(path), f"variant[{i}]"), variant.pop("name", "")
        if not isinstance(label, str) or not label or label in found:
            raise InputError(join(where, "name"), repr(label), "a unique name")
        found.add(label)
        yield _hard(_merged(table, variant), f"{folder}.{label}", where)


def _hard(table: dict[str, Any], name: str, where: str) -> Hard:
    """Check the keys of ``table``, and make the hard case ``name`` from them. ``where``: the file and key for error messages."""
    whose = {"name": name, "place": where}
    for key in whose:
        if key in table:
            raise InputError(join(where, key), "an unknown key", f"one of {', '.join(keys(Hard))}")
    table = casefile.with_effects(table, where)
    if isinstance(several := table.get("beside"), list):
        others = [casefile.with_effects(one, join(where, f"beside[{i}]")) for i, one in enumerate(several)]
        table = table | {"beside": others}
    hard = parse(Hard, table | whose, where)
    if hard.contrast and hard.no_solution:
        want = 'no contrast with "no_solution", as no run should reach its end'
        raise InputError(join(where, "contrast"), f'"{hard.contrast}"', want)
    scene = hard.shipped.read() if hard.shipped else None
    task: Task = scene.task if scene else "solve"
    for i, bound in enumerate(hard.bound):
        if (bound.quantity == "overshoot") != (task == "solve_field"):
            want = "overshoot for a scalar field, and only for one"
            raise InputError(join(where, f"bound[{i}].quantity"), f'"{bound.quantity}"', want)
    if hard.frames is not None:
        consistency.check_acting(hard.effect, [bone.name for bone in hard.bone], hard.frames, where)
    _check_solvers(hard, task)
    timed = hard.frames or scene
    assert timed is not None  # a Hard record has either frames or a shipped case
    if hard.steps is not None and hard.steps.until not in range(timed.numbers[0] + 1, timed.numbers[-1] + 1):
        want = f"a frame after {timed.numbers[0]}, up to {timed.numbers[-1]}"
        raise InputError(join(where, "steps.until"), hard.steps.until, want)
    return hard


def _check_solvers(hard: Hard, task: Task) -> None:
    """Raise InputError if a case names a solver that does not solve hard cases, or a setting that its solver does not have."""
    named = [(f"only[{i}]", name) for i, name in enumerate(hard.only)]
    known = choices() if named or hard.settings else {}
    for key, name in [*named, *((f"settings.{name}", name) for name in hard.settings)]:
        if name not in known:
            raise InputError(join(hard.place, key), f'"{name}"', f"one of {', '.join(known)}")
    for name, changes in hard.settings.items():
        given = changes if task == "solve_field" else known[name].settings | changes
        record = solvers.find(name, hard.place, task_of(name, task)).settings
        parse(record, given, join(hard.place, f"settings.{name}"))


def _merged(table: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Update ``table`` with the keys of ``changes``; nested tables are merged key by key."""
    both = [key for key, value in changes.items() if isinstance(value, dict) and isinstance(table.get(key), dict)]
    return table | changes | {key: _merged(table[key], changes[key]) for key in both}
