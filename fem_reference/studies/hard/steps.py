"""The same end state whatever the load steps: the reference on a hard case in few steps and in many."""

from dataclasses import dataclass, replace

import numpy as np

from fem_reference.assessment.health import Followed
from fem_reference.foundations.mesh import Floats, diagonal
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.studies.hard.records import StepCounts

SAME = 0.01  # [%] of the body's size: states that differ by more are different
_CUTS = 64  # a load step is cut to this part of itself before it is given up


class StalledError(Exception):
    """The machine was too busy to say anything of a run, and why."""


@dataclass(frozen=True)
class SameEnd:
    """A comparison of runs that should end alike: ``same`` where those that reached the end did; a ``sentence`` on each."""

    same: bool
    sentence: str


def farthest(followed: Followed) -> StepCounts | None:
    """Load steps to the frame at which a run is farthest from its first state; None of a run that did not leave it."""
    moved = np.linalg.norm(followed.positions[1:] - followed.positions[0], axis=2).max(axis=1, initial=0.0)
    return StepCounts(until=followed.numbers[1 + int(np.argmax(moved))]) if len(moved) and moved.max() > 0 else None


def compare(built: MuscleProblem, choice: SolverChoice, steps: StepCounts) -> SameEnd:
    """The reference up to a frame in several numbers of even load steps; the finest run that got there is the standard."""
    ends, words = dict[int, Floats](), list[str]()
    for count in steps.counts:
        status, end = _end(built, choice, steps.until, count)
        if end is None:
            words.append(f"{count}: {status}")
        else:
            ends[count] = end
    if not ends:
        return SameEnd(True, f"no number of load steps reaches frame {steps.until} ({', '.join(words)})")
    standard, size = ends[max(ends)], diagonal(built.surface.points)
    off = {count: 100 * float(np.linalg.norm(end - standard, axis=1).max()) / size for count, end in ends.items()}
    apart = [f"{count}: {share:.2g} % from that of {max(ends)}" for count, share in off.items() if count != max(ends)]
    listed = ", ".join(apart + words) or "one only"
    return SameEnd(max(off.values()) <= SAME, f"end state at frame {steps.until} by number of load steps: {listed}")


def _end(built: MuscleProblem, choice: SolverChoice, until: int, count: int) -> tuple[str, Floats | None]:
    """The status of a run in ``count`` steps, and the tetrahedra's points (n, 3) [mm], None where it did not get there."""
    span = until - built.frames[0]
    step = {"first_step": span / count, "largest_step": span / count, "smallest_step": span / count / _CUTS}
    settings = fenicsx.Settings(**{**choice.settings, **step})
    frames = list[Frame]()
    outcome = fenicsx.solve(replace(built, frames=(built.frames[0], until)), settings, frames.append)
    check_not_stalled(outcome)
    return outcome.status, frames[-1].points if outcome.status == "converged" else None


def check_not_stalled(outcome: Outcome) -> None:
    """StalledError where an ``outcome`` says nothing of the run."""
    if outcome.status == "stalled":
        raise StalledError(outcome.message)
