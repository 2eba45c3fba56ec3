"""The loop over frame numbers that the fast solvers share, and surfaces that go along with their bones."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from fem_reference.foundations.mesh import TET_FACES, Floats, Polylines, Surface, TetMesh, diagonal
from fem_reference.foundations.motion import apply
from fem_reference.geometry.signed_distance import Grid
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.resolved_paths import posed, skipped
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.state_checks import StateCheck, Trouble, first_trouble, surface_checks

# Parts of a frame in which motions are looked at; what is seen in these is seen in more.
_PARTS = 16
# Positions (n, 3) [mm], what is kept of their velocities (n, 3), and the frame number -> both after its iteration.
Iterate = Callable[[Floats, Floats, int], tuple[Floats, Floats]]


class FrameModel(Protocol):
    """A muscle that goes from frame number to frame number."""

    @property
    def cost(self) -> dict[str, float]:
        """The cost so far, to which the loop adds."""

    @property
    def advice(self) -> str:
        """Advice where a run ends in trouble."""

    def move(self, number: int, /) -> None:
        """Go to the frame ``number``: what this takes is the time of solving."""

    def trouble(self) -> Trouble | None:
        """The trouble with the present state; None without."""

    def frame(self, number: int, /) -> Frame:
        """The present state, which is that of the frame ``number``."""

    def ending(self) -> Outcome:
        """The outcome of a run that reached every frame."""


def follow(model: FrameModel, setup: Setup, sink: Sink, per_frame: int = 1) -> Outcome:
    """Take a ``model`` from rest at the first frame of ``setup`` through every frame number to the last, each in ``per_frame``
    parts at whose ends it sees where bones are; ``sink`` gets the frames. Out of steps where bones do what nobody sees in between.
    """
    frames = setup.frames
    if _unseen(setup, 1) and (why := _unseen(setup, min(per_frame, _PARTS))):
        return refused(model, frames[0], sink, why)
    sink(model.frame(frames[0]))
    return _go(model, range(frames[0] + 1, frames[-1] + 1), frames, sink)


def _unseen(setup: Setup, per_frame: int) -> Trouble | None:
    """Trouble with a bone that turns too far from where it is seen to where it is seen next, or there and back; None without."""
    if all(bone.motion is None for bone in setup.bones):
        return None
    points, count = setup.surface.points, (setup.frames[-1] - setup.frames[0]) * per_frame
    seen = np.linspace(setup.frames[0], setup.frames[-1], count + 1)
    bones = [
        bone for bone in setup.bones if np.isfinite([bone.pose(frame) for frame in seen]).all()
    ]  # else its loop says so
    things = [posed(f'bone "{bone.name}"', bone.pose, points) for bone in bones]
    found = skipped(things, seen.tolist(), diagonal(points))
    if found is None:
        return None
    thing, early, late = found
    return Trouble(
        "out of steps",
        f"{thing.place} turns by more than a right angle, goes farther than the muscle is long, or goes there and back, "
        f"between frames {early:g} and {late:g}, where this solver does not look; a slower motion, over more frames, helps",
    )


def each(model: FrameModel, frames: tuple[int, ...], sink: Sink) -> Outcome:
    """Take ``model``, whose states do not depend on those before, to ``frames`` alone, the first like all others."""
    return _go(model, frames, frames, sink)


def refused(model: FrameModel, first: int, sink: Sink, why: Trouble) -> Outcome:
    """A loop that is not begun, and ``why``; ``sink`` gets the ``first`` frame, which is rest."""
    sink(model.frame(first))
    return Outcome(why.status, why.sentence, _begun(model))


def _go(model: FrameModel, numbers: Iterable[int], wanted: tuple[int, ...], sink: Sink) -> Outcome:
    cost = _begun(model)
    for number in numbers:
        begin = time.perf_counter()
        model.move(number)
        cost["seconds_solve"] += time.perf_counter() - begin
        cost["iterations"] += 1
        cost["seconds_per_iteration"] = cost["seconds_solve"] / cost["iterations"]
        if found := model.trouble():
            return Outcome(found.status, f"frame {number}: {found.sentence}; {model.advice}", cost)
        if number in wanted:
            sink(model.frame(number))
    ending = model.ending()
    return Outcome(ending.status, ending.message, cost)


def _begun(model: FrameModel) -> dict[str, float]:
    cost = model.cost
    cost |= {"seconds_solve": 0.0, "iterations": 0, "threads": 1}
    return cost


def timed[M: FrameModel](make: Callable[[Setup], M], setup: Setup) -> M:
    """The model that ``make`` makes of ``setup``. Its cost says in which ``seconds_setup``; and in which ``seconds_compile`` one
    frame of a tetrahedron was solved before, for which every compiled function is called.
    """
    begin = time.perf_counter()
    first = make(tetrahedron())
    first.move(1)
    first.frame(1)
    compiled = time.perf_counter()
    model = make(setup)
    model.cost["seconds_compile"] = compiled - begin
    model.cost["seconds_setup"] = time.perf_counter() - compiled
    return model


def tetrahedron() -> MuscleProblem:
    """A tetrahedron with a fibre, attached at a vertex to a bone."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    surface, facets = Surface(corners, TET_FACES), {"end": TET_FACES[:1]}
    clear = Grid(np.ones((5, 5, 5)), (-1.0, -1.0, -1.0), 1.0, 1.0, 0.0, 0.0)
    bone = Bone("bone", surface, None, solid=clear)
    attached = (AttachedVertices("end", bone, np.zeros(1, np.int64)),)
    mesh, fibre = TetMesh(corners, np.arange(4)[None], facets), Polylines(corners[:2], np.array([0, 2]))
    return MuscleProblem(
        surface, (bone,), attached, (0, 1), None, mesh=mesh, effects=(), fibres=fibre, mesh_facts={}, seconds=0.0
    )


@dataclass(eq=False)
class MovingSurface:
    """A muscle that is its surface of particles, taken along by ``iterate``, which projects so many constraints (``projections``,
    those of contact not counted): a model of the loop.
    """

    setup: Setup
    iterate: Iterate
    projections: int = 0
    advice: str = "a slower motion, more steps or a lower stiffness may help"
    cost: dict[str, float] = field(default_factory=dict)
    points: Floats = field(init=False)
    kept: Floats = field(init=False)

    def __post_init__(self) -> None:
        self.points = self.setup.begin(self.setup.surface.points)
        self.kept = np.zeros(self.points.shape)
        free = len(self.points) - len(np.unique(self.setup.attached_vertices))
        self.cost |= {"unknowns": 3.0 * free, "projections": 0.0}

    def move(self, number: int) -> None:
        """Iterate once."""
        self.points, self.kept = self.iterate(self.points, self.kept, number)
        self.cost["projections"] += self.projections

    def trouble(self) -> Trouble | None:
        """The trouble with the surface; None without."""
        return first_trouble(self._checks, self.points)

    @cached_property
    def _checks(self) -> tuple[StateCheck, ...]:
        return surface_checks(self.setup.surface, self.setup.attached_vertices)

    def frame(self, number: int) -> Frame:
        """The surface."""
        return Frame(number, self.points.copy())

    def ending(self) -> Outcome:
        """Converged, as every iteration is."""
        return Outcome("converged", f"{self.setup.frames[-1] - self.setup.frames[0]} iterations")


def carry(points: Floats, setup: Setup, frame: float) -> None:
    """Put the attached vertices where their bones are at ``frame``."""
    for entry in setup.attached:
        points[entry.vertices] = apply(entry.bone.pose(frame), setup.surface.points[entry.vertices])


def other_clock(setup: Setup, frame_time: float) -> str:
    """A note where the scene has an interval [s] other than a solver's ``frame_time`` [s]; empty where it has not."""
    if setup.interval is None or math.isclose(setup.interval, frame_time):
        return ""
    return f"; from a frame number to the next it takes {frame_time:g} s, the scene {setup.interval:g} s"
