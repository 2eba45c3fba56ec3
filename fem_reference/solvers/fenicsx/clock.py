"""The time that passes in load steps, for effects that feel velocities."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from dolfinx import fem

from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import Body


class Clock:
    """Sets ``rate`` [1/s] and the unknowns ``before`` of a load step; both stay as they are where nothing needs the time."""

    def __init__(self, body: Body, before: fem.Function | None, rate: fem.Constant) -> None:
        self.before, self.rate, self.interval, self.at = before, rate, body.interval, body.frames[0]
        self.whole = body.frames[-1] - body.frames[0]

    @property
    def matters(self) -> bool:
        """Whether anything feels how fast time passes."""
        return self.before is not None

    def start(self, frame: float, unknowns: Floats) -> None:
        """A load step from the last settled frame, with its ``unknowns``, to ``frame``."""
        if self.before is not None:
            self.before.x.array[:] = unknowns
            self.rate.value = self._rate(frame - self.at)

    def settle(self, frame: float) -> None:
        """The load step to ``frame`` is the last good one."""
        self.at = frame

    @contextmanager
    def slow(self, unknowns: Floats) -> Iterator[None]:
        """Meanwhile a step would start from ``unknowns`` and take as long as all frames."""
        if self.before is None:
            yield
            return
        now, passed = float(self.rate.value), np.array(self.before.x.array)
        self.before.x.array[:], self.rate.value = unknowns, self._rate(self.whole)
        yield
        self.before.x.array[:], self.rate.value = passed, now

    def _rate(self, frames: float) -> float:
        assert self.interval is not None  # checked where an effect needs it
        return 1 / (frames * self.interval)
