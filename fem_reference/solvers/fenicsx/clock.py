"""The duration of load steps, for effects that depend on velocities, and the velocities of bodies with inertia."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx.forms import TimeStep

# The duration of the step from rest that determines a body's initial acceleration, as a fraction of the time of all frames.
_INSTANT = 1e-7


class Clock:
    """Sets the time ``step`` of a form; does nothing if the form has none.

    With inertia a body is at rest up to its first requested frame; ``resting`` is True until the initial acceleration is known.
    """

    def __init__(self, body: Body, step: TimeStep | None) -> None:
        self.step, self.interval, self.at, self.first = step, body.interval, body.frames[0], body.first
        self.whole = body.frames[-1] - body.frames[0]
        # An effect with momentum, such as inertia, contains the formulas for its time integration.
        self.momentum: Any = next((one for one in body.effects if "momentum" in one.needs), None)
        size = 0 if step is None or self.momentum is None else len(step.before.x.array)
        self.velocity, self.acceleration = np.zeros(size), np.zeros(size)
        self.resting = self.momentum is not None

    @property
    def matters(self) -> bool:
        """True if an effect depends on the rate of motion."""
        return self.step is not None

    def start(self, frame: float, unknowns: Floats) -> None:
        """Start a load step to ``frame`` from the last settled frame, which has these ``unknowns``."""
        if self.step is not None:
            self._set(unknowns, self._seconds(frame - self.at))

    def settle(self, frame: float, unknowns: Floats) -> None:
        """Record the load step to ``frame``, which ends with ``unknowns``, as the last good step."""
        self.at = frame
        if self.step is not None and self.step.velocity is not None and frame > self.first:
            moved = (self.step.before.x.array, self.velocity, self.acceleration, unknowns)
            self.velocity, self.acceleration = self.momentum.advanced(*moved, 1 / float(self.step.rate.value))
            self.step.velocity.x.array[:] = self.velocity

    def begins(self) -> bool:
        """True if a body with inertia begins to move in the next load step; its initial acceleration must be found first."""
        return self.resting and self.at >= self.first

    def instant(self, unknowns: Floats) -> None:
        """Start a load step, too short for any motion, from rest at ``unknowns``."""
        self._set(unknowns, self._seconds(_INSTANT * self.whole))

    def begin(self, unknowns: Floats) -> None:
        """End the step that ``instant`` started, with ``unknowns``. The velocities are 0, and the accelerations are now known."""
        assert self.step is not None  # an effect has momentum
        moved = unknowns - self.step.before.x.array
        self.acceleration, self.resting = self.momentum.begun(moved, 1 / float(self.step.rate.value)), False

    @contextmanager
    def slow(self, unknowns: Floats) -> Iterator[None]:
        """A context in which a step starts from ``unknowns`` and lasts as long as all frames together."""
        if self.step is None:
            yield
            return
        starts = [one.x.array for one in (self.step.before, self.step.predicted) if one is not None]
        rate, before = float(self.step.rate.value), [np.array(start) for start in starts]
        for start in starts:
            start[:] = unknowns
        self.step.rate.value = 1 / self._seconds(self.whole)
        yield
        self.step.rate.value = rate
        for start, values in zip(starts, before, strict=True):
            start[:] = values

    def arrays(self) -> dict[str, Floats]:
        """The arrays from which the last load step can be restored, apart from the unknowns at the end of the step."""
        if self.step is None:
            return {}
        found = {"before": np.array(self.step.before.x.array)}
        return found | ({"velocity": self.velocity, "acceleration": self.acceleration} if self.momentum else {})

    def facts(self) -> dict[str, Any]:
        """The scalar values that, with the ``arrays``, restore the clock."""
        rate = None if self.step is None else float(self.step.rate.value)
        return {"at": self.at, "resting": self.resting, "rate": rate}

    def take_up(self, arrays: dict[str, Floats], facts: dict[str, Any]) -> None:
        """Restore the state in which the clock returned ``arrays`` and ``facts``."""
        self.at, self.resting = facts["at"], facts["resting"]
        if self.step is None:
            return
        self.step.before.x.array[:], self.step.rate.value = arrays["before"], facts["rate"]
        if self.step.velocity is not None:
            self.velocity, self.acceleration = arrays["velocity"], arrays["acceleration"]
            self.step.velocity.x.array[:] = self.velocity

    def _set(self, unknowns: Floats, seconds: float) -> None:
        assert self.step is not None  # callers check this, or an effect has momentum
        self.step.before.x.array[:], self.step.rate.value = unknowns, 1 / seconds
        if self.step.predicted is not None:
            moving = unknowns, self.velocity, self.acceleration
            self.step.predicted.x.array[:] = self.momentum.predicted(*moving, seconds)

    def _seconds(self, frames: float) -> float:
        assert self.interval is not None  # checked if an effect needs it
        return frames * self.interval
