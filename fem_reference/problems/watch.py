"""The effects that a scene left out, evaluated again at states that were solved, beside what acts there."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem_reference.effects import Ramped
from fem_reference.effects.contact import among
from fem_reference.foundations.indicators import Estimates
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.estimates import ROUNDING, STRESS_TOLERANCE, Decision, decision, solved
from fem_reference.problems.guess import axis_of, rms
from fem_reference.problems.problem import Problem
from fem_reference.problems.setup import Setup
from fem_reference.problems.stresses import StressSamples, StressSizes
from fem_reference.scenes.muscle import MuscleCase


@dataclass(frozen=True, eq=False)
class WatchedFrame:
    """A frame that was solved: its ``surface`` (n, 3), and the ``stresses`` in its tetrahedra, where there are any."""

    surface: Floats
    stresses: StressSizes | None


class Watch:
    """The influence of effects that a ``case`` left out in frames that are solved, one after the other.

    Of a state a stress follows without another solution: that of the omitted effect, of whose nodal forces it is the cause, beside
    that of what acts. While a run is made the latter is what was ``known`` before, or more, as it turned out; at its end, what
    it was at most.
    """

    def __init__(self, case: MuscleCase, rest: Setup, known: Estimates, built: Callable[[], Problem]) -> None:
        self.case, self.rest, self.known, self.built = case, rest, known, built
        self.left = tuple(one.effect for one in case.decisions if not one.needed)
        self.bones = rest.bones if among(self.left) else ()
        self.frames: dict[float, WatchedFrame] = {}

    @cached_property
    def sampled(self) -> StressSamples:
        """The tetrahedra."""
        rest = self.built().rest
        assert rest.mesh is not None  # of a muscle that is filled
        return StressSamples(rest.mesh, rest.directions)

    @property
    def names(self) -> list[str]:
        """The effects that are watched for, with their parameters."""
        return [repr(one) for one in self.left]

    def see(self, number: float, surface: Floats, tets: Floats | None) -> tuple[Decision, ...]:
        """The effects that matter in a frame, by its ``surface`` (n, 3) and the points ``tets`` (k, 3), where it has tetrahedra."""
        acting, others = ([(one, one.amount(number)) for one in some] for some in (self.case.effects, self.left))
        self.frames[number] = WatchedFrame(surface, None if tets is None else self.sampled.sizes(tets, acting, others))
        return self._found(number, max(self.known.stress_tolerance, STRESS_TOLERANCE * self._most()))

    def end(self) -> tuple[Decision, ...]:
        """The effects that matter, at the first of all frames at which one does: now it is known what stresses there are."""
        if any(one.stresses is None for one in self.frames.values()):
            return ()
        tolerance = STRESS_TOLERANCE * max(self._most(), ROUNDING * self.known.shear)
        return next((found for number in sorted(self.frames) if (found := self._found(number, tolerance))), ())

    def _most(self) -> float:
        return float(np.max([one.stresses.acts if one.stresses else 0.0 for one in self.frames.values()]))

    def _found(self, number: float, stress_tolerance: float) -> tuple[Decision, ...]:
        watched = self.frames[number]
        now = self._moving(solved(self.known, self.rest, self.bones, number, watched.surface), number)
        now = replace(
            now,
            stress_tolerance=stress_tolerance,
            stretch=watched.stresses.stretch if watched.stresses else now.stretch,
        )
        each = [self._decided(i, now, watched.stresses) for i in range(len(self.left))]
        return tuple(replace(one, turned_out=number) for one in each if one.needed)

    def _decided(self, i: int, now: Estimates, stresses: StressSizes | None) -> Decision:
        """The decision on an effect: by the stress that it adds in the tetrahedra, of fibres by that alone."""
        effect = self.left[i]
        found = effect.indicator(now)
        assert found is not None  # of what was left out
        if stresses is not None:
            guessed = 0.0 if "fibre" in effect.needs else found.stress
            found = replace(found, stress=float(np.max([guessed, stresses.added[i]])))  # NaN where either is
        return decision(effect, found, now)

    def _moving(self, now: Estimates, number: float) -> Estimates:
        """The estimates ``now``, with the speed of the surface up to a frame; loads that come by ramps move it, too."""
        before = [earlier for earlier in sorted(self.frames) if earlier < number][-2:]
        if not before:
            return now
        numbers = [*before, number]
        at = np.stack([self.frames[one].surface for one in numbers])
        velocities = np.diff(at, axis=0) / np.diff(numbers)[:, None, None]
        last, axis = velocities[-1], axis_of(self.rest)
        change = float(rms(last - velocities[0] if len(velocities) > 1 else last))
        sudden = any(isinstance(one, Ramped) for one in self.case.effects)
        return replace(
            now,
            speed=max(now.speed, float(rms(last))),
            sideways=max(now.sideways, float(rms(last - np.outer(last @ axis, axis)))),
            jump=max(now.jump, change) if sudden else now.jump,
            acceleration=max(now.acceleration, change / (number - before[-1])) if len(before) > 1 else now.acceleration,
        )
