"""The effects that a scene left out, asked again at states that were solved: what they would do there, beside what acts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem_reference.effects import Ramped
from fem_reference.effects.contact import among
from fem_reference.foundations.indicators import Estimates
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.estimates import ROUNDING, STRESS_TOLERANCE, Decision, decision, solved
from fem_reference.problems.guess import axis_of
from fem_reference.problems.muscle import Problem, Setup
from fem_reference.problems.stresses import Asked, Sampled
from fem_reference.scenes.muscle import MuscleCase


@dataclass(frozen=True, eq=False)
class Seen:
    """A frame that was solved: its ``surface`` (n, 3), and what its tetrahedra say, where there are any."""

    surface: Floats
    asked: Asked | None


class Watch:
    """What effects that a ``case`` left out do in frames that are solved, one after the other.

    Of a state a stress follows without another solution: that of the omitted effect, of whose nodal forces it is the cause, beside
    that of what acts. While a run is made the latter is what was ``known`` before, or more, as it turned out; at its end, what
    it was at most.
    """

    def __init__(self, case: MuscleCase, rest: Setup, known: Estimates, built: Callable[[], Problem]) -> None:
        self.case, self.rest, self.known, self.built = case, rest, known, built
        self.left = tuple(one.effect for one in case.decisions if not one.needed)
        self.bones = rest.bones if among(self.left) else ()
        self.seen: dict[int, Seen] = {}

    @cached_property
    def sampled(self) -> Sampled:
        """The tetrahedra."""
        built = self.built()
        return Sampled(built.mesh, built.directions)

    @property
    def names(self) -> list[str]:
        """The effects that are watched for, with their parameters."""
        return [repr(one) for one in self.left]

    def see(self, number: int, surface: Floats, tets: Floats | None) -> tuple[Decision, ...]:
        """The effects that matter in a frame, by its ``surface`` (n, 3) and the points ``tets`` (k, 3), where it has tetrahedra."""
        acting, others = ([(one, one.amount(number)) for one in some] for some in (self.case.effects, self.left))
        self.seen[number] = Seen(surface, None if tets is None else self.sampled.asked(tets, acting, others))
        return self._found(number, max(self.known.stress_tolerance, STRESS_TOLERANCE * self._most()))

    def end(self) -> tuple[Decision, ...]:
        """The effects that matter, at the first of all frames at which one does: now it is known what stresses there are."""
        if any(one.asked is None for one in self.seen.values()):
            return ()
        tolerance = STRESS_TOLERANCE * max(self._most(), ROUNDING * self.known.shear)
        return next((found for number in sorted(self.seen) if (found := self._found(number, tolerance))), ())

    def _most(self) -> float:
        return float(np.max([one.asked.acts if one.asked else 0.0 for one in self.seen.values()]))

    def _found(self, number: int, stress_tolerance: float) -> tuple[Decision, ...]:
        seen = self.seen[number]
        now = self._moving(solved(self.known, self.rest, self.bones, number, seen.surface), number)
        now = replace(now, stress_tolerance=stress_tolerance, stretch=seen.asked.stretch if seen.asked else now.stretch)
        each = [self._decided(i, now, seen.asked) for i in range(len(self.left))]
        return tuple(replace(one, turned_out=number) for one in each if one.needed)

    def _decided(self, i: int, now: Estimates, asked: Asked | None) -> Decision:
        """Whether an effect matters: by the stress that it adds in the tetrahedra, of fibres by that alone."""
        effect = self.left[i]
        found = effect.indicator(now)
        assert found is not None  # of what was left out
        if asked is not None:
            stress = asked.added[i] if "fibre" in effect.needs else max(found.stress, asked.added[i])
            found = replace(found, stress=stress)
        return decision(effect, found, now)

    def _moving(self, now: Estimates, number: int) -> Estimates:
        """What is known ``now``, with how fast the surface moved up to a frame; loads that come by ramps move it, too."""
        before = [earlier for earlier in sorted(self.seen) if earlier < number][-2:]
        if not before:
            return now
        numbers = [*before, number]
        at = np.stack([self.seen[one].surface for one in numbers])
        velocities = np.diff(at, axis=0) / np.diff(numbers)[:, None, None]
        last, axis = velocities[-1], axis_of(self.rest)
        change = _size(last - velocities[0]) if len(velocities) > 1 else _size(last)
        sudden = any(isinstance(one, Ramped) for one in self.case.effects)
        return replace(
            now,
            speed=max(now.speed, _size(last)),
            sideways=max(now.sideways, _size(last - np.outer(last @ axis, axis))),
            jump=max(now.jump, change) if sudden else now.jump,
            acceleration=max(now.acceleration, change / (number - before[-1])) if len(before) > 1 else now.acceleration,
        )


def _size(vectors: Floats) -> float:
    """The root mean square of vectors (n, 3)."""
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
