"""Stresses in solved states, from the energies of acting and of omitted effects. This module is independent of any solver."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np

from fem_reference.effects import Effect, Energy, Prestrain, Ramped, State, elastic_state, in_situ, total_energy
from fem_reference.effects.contact import among
from fem_reference.foundations.indicators import Estimates
from fem_reference.foundations.jets import JET_FUNCTIONS, Jet, variables
from fem_reference.foundations.mesh import Floats, Ints, TetMesh, edge_vectors, tet_volumes
from fem_reference.geometry.regions import Region
from fem_reference.problems.estimates import ROUNDING, STRESS_TOLERANCE, Decision, decision, solved
from fem_reference.problems.guess import axis_of, rms
from fem_reference.problems.problem import Problem
from fem_reference.problems.setup import Setup
from fem_reference.scenes.muscle import MuscleCase

Acting = Sequence[tuple[Effect, float]]
Shares = Mapping[str, Floats]
NONE: Shares = MappingProxyType({})

# The maximum number of sampled tetrahedra, which are evenly spread, and the number of points evaluated at once, small enough for
# their jets to fit into a cache.
_MOST, AT_ONCE = 2048, 1024
_SMALLEST = 0.05  # the minimum det F of sampled tetrahedra: curved tetrahedra may be inverted between their corners


def first_piola(acting: Acting, state: State, count: int, at_rest: Jet | float = 0.0) -> Floats:
    """The first Piola-Kirchhoff stress ``dW/dF`` (count, 3, 3) [MPa] at a ``state`` whose F consists of jets. W is the energy per
    unit rest volume of the effects ``acting``, pairs (effect, amount), plus the energy ``at_rest`` of a stress at rest.
    """
    energy = total_energy(acting, state) + at_rest
    slope = energy.slope if isinstance(energy, Jet) else np.zeros((9, 1))
    return np.asarray(np.broadcast_to(slope.reshape(9, -1), (9, count)).T.reshape(count, 3, 3))


def kirchhoff(acting: Acting, F: Floats, fibre: Floats | None, shares: Shares = NONE) -> Floats:
    """The Kirchhoff stress ``dW/dF F^T`` (n, 3, 3) [MPa] of the effects ``acting``, pairs (effect, amount), at n points.

    ``F`` (n, 3, 3): the deformation gradients; ``fibre`` (n, 3): the fibre directions; ``shares``: the shares (n,) in each region.
    The pressure of the mixed formulation and effects that depend on time are not included.
    """
    found = np.zeros(F.shape)
    for start in range(0, len(F), AT_ONCE):
        some = slice(start, start + AT_ONCE)
        jets = variables(F[some].reshape(-1, 9).T, curved=False)
        along = None if fibre is None else list(fibre[some].T)
        state = State([jets[0:3], jets[3:6], jets[6:9]], pressure=0.0, fibre=along, functions=JET_FUNCTIONS)
        state = replace(state, regions={name: share[some] for name, share in shares.items()})
        with np.errstate(all="ignore"):  # an effect with a stress of NaN counts as needed
            found[some] = first_piola(acting, state, len(F[some])) @ np.swapaxes(F[some], 1, 2)
    return found


@dataclass(frozen=True)
class StressSizes:
    """Sizes of stresses [MPa] in a state, as root mean squares over the volume. ``acts``: the stress of the acting effects without
    pressure; ``added``: the change of stress that each of the other effects would cause. ``stretch``: the smallest and the greatest
    fibre stretch. All values are NaN if no sampled tetrahedron has a det F above 0.05.
    """

    acts: float
    added: tuple[float, ...]
    stretch: tuple[float, float]


class StressSamples:
    """Samples of the stress in the tetrahedra of a ``mesh``. ``fibre`` (m, 3): the fibre directions in the tetrahedra; ``regions``:
    the regions in which effects act.
    """

    def __init__(
        self, mesh: TetMesh, fibre: Floats | None, regions: Mapping[str, Region] = MappingProxyType({})
    ) -> None:
        chosen = np.unique(np.linspace(0, len(mesh.tets) - 1, _MOST).astype(int))
        self.tets: Ints = mesh.tets[chosen]
        self.inverse = np.linalg.inv(edge_vectors(mesh.points[self.tets]))
        self.volumes = tet_volumes(mesh.points, self.tets)
        self.fibre = None if fibre is None else fibre[chosen]
        middles = mesh.points[self.tets].mean(axis=1)
        self.shares = {name: region(middles) for name, region in regions.items()}

    def sizes(self, positions: Floats, acting: Acting, others: Acting) -> StressSizes:
        """The sizes of the stress of the effects ``acting`` and of its change by each of ``others``.

        ``positions`` (n, 3) [mm]: the positions of the points of the mesh.
        """
        F = edge_vectors(positions[self.tets]) @ self.inverse
        good = np.linalg.det(F) > _SMALLEST
        if not good.any():
            return StressSizes(np.nan, (np.nan,) * len(others), (np.nan, np.nan))
        F, volumes, fibre = F[good], self.volumes[good], None if self.fibre is None else self.fibre[good]
        shares = {name: share[good] for name, share in self.shares.items()}
        now = kirchhoff(acting, F, fibre, shares)
        added = [_added(acting, one, now, lambda terms: kirchhoff(terms, F, fibre, shares)) for one in others]
        shear = now - np.trace(now, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
        return StressSizes(
            _mean(shear, volumes), tuple(_mean(one, volumes) for one in added), _stretches(acting, F, fibre, volumes)
        )


def _added(acting: Acting, one: tuple[Effect, float], now: Floats, stress: Callable[[Acting], Floats]) -> Floats:
    """The change (n, 3, 3) of the stress ``now`` (n, 3, 3) of the effects ``acting`` that the further effect ``one`` would cause.

    For an energy, it is the stress of this energy with the prestrains in ``acting``. ``stress``: a function from effects to stress.
    """
    if isinstance(one[0], Energy):
        return stress([*(other for other in acting if isinstance(other[0], Prestrain)), one])
    return stress([*acting, one]) - now if isinstance(one[0], Prestrain) else np.zeros(now.shape)


def _stretches(acting: Acting, F: Floats, fibre: Floats | None, volumes: Floats) -> tuple[float, float]:
    """The smallest and the greatest elastic stretch of fibres; a hundredth of the volume at each extreme is left out."""
    if fibre is None:
        return 1.0, 1.0
    state = elastic_state(acting, State([list(row) for row in np.moveaxis(F, 0, -1)], fibre=list(fibre.T)))
    low, high = np.quantile(state.fibre_stretch, (0.01, 0.99), weights=volumes, method="inverted_cdf")
    return float(low), float(high)


def _mean(stress: Floats, volumes: Floats) -> float:
    """The root mean square, over the volume, of the Frobenius norm of a ``stress`` (n, 3, 3)."""
    return float(np.sqrt(((stress**2).sum(axis=(1, 2)) * volumes).sum() / volumes.sum()))


class Watch:
    """A watch on the influence that the omitted effects of a ``case`` would have on the frames of a run, as these are solved.

    The stresses of omitted and of acting effects follow from a solved state without another solution. The former are compared with
    the latter: during a run, with the maximum of the ``known`` estimate and the stresses so far; at the end, with the maximum of
    all stresses. ``frames``: the surface (n, 3) of each frame, and the stresses in its tetrahedra, None without tetrahedra.
    """

    def __init__(self, case: MuscleCase, rest: Setup, known: Estimates, built: Callable[[], Problem]) -> None:
        self.case, self.rest, self.known, self.built = case, rest, known, built
        self.left = tuple(one.effect for one in case.decisions if not one.needed)
        self.bones = rest.bones if among(self.left) else ()
        self.frames: dict[float, tuple[Floats, StressSizes | None]] = {}

    @cached_property
    def sampled(self) -> StressSamples:
        """The sampled tetrahedra."""
        rest = self.built().rest
        assert rest.mesh is not None  # the muscle has been filled
        return StressSamples(rest.mesh, rest.directions, self.rest.regions)

    @property
    def names(self) -> list[str]:
        """The names of the watched effects, with their parameters."""
        return [repr(one) for one in self.left]

    def see(self, number: float, surface: Floats, tets: Floats | None) -> tuple[Decision, ...]:
        """The decisions on the omitted effects that matter in the frame ``number``. ``surface`` (n, 3): the positions of its
        surface; ``tets`` (k, 3): the positions of the points of its tetrahedra, None without tetrahedra.
        """
        acting, others = ([(one, one.amount(number)) for one in some] for some in (self.case.effects, self.left))
        self.frames[number] = surface, None if tets is None else self.sampled.sizes(tets, acting, others)
        estimated = self.known.stress_tolerance
        return self._found(number, estimated if self._tense else max(estimated, STRESS_TOLERANCE * self._most()))

    def end(self) -> tuple[Decision, ...]:
        """The decisions on the omitted effects that matter, at the first frame at which one does; empty if stresses are unknown."""
        if any(stresses is None for _, stresses in self.frames.values()):
            return ()
        tolerance = STRESS_TOLERANCE * max(self._most(), ROUNDING * self.known.shear)
        tolerance = min(tolerance, self.known.stress_tolerance) if self._tense else tolerance
        return next((found for number in sorted(self.frames) if (found := self._found(number, tolerance))), ())

    @property
    def _tense(self) -> bool:
        return in_situ.among(self.case.effects) is not None

    def _most(self) -> float:
        return float(np.max([stresses.acts if stresses else 0.0 for _, stresses in self.frames.values()]))

    def _found(self, number: float, stress_tolerance: float) -> tuple[Decision, ...]:
        surface, stresses = self.frames[number]
        now = self._moving(solved(self.known, self.rest, self.bones, number, surface), number)
        stretch = stresses.stretch if stresses else now.stretch
        now = replace(now, stress_tolerance=stress_tolerance, stretch=stretch)
        each = [self._decided(i, now, stresses) for i in range(len(self.left))]
        return tuple(replace(one, turned_out=number) for one in each if one.needed)

    def _decided(self, i: int, now: Estimates, stresses: StressSizes | None) -> Decision:
        """The decision on the omitted effect ``i``. The stress that it adds in tetrahedra counts; for fibres, only this stress."""
        effect = self.left[i]
        found = effect.indicator(now)
        assert found is not None  # every omitted effect has an indicator
        if stresses is not None:
            guessed = 0.0 if "fibre" in effect.needs else found.stress
            found = replace(found, stress=float(np.max([guessed, stresses.added[i]])))  # NaN if either is NaN
        return decision(effect, found, now)

    def _moving(self, now: Estimates, number: float) -> Estimates:
        """The estimates ``now``, updated with the motion of the solved surface up to frame ``number``, as loads move it too."""
        before = [earlier for earlier in sorted(self.frames) if earlier < number][-2:]
        if not before:
            return now
        numbers = [*before, number]
        at = np.stack([self.frames[one][0] for one in numbers])
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
