"""The loop over frame numbers that the fast solvers share, and how a surface goes along with its bones."""

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from fem_reference.foundations.mesh import Floats, diagonal
from fem_reference.foundations.motion import apply
from fem_reference.problems.resolved_paths import posed, skipped
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.state_checks import Trouble, trouble

# Parts of a frame in which motions are looked at; what is seen in these is seen in more.
_PARTS = 16
# Positions (n, 3) [mm], what is kept of their velocities (n, 3), and the frame number -> both after its iteration.
Iterate = Callable[[Floats, Floats, int], tuple[Floats, Floats]]


class Model(Protocol):
    """A muscle that goes from frame number to frame number."""

    @property
    def cost(self) -> dict[str, float]:
        """What it has cost so far, to which the loop adds."""

    @property
    def advice(self) -> str:
        """What may help where a run ends in trouble."""

    def move(self, number: int, /) -> None:
        """Go to the frame ``number``: what this takes is the time of solving."""

    def trouble(self) -> Trouble | None:
        """What is wrong with the present state; None if nothing is."""

    def frame(self, number: int, /) -> Frame:
        """The present state, which is that of the frame ``number``."""

    def ending(self) -> Outcome:
        """How a run ended that reached every frame."""


def follow(model: Model, setup: Setup, sink: Sink, per_frame: int = 1) -> Outcome:
    """Take ``model`` from rest at the first frame of ``setup`` through every frame number to the last, each in ``per_frame`` parts
    at whose ends it sees where bones are; ``sink`` gets the frames. Out of steps where bones do what nobody sees in between.
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


def each(model: Model, frames: tuple[int, ...], sink: Sink) -> Outcome:
    """Take ``model``, whose states do not depend on those before, to ``frames`` alone, the first like all others."""
    return _go(model, frames, frames, sink)


def refused(model: Model, first: int, sink: Sink, why: Trouble) -> Outcome:
    """A loop that is not begun, and ``why``; ``sink`` gets the ``first`` frame, which is rest."""
    sink(model.frame(first))
    return Outcome(why.status, why.sentence, _begun(model))


def _go(model: Model, numbers: Iterable[int], wanted: tuple[int, ...], sink: Sink) -> Outcome:
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


def _begun(model: Model) -> dict[str, float]:
    cost = model.cost
    cost |= {"seconds_solve": 0.0, "iterations": 0, "threads": 1}
    return cost


@dataclass(eq=False)
class MovingSurface:
    """A muscle that is its surface of particles, taken along by ``iterate``, which projects so many constraints (``projections``,
    those of contact not counted): a model of the loop.
    """

    setup: Setup
    iterate: Iterate
    cost: dict[str, float]
    projections: int = 0
    advice: str = "a slower motion, more steps or a lower stiffness may help"
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
        """What is wrong with the surface; None if nothing is."""
        return trouble(self.points, self.setup.surface, self.setup.attached_vertices)

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
    """What is to be said where the scene has an interval [s] other than a solver's ``frame_time`` [s]; empty where it has not."""
    if setup.interval is None or math.isclose(setup.interval, frame_time):
        return ""
    return f"; from a frame number to the next it takes {frame_time:g} s, the scene {setup.interval:g} s"
