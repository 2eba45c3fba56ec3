"""The loop over frame numbers in fast solvers, and surfaces that are attached to moving bones."""

import math
import time
from collections.abc import Callable, Iterable
from typing import Any, Protocol

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import TET_FACES, Floats, Polylines, Surface, TetMesh, diagonal
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.geometry.signed_distance import Grid
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.resolved_paths import posed, skipped
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.scenes.muscle import MOST_FRAMES
from fem_reference.solvers.common.state_checks import SurfaceCheck, Trouble

# The maximum number of samples of a motion per frame number, between which a bone must not rotate or move too far.
_PARTS = 16


class FrameModel(Protocol):
    """A model of a muscle that is advanced from one frame number to the next.

    ``cost``: the cost of the run, to which the loop adds. ``advice``: the last part of the message of a failed run.
    """

    cost: dict[str, float]
    advice: str

    def move(self, number: int, /) -> None:
        """Advance to frame ``number``. The time of this call counts as the time to solve."""

    def trouble(self) -> Trouble | None:
        """The trouble with the present state, which ends the run; None if there is none."""

    def frame(self, number: int, /) -> Frame:
        """The present state, which is that of frame ``number``."""

    def ending(self) -> Outcome:
        """The outcome of a run that reached all frames."""


def follow(model: FrameModel, setup: Setup, sink: Sink, per_frame: int = 1) -> Outcome:
    """Advance a ``model`` from rest at the first frame of ``setup`` through every frame number; requested frames go to ``sink``.

    ``per_frame``: the number of parts into which the motion to the next frame number is divided; bones move to their pose at the
    end of each part. The status is *out of steps* if a bone moves too far in a part. Raises InputError for too many frame numbers.
    """
    frames = setup.frames
    if frames[-1] - frames[0] > MOST_FRAMES:
        want = f"at most {MOST_FRAMES} frame numbers after the first, as this solver goes through each"
        raise InputError("frames.last", f"{frames[-1]}, {frames[-1] - frames[0]} after the first", want)
    if _unseen(setup, 1) and (why := _unseen(setup, min(per_frame, _PARTS))):
        return refused(model, frames[0], sink, why)
    sink(model.frame(frames[0]))
    return each(model, range(frames[0] + 1, frames[-1] + 1), frames, sink)


def _unseen(setup: Setup, per_frame: int) -> Trouble | None:
    """The trouble if a bone moves too far, or out and back, between two samples of its pose; None if no bone does."""
    if all(bone.motion is None for bone in setup.bones):
        return None
    points, count = setup.surface.points, (setup.frames[-1] - setup.frames[0]) * per_frame
    seen = np.linspace(setup.frames[0], setup.frames[-1], count + 1)
    # Bones whose poses are not finite are omitted here; they are reported in the loop.
    bones = [bone for bone in setup.bones if np.isfinite([bone.pose(frame) for frame in seen]).all()]
    things = [posed(f'bone "{bone.name}"', bone.pose, points) for bone in bones]
    found = skipped(things, seen.tolist(), diagonal(points))
    if found is None:
        return None
    thing, early, late = found
    return Trouble(
        "out of steps",
        f"{thing.place} turns by more than a right angle, moves farther than the length of the muscle, or moves out and back, "
        f"between frames {early:g} and {late:g}, where this solver takes no step; a slower motion, over more frames, helps",
    )


def refused(model: FrameModel, first: int, sink: Sink, why: Trouble) -> Outcome:
    """The outcome of a run that ends before the loop, for the reason ``why``. The ``first`` frame, at rest, goes to ``sink``."""
    sink(model.frame(first))
    return Outcome(why.status, why.sentence, _begun(model))


def each(model: FrameModel, numbers: Iterable[int], wanted: tuple[int, ...], sink: Sink) -> Outcome:
    """Advance ``model`` through the frame ``numbers``, up to the first trouble. The ``wanted`` frames go to ``sink``."""
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


def timed[M: FrameModel, S: Record](
    make: Callable[[Any, S], M], setup: Setup, settings: S, quick: S | None = None
) -> M:
    """The model that ``make`` creates from ``setup`` and ``settings``, with two durations in its cost.

    ``seconds_compile``: the time to solve one frame of a tetrahedron beforehand, which compiles all functions; it uses the settings
    ``quick`` if they are given. ``seconds_setup``: the time to create the model.
    """
    begin = time.perf_counter()
    first = make(tetrahedron(), quick or settings)
    first.move(1)
    first.frame(1)
    compiled = time.perf_counter()
    model = make(setup, settings)
    model.cost["seconds_compile"] = compiled - begin
    model.cost["seconds_setup"] = time.perf_counter() - compiled
    return model


def tetrahedron() -> MuscleProblem:
    """A problem of one tetrahedron, with one fibre and one vertex that is attached to a bone."""
    corners = np.vstack([np.zeros(3), np.eye(3)])
    surface, facets = Surface(corners, TET_FACES), {"end": TET_FACES[:1]}
    clear = Grid(np.ones((5, 5, 5)), (-1.0, -1.0, -1.0), 1.0, 1.0, 0.0, 0.0)
    bone = Bone("bone", surface, None, solid=clear)
    attached = (AttachedVertices("end", bone, np.zeros(1, np.int64)),)
    mesh, fibre = TetMesh(corners, np.arange(4)[None], facets), Polylines(corners[:2], np.array([0, 2]))
    return MuscleProblem(surface, (bone,), attached, (0, 1), None, mesh=mesh, effects=(), fibres=fibre)


class MovingSurface:
    """A muscle surface with vertices at ``points`` (n, 3) [mm], which is advanced from one frame number to the next."""

    advice = "a slower motion, more steps or a lower stiffness may help"

    def __init__(self, setup: Setup) -> None:
        self.setup, self.points = setup, setup.begin(setup.surface.points)
        self.check = SurfaceCheck(setup.surface, setup.attached_vertices)
        free = len(self.points) - len(np.unique(setup.attached_vertices))
        self.cost: dict[str, float] = {"unknowns": 3.0 * free}

    def trouble(self) -> Trouble | None:
        """The trouble with the surface; None if there is none."""
        return self.check.trouble(self.points)

    def frame(self, number: int) -> Frame:
        """The present surface, which is that of frame ``number``."""
        return Frame(number, self.points.copy())

    def ending(self) -> Outcome:
        """The outcome, always *converged*, because an iteration cannot fail."""
        return Outcome("converged", f"{self.setup.frames[-1] - self.setup.frames[0]} iterations")


def carry(points: Floats, setup: Setup, frame: float) -> None:
    """Move the attached vertices, in place, with their bones to ``frame``."""
    for entry in setup.attached:
        points[entry.vertices] = apply(entry.bone.pose(frame), setup.surface.points[entry.vertices])


def other_clock(setup: Setup, frame_time: float) -> str:
    """The end of a message if the interval of the scene differs from the ``frame_time`` [s] of a solver; otherwise empty."""
    if setup.interval is None or math.isclose(setup.interval, frame_time):
        return ""
    return f"; the time between frame numbers is {frame_time:g} s in this solver, but {setup.interval:g} s in the scene"
