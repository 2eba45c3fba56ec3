"""Lines of action: each fibre of the scene as one line between its bones, straight, through via-points or around an obstacle.

Report 5.1 to 5.3. A line's ends are the fibre's, each fixed to the bone whose attachment is nearest at rest; between two fixed
points it is as short as it can be. It has a length, with ``hill`` also a force, and no surface: it is judged on these alone. A
shortest path takes the shorter path round: where ends turn past what is opposite, it changes sides.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record, join
from fem_reference.geometry.wrapping import Paths, WrappingCylinder, WrappingSphere, straight
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.scenes.muscle import CaseSphere, Rod
from fem_reference.solvers.common.frame_loop import each
from fem_reference.solvers.common.hill import HillSettings
from fem_reference.solvers.common.protocol import MuscleSolver, Trade
from fem_reference.solvers.common.state_checks import Trouble

# An end this deep [mm] in an obstacle is on its surface, but for rounding.
_TOUCHES = 1e-6


class Via(Record):
    """A point of every fibre that moves with a ``bone``: where it is at rest ``at`` this share of the fibre's length."""

    at: Annotated[float, Field(gt=0, lt=1)]
    bone: str


class SphereOn(CaseSphere):
    """A sphere, given at rest, that moves with a ``bone``."""

    bone: str


class CylinderOn(Rod):
    """A cylinder that moves with a ``bone``; ``start`` and ``end``, given at rest, say where its axis is: it does not end there."""

    bone: str


class LineSettings(Record):
    """Points and obstacles that lines go through and around; without any key they are straight.

    ``via``: points in the order in which a fibre passes them. ``via_count``: so many points instead, evenly
    spread over each fibre, each on the bone of the nearer end. ``sphere`` or ``cylinder``: an obstacle that every part of a
    line goes around, from one fixed point to the next, where the straight path would cross it. ``hill``: their forces.
    """

    via: tuple[Via, ...] = ()
    via_count: Annotated[int, Field(ge=0), Trade((0, 2, 4, 8))] = 0
    sphere: SphereOn | None = None
    cylinder: CylinderOn | None = None
    hill: HillSettings | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.sphere is not None and self.cylinder is not None:
            raise ValueError('at most one of "sphere", "cylinder"')
        if self.via and self.via_count:
            raise ValueError('at most one of "via", "via_count"')
        places = [via.at for via in self.via]
        if places != sorted(set(places)):
            raise ValueError("via-points in the order in which a fibre passes them")
        return self


@dataclass(frozen=True, eq=False)
class Lines:
    """A line for each of k fibres, made of p parts between fixed points, counted line by line.

    ``fixed`` (k, p + 1, 3) [mm] at rest, each on ``bones[on]``, on (k, p + 1). Point j of the fibres is on part ``part[j]`` after
    the share ``share[j]`` of its length.
    """

    bones: tuple[Bone, ...]
    fixed: Floats
    on: Ints
    part: Ints
    share: Floats

    def at(self, number: int) -> Floats:
        """The fixed points (k, p + 1, 3) [mm] at frame ``number``."""
        moved = np.array(self.fixed)
        for i in np.unique(self.on):
            moved[self.on == i] = apply(self.bones[i].pose(number), self.fixed[self.on == i])
        return moved


@dataclass(frozen=True)
class Wrap:
    """An ``obstacle``, given at rest, on a ``bone``; ``name`` is what messages call it."""

    obstacle: WrappingSphere | WrappingCylinder
    bone: Bone
    name: str


class Shortest:
    """The ``lines`` of a muscle, at any frame as short as the ``wrap`` lets them be."""

    advice = "a smaller radius may help"

    def __init__(self, problem: MuscleProblem, settings: LineSettings) -> None:
        self.problem, self.vias = problem, len(settings.via) + settings.via_count
        self.lines, self.wrap = _made(problem, settings, "line_of_action")
        self.cost = {"seconds_compile": 0.0}
        self.inside: Trouble | None = None
        self.found = Frame(problem.frames[0], None)
        first = _paths(self.wrap, self.lines.at(problem.frames[0]), problem.frames[0])[0].lengths
        self.hill = settings.hill
        self.muscles = (
            () if self.hill is None else self.hill.muscles(first.reshape(len(self.lines.fixed), -1).sum(axis=1))
        )

    def move(self, number: int) -> None:
        """Find the paths at a frame."""
        fixed = self.lines.at(number)
        if self.wrap is not None and (inside := _inside(self.wrap, fixed, number)):
            self.inside = Trouble("diverged", inside)
        else:
            self.found, lengths = _frame(self.lines, self.wrap, fixed, number, self.problem.fibres)
            self.found.scalars.update(self._forces(lengths, fixed, number))

    def _forces(self, lengths: Floats, fixed: Floats, number: int) -> dict[str, float]:
        """Force [N] of lines of ``lengths`` (k,) [mm], mean length of fibres over the optimal one, forces on bones."""
        if self.hill is None:
            return {}
        pairs = zip(self.muscles, lengths.tolist(), strict=True)
        found = np.array([muscle.static(length, self.hill.activation) for muscle, length in pairs])
        sums = {"muscle_force": float(found[:, 0].sum()), "fibre_length_mean": float(found[:, 1].mean())}
        return sums | _on_bones(self.lines, self.wrap, fixed, number, found[:, 0])

    def trouble(self) -> Trouble | None:
        """The trouble with a fixed point inside the obstacle; None without."""
        return self.inside

    def frame(self, _: int) -> Frame:
        """The lines."""
        return self.found

    def ending(self) -> Outcome:
        """Converged, as every line is; what they go through and around."""
        kind = f"straight, through {self.vias} via-points" if self.vias else "straight"
        around = "" if self.wrap is None else f" or around the {self.wrap.name} on {self.wrap.bone.name}"
        return Outcome("converged", f"{len(self.lines.fixed)} lines, {kind}{around}; no surface")


def solve(problem: MuscleProblem, settings: LineSettings, sink: Sink) -> Outcome:
    """The lines at every frame wanted, up to one with a fixed point inside the obstacle; InputError where that is the first."""
    return each(Shortest(problem, settings), problem.frames, problem.frames, sink)


def check(settings: LineSettings, problem: MuscleProblem, place: str) -> None:
    """InputError below ``place`` where lines cannot go through and around what the settings say."""
    _made(problem, settings, place)


def _made(problem: MuscleProblem, settings: LineSettings, place: str) -> tuple[Lines, Wrap | None]:
    """The lines and the obstacle; InputError below ``place`` where the case has not what they need, or a fixed point is inside the
    obstacle at the first frame.
    """
    lines, wrap, first = _lines(problem, settings, place), _wrap(problem, settings, place), problem.frames[0]
    if wrap is not None and (inside := _inside(wrap, lines.at(first), first)):
        raise InputError(join(place, wrap.name), inside, "an obstacle with all of them outside")
    return lines, wrap


def _frame(lines: Lines, wrap: Wrap | None, fixed: Floats, number: int, fibres: Polylines) -> tuple[Frame, Floats]:
    """The lines with as many points as the fibres have, and the lengths of their paths (k,) [mm]; ``lost_by_chords_max`` [mm]: the
    greatest length that chords cut off a path.
    """
    paths, pose = _paths(wrap, fixed, number)
    points = apply(pose, paths.at(lines.part, lines.share))
    lengths = paths.lengths.reshape(len(fixed), -1).sum(axis=1)
    lost = float((lengths - fibres.lengths(points)).max())
    return Frame(number, None, fibres=points, scalars={"lost_by_chords_max": lost}), lengths


def _paths(wrap: Wrap | None, fixed: Floats, number: int) -> tuple[Paths, Floats]:
    """The parts, and the 4 x 4 pose that takes them to where they are: an obstacle is asked where it rests."""
    starts, ends = fixed[:, :-1].reshape(-1, 3), fixed[:, 1:].reshape(-1, 3)
    if wrap is None:
        return straight(starts, ends), np.eye(4)
    pose = wrap.bone.pose(number)
    back = np.linalg.inv(pose)
    return wrap.obstacle.around(apply(back, starts), apply(back, ends)), pose


def _on_bones(lines: Lines, wrap: Wrap | None, fixed: Floats, number: int, tensions: Floats) -> dict[str, float]:
    """The force [N] and, about the origin, the moment [N mm] on each bone by lines of these ``tensions`` (k,) [N].

    A part pulls at both of its ends along itself; its obstacle gets the opposite of both, as what lies on it has no weight.
    """
    paths, pose = _paths(wrap, fixed, number)
    pulls = np.repeat(tensions, fixed.shape[1] - 1)[:, None]
    first, last = (pulls * ends @ pose[:3, :3].T for ends in paths.directions())
    starts, ends = fixed[:, :-1].reshape(-1, 3), fixed[:, 1:].reshape(-1, 3)
    by = [(lines.on[:, :-1].ravel(), starts, first), (lines.on[:, 1:].ravel(), ends, -last)]
    if wrap is not None:
        around = np.full(len(starts), lines.bones.index(wrap.bone))
        by += [(around, starts, -first), (around, ends, last)]
    on, places, forces = (np.concatenate(parts) for parts in zip(*by, strict=True))
    found = dict[str, float]()
    for i, bone in enumerate(lines.bones):
        found |= vector_scalars(f"force_on_{bone.name}", forces[on == i].sum(axis=0))
        found |= vector_scalars(f"moment_on_{bone.name}", np.cross(places, forces)[on == i].sum(axis=0))
    return found


def _inside(wrap: Wrap, fixed: Floats, number: int) -> str:
    """The line that has the fixed point deepest inside the obstacle; empty where none is inside."""
    resting = apply(np.linalg.inv(wrap.bone.pose(number)), fixed.reshape(-1, 3))
    depths = wrap.obstacle.depths(resting).reshape(len(fixed), -1).max(axis=1)
    line = int(np.argmax(depths))
    return "" if depths[line] <= _TOUCHES else f"a fixed point of line {line} {depths[line]:.3g} mm inside"


def _wrap(problem: MuscleProblem, settings: LineSettings, place: str) -> Wrap | None:
    """The obstacle of the settings, None without one."""
    if (ball := settings.sphere) is not None:
        bone = problem.bones[_index(problem.bones, ball.bone, join(place, "sphere.bone"))]
        return Wrap(WrappingSphere(ball.centre, ball.radius), bone, "sphere")
    if (roll := settings.cylinder) is not None:
        x, y, z = (float(entry) for entry in np.subtract(roll.end, roll.start))
        bone = problem.bones[_index(problem.bones, roll.bone, join(place, "cylinder.bone"))]
        return Wrap(WrappingCylinder(roll.start, (x, y, z), roll.radius), bone, "cylinder")
    return None


def _lines(problem: MuscleProblem, settings: LineSettings, place: str) -> Lines:
    fibres, spread = problem.fibres, (np.arange(settings.via_count) + 0.5) / max(settings.via_count, 1)
    places = [0.0, *(via.at for via in settings.via), *spread.tolist(), 1.0]
    vias = [_index(problem.bones, via.bone, join(place, f"via[{i}].bone")) for i, via in enumerate(settings.via)]
    parts, count = len(places) - 1, len(fibres)
    sizes = np.diff(fibres.offsets)
    if sizes.min() <= parts:
        got = f"fibre {sizes.argmin()} of {sizes.min()} points"
        want = f"fibres of at least {parts + 1} points for {parts - 1} via-points"
        raise InputError(join(place, "via"), got, want)
    fixed = np.array([along(fibres.points[low:high], places) for low, high in pairwise(fibres.offsets)])
    ends = [nearest_bones(problem, fixed[:, end], place) for end in (0, -1)]
    nearer = [ends[int(at > 0.5)] for at in spread]
    on = np.column_stack([ends[0], *(np.full(count, via) for via in vias), *nearer, ends[1]])
    part, share = zip(*(_spread(int(size), places) for size in sizes), strict=True)
    return Lines(
        bones=problem.bones,
        fixed=fixed,
        on=on,
        part=np.concatenate([found + i * parts for i, found in enumerate(part)]),
        share=np.concatenate(share),
    )


def along(points: Floats, places: list[float]) -> Floats:
    """The points (k, 3) after ``places`` (k,) of the length of the polyline ``points`` (n, 3)."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    wanted = np.array(places) * travelled[-1]
    return np.column_stack([np.interp(wanted, travelled, axis) for axis in points.T])


def _spread(count: int, places: list[float]) -> tuple[Ints, Floats]:
    """Part and share of it (count,) for each point of a line: fixed points among them, the others evenly in between."""
    at = np.rint(np.array(places) * (count - 1)).astype(np.int64)
    steps = np.arange(len(at))
    at = np.maximum.accumulate(at - steps) + steps  # at least one point further each
    at = np.minimum(at, count - 1 - steps[::-1])
    part = np.clip(np.searchsorted(at, np.arange(count), side="right") - 1, 0, len(at) - 2)
    return part, (np.arange(count) - at[part]) / np.diff(at)[part]


def nearest_bones(problem: MuscleProblem, points: Floats, place: str) -> Ints:
    """The index of the bone (n,) whose attachment has the vertex nearest to each of ``points`` (n, 3)."""
    if not problem.attached:
        raise InputError(place, "a muscle without attachments", "attachments that lines are fixed to")
    ends = [problem.surface.points[attached.vertices] for attached in problem.attached]
    away = [np.linalg.norm(points[:, None] - end, axis=2).min(axis=1) for end in ends]
    found = [_index(problem.bones, attached.bone.name, place) for attached in problem.attached]
    return np.array(found)[np.argmin(away, axis=0)]


def _index(bodies: tuple[Bone, ...], name: str, place: str) -> int:
    names = [body.name for body in bodies]
    if name not in names:
        raise InputError(place, f'"{name}"', f"one of {', '.join(names)}")
    return names.index(name)


SOLVES = (MuscleSolver(settings=LineSettings, solve=solve, moves="lines", check_problem=check, example={}),)
