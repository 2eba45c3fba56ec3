"""Adaptive load steps from frame to frame: a failed step is halved, steps grow after an easy step, and no frame is skipped."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

from fem_reference.runs.contents import Status
from fem_reference.solvers.common.state_checks import Trouble

EASY = 5  # the maximum number of Newton iterations after which the next step grows
GROWTH = 1.5


@dataclass(frozen=True)
class Attempt:
    """The record of a Newton solve at one load.

    ``status``: the status of the solve, and of the run if it ends here. ``iterations``: the number of iterations. ``residuals`` [N,
    mm3]: the norms before the first iteration and after each. ``detail``: for a failure, a sentence that begins with its subject.
    """

    status: Status
    iterations: int
    residuals: tuple[float, ...] = ()
    detail: str = ""

    @property
    def converged(self) -> bool:
        """True if an equilibrium was found and every check accepted it."""
        return self.status == "converged"

    def refused(self, why: Trouble) -> "Attempt":
        """A copy of this converged attempt as a failure, because a check found the trouble ``why`` with the state."""
        return replace(self, status=why.status, detail=f"Newton's method converged, but {why.sentence}")


@dataclass(frozen=True)
class Step:
    """The load steps from the previous requested frame to ``frame``.

    ``steps``, ``iterations``, ``cutbacks``: the number of load steps, Newton iterations and cut-backs. ``last``: the last attempt.
    ``at``: the frame number of the last converged state. ``size``: the size of the next load step.
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
    """The sizes of load steps, in frame numbers: the ``first``, the ``smallest`` and the ``largest`` (None: no maximum).

    ``stops``: increasing frame numbers at which a load step must end.
    """

    first: float
    smallest: float
    largest: float | None = None
    stops: tuple[float, ...] = ()

    def goals(self, at: float, frame: float) -> tuple[float, ...]:
        """The stops between the frame numbers ``at`` and ``frame``, followed by ``frame``."""
        near = 1e-9 * max(1.0, abs(at), abs(frame))
        return (*(stop for stop in self.stops if at + near < stop < frame - near), float(frame))


def march(
    attempt: Callable[[float], Attempt],
    frames: tuple[float, ...],
    steps: StepSizes,
    recall: Callable[[float], bool] = lambda _: False,
    last_resort: Callable[[], bool] = lambda: False,
) -> Iterator[Step]:
    """Yield the steps to each of ``frames`` after the first, which is at rest or is the frame from which the run continues.

    ``attempt``: solve at a load from the last converged state, and restore that state on failure. ``recall``: return True if an
    earlier state is reused for a frame, which then needs no step. ``last_resort``: called before the loop gives up; if it returns
    True, the solution method has changed and load steps are tried again. The loop ends at the first frame that cannot be reached.
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
                left = goal - at  # this is divided into equal steps of about ``step``, so that the last one is not tiny
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
