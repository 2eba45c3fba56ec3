"""Adaptive load steps from frame to frame: halve on failure, grow on easy steps, never skip a requested frame."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from fem_reference.runs.contents import Status
from fem_reference.solvers.common.state_checks import Trouble

EASY = 5  # Newton iterations up to which the next step may grow
GROWTH = 1.5


@dataclass(frozen=True)
class Attempt:
    """The record of a Newton solve at one load: its ``status``, which becomes the status of the run if the solve finally fails; the
    number of ``iterations``; the norms of the ``residuals`` [N, mm3] before the first iteration and after each; for a failure a
    ``detail``: a sentence that begins with its subject.
    """

    status: Status
    iterations: int
    residuals: tuple[float, ...] = ()
    detail: str = ""

    @property
    def converged(self) -> bool:
        """True if an equilibrium was found and no check refused it."""
        return self.status == "converged"

    def refused(self, why: Trouble) -> "Attempt":
        """This converged attempt as a failure, because a check refuses its state."""
        return replace(self, status=why.status, detail=f"Newton's method converged, but {why.sentence}")


@dataclass(frozen=True)
class Step:
    """The steps to a requested ``frame``: load steps, Newton iterations and cut-backs since the previous frame; the ``last``
    attempt; the frame of the last converged state (``at``); the ``size`` of the next load step.
    """

    frame: float
    steps: int = 0
    iterations: int = 0
    cutbacks: int = 0
    last: Attempt = Attempt("converged", 0)
    at: float = 0.0
    size: float = 0.0


@dataclass(frozen=True)
class StepSizes:
    """The sizes of the ``first``, smallest and largest load step, in frame numbers; a step ends at each of ``stops``, in order."""

    first: float
    smallest: float
    largest: float | None = None
    stops: tuple[float, ...] = ()

    def goals(self, at: float, frame: float) -> tuple[float, ...]:
        """The stops between ``at`` and a ``frame``, and the frame itself."""
        near = 1e-9 * max(1.0, abs(at), abs(frame))
        return (*(stop for stop in self.stops if at + near < stop < frame - near), float(frame))


def march(
    attempt: Callable[[float], Attempt],
    frames: tuple[float, ...],
    steps: StepSizes,
    recall: Callable[[float], bool] = lambda _: False,
    last_resort: Callable[[], bool] = lambda: False,
) -> Iterator[Step]:
    """Go from ``frames[0]`` (at rest, or the frame at which the run continues) through every frame. ``attempt`` solves at a load
    from the last converged state, and must restore that state if it fails. A frame for which ``recall`` finds an earlier state
    needs no step. Before giving up, the loop calls ``last_resort`` to change the solution method; if that returns True, it tries
    the load steps again. The loop ends after the first frame that cannot be reached.
    """
    largest = math.inf if steps.largest is None else steps.largest
    at, step = float(frames[0]), min(steps.first, largest)
    for frame in frames[1:]:
        taken = iterations = cutbacks = 0
        result = Attempt("converged", 0)
        for goal in steps.goals(at, frame):
            if goal == frame and recall(frame):
                at = goal
            while at < goal:
                left = goal - at  # divided into equal steps of about ``step``, so that no step is tiny
                size = left / max(1, round(left / step + 0.3), math.ceil(left / largest - 1e-9))
                then = goal if size == left else at + size
                result = attempt(then)
                iterations += result.iterations
                if not result.converged:
                    cutbacks += 1
                    step = size / 2
                    if step < steps.smallest and last_resort():
                        step = min(steps.first, largest)
                    elif step < steps.smallest:
                        yield Step(frame, taken, iterations, cutbacks, result, at)
                        return
                    continue
                at = then
                taken += 1
                step = step * GROWTH if result.iterations <= EASY else size
        yield Step(frame, taken, iterations, cutbacks, result, at, step)
