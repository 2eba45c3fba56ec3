"""Estimates for a muscle case before it is solved, and decisions on the effects that the case needs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem_reference.effects import Effect, Energy, Interaction, Ramped, State, elastic_state, regions_named, total_energy
from fem_reference.foundations.indicators import Estimates, Indicator, Near
from fem_reference.foundations.material_point import fibre_tension
from fem_reference.foundations.mesh import Floats, Ints, edge_vectors, triangle_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.regions import samples
from fem_reference.problems import guess
from fem_reference.problems.anatomy import lean
from fem_reference.problems.guess import Guess
from fem_reference.problems.setup import Bone, Setup
from fem_reference.scenes.muscle import MuscleCase

# An effect is negligible if it moves the surface by less than this fraction of the size of tetrahedra, or of the maximum
# displacement (travel) of the surface if this is smaller. Error bars of the surface (rms) are 0.03 to 0.14 of the size and 0.01 to
# 0.05 of the travel. If an effect changes only fibre lengths and volumes, their error bars are smaller.
TOLERANCE = 0.005
# The maximum negligible stress of an effect, relative to that of the other effects, and the minimum strain assumed for these.
STRESS_TOLERANCE, ROUNDING = 0.005, 1e-6
# The assumed error of the guessed position of a point, as a fraction of its path past a bone (actual error in `hip_flexion`: 0.83).
_DOUBT = 1.0
# The numbers of sampled frames, evenly spread, and of sampled vertices.
_FRAMES, _VERTICES = 9, 1500
_PLACES = 6000  # the number of contact points sampled for their distance to bones
_ALONG = 0.7  # triangles are sampled for the stretch along a direction if its component in their plane is above this
_STILL = 1e-6  # motion [mm] up to this is only round-off
_FELT = 1.0  # a distance [mm] from a bone that exceeds any smoothing of contact


@dataclass(frozen=True)
class Decision:
    """The decision on whether an ``effect`` is ``needed``. ``indicator``: the estimates for the effect, None if it is part of the
    material; ``bound`` [mm], ``stress_bound`` [MPa]: their allowed values. ``turned_out``: the frame whose solution showed that the
    effect is needed, None if estimates showed it. ``listed``: True if the effect acts whether it is needed or not. ``of``: the name
    of the muscle if the effect acts in only one of several muscles, otherwise empty.
    """

    effect: Effect
    needed: bool
    indicator: Indicator | None
    bound: float
    stress_bound: float
    turned_out: float | None = None
    listed: bool = False
    of: str = ""

    @property
    def title(self) -> str:
        """The title of the effect, preceded by the name of the muscle if the effect acts in only one of several muscles."""
        return f"{self.of}: {self.effect.title}" if self.of else self.effect.title

    @property
    def why(self) -> str:
        """The decision in words."""
        if self.indicator is None:
            pressing = isinstance(self.effect, Interaction)
            return "kept, as no estimate shows which surfaces touch" if pressing else "kept, as part of the material"
        return f"{self._word}, about {self._because}; {self.indicator.rule}: {self.indicator.number:.2g}"

    def __str__(self) -> str:
        return f"{self.title}: {self.why}"

    @property
    def _word(self) -> str:
        if self.listed:
            return "acts, as it is listed" if self.needed else 'acts, as it is listed ("auto" would leave it out)'
        if not self.needed:
            return "left out"
        if self.turned_out is not None:
            return f"found to be needed at frame {self.turned_out}"
        pressing = isinstance(self.effect, Interaction)
        return "watched, and in the equations where a surface is pressed" if pressing else "needed"

    @property
    def _because(self) -> str:
        """The quantities that decided, in words: those above their allowed values, or both if neither is above."""
        assert self.indicator is not None
        estimate, stress, most = self.indicator.estimate, 1e3 * self.indicator.stress, 1e3 * self.stress_bound
        said = [
            (f"{estimate:.2g} mm of displacement, {self.bound:.2g} mm allowed", estimate <= self.bound),
            (f"{stress:.2g} kPa of stress, {most:.2g} kPa allowed", stress <= most),
        ]
        over = [text for text, within in said if not within]
        return ", and ".join(over or [text for text, _ in said])


def decisions(case: MuscleCase, rest: Setup) -> tuple[Decision, ...]:
    """The decision on each effect of a case before it is solved."""
    known, listed = estimates(case, rest), case.choice == "listed"
    return tuple(replace(decision(effect, effect.indicator(known), known), listed=listed) for effect in case.effects)


def decision(effect: Effect, found: Indicator | None, known: Estimates) -> Decision:
    """Decide whether an ``effect`` is needed, from its indicator ``found`` and the tolerances in ``known``."""
    within = found is not None and found.estimate <= known.tolerance and found.stress <= known.stress_tolerance
    return Decision(effect, not within, found, known.tolerance, known.stress_tolerance)


def solved(known: Estimates, rest: Setup, bones: tuple[Bone, ...], number: float, at: Floats) -> Estimates:
    """The ``known`` estimates, updated from a solved frame. ``number``: the frame number; ``at`` (n, 3): the positions of the
    surface, whose nearness to ``bones`` is computed.
    """
    chosen, felt = _chosen(rest), rest.exempt.places(_PLACES)
    points, moved = rest.surface.points[chosen], at[chosen]
    return replace(
        known,
        travel=float(np.linalg.norm(moved - points, axis=1).max()),
        stretch=stretched(rest, at),
        near={bone.name: _near(bone, felt @ rest.surface.points, {number: felt @ at}, 0.0) for bone in bones},
    )


def _chosen(rest: Setup) -> Ints:
    """The sampled vertices."""
    return np.unique(np.linspace(0, len(rest.surface.points) - 1, _VERTICES).astype(int))


def estimates(case: MuscleCase, rest: Setup) -> Estimates:
    """Estimates for a case from a guessed motion of the surface, in which each point follows the nearest bones."""
    instants = np.unique(np.linspace(0, len(case.numbers) - 1, _FRAMES).round().astype(int))
    frames, chosen = [case.numbers[i] for i in instants], _chosen(rest)
    points, places = rest.surface.points[chosen], rest.exempt.places(_PLACES) @ rest.surface.points
    guessed, felt = Guess.of(points, rest), Guess.of(places, rest)
    moved = {frame: felt.at(frame) if rest.attached else places for frame in frames}
    travel = max(float(np.linalg.norm(guessed.at(frame) - points, axis=1).max()) for frame in frames)
    speed, sideways, jump, acceleration = guess.motion(guessed, guess.axis_of(rest), case.numbers)
    size, shear = case.muscle.tet_size / 2**case.muscle.refinements, _shear(case, rest)
    most = max(guess.strain(points, guessed.at(frame)) for frame in frames) if rest.attached else 0.0
    (low, high), taut = _stretch(rest, frames), _taut(case)
    return Estimates(
        length=guess.length_of(rest),
        thickness=guess.thickness_of(rest),
        shear=shear,
        tension=_tension(case),
        fixed=len(rest.attached),
        sag=guess.sag(rest, frames, travel),
        lean=lean(case, guess.axis_of(rest)),
        travel=travel,
        stretch=(taut * low, taut * high),
        interval=case.frames.interval,
        speed=speed,
        sideways=sideways,
        jump=jump,
        acceleration=acceleration,
        frames=_instants(case),
        tolerance=TOLERANCE * (min(size, travel) if travel > _STILL else size),
        stress_tolerance=STRESS_TOLERANCE * shear * max(most, ROUNDING),
        near={bone.name: _near(bone, places, moved, _DOUBT) for bone in rest.bones},
    )


def _instants(case: MuscleCase) -> tuple[float, ...]:
    """All frame numbers, and the knots of ramps within their range."""
    knots = [knot.frame for effect in case.effects if isinstance(effect, Ramped) for knot in effect.ramp]
    first, last = case.frames.first, case.frames.last
    return tuple(sorted({*map(float, case.numbers), *(knot for knot in knots if first <= knot <= last)}))


def _shear(case: MuscleCase, rest: Setup) -> float:
    """The shear modulus at rest [MPa] of the stored energies without fibres, at the softest point if there are regions."""
    stored = [one for one in case.effects if isinstance(one, Energy) and one.stored and not isinstance(one, Ramped)]
    laws = [(one, 1.0) for one in stored]
    isotropic = [(one, 1.0) for one in stored if not one.needs]
    small = 1e-3
    sheared = State(F=((1.0, small, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), pressure=0.0, fibre=(0.0, 0.0, 1.0))
    named = regions_named(one for one, _ in isotropic or laws)
    points = samples(rest.surface) if named else np.zeros((0, 3))
    at = replace(sheared, regions={name: rest.regions[name](points) for name in named})
    return 2 * float(np.min(total_energy(isotropic or laws, at))) / small**2 or np.finfo(float).tiny


def _tension(case: MuscleCase) -> float:
    """The stress [MPa] of all fibres at their rest length, averaged over the frames. Fibres that act in a region do not count."""
    pulling = [one for one in case.effects if isinstance(one, Energy) and one.stored and "fibre" in one.needs]
    pulling = [one for one in pulling if not one.region]
    return sum(
        float(np.mean([one.amount(frame) for frame in case.numbers])) * fibre_tension(one.energy, 1.0)
        for one in pulling
    )


def _taut(case: MuscleCase) -> float:
    """The maximum stretch of fibres at rest over all frames, due to prestrains."""
    rest = State(F=np.eye(3).tolist(), fibre=(1.0, 0.0, 0.0))
    acting = ([(one, one.amount(frame)) for one in case.effects] for frame in _instants(case))
    return float(max(elastic_state(some, rest).F[0][0] for some in acting))


def _stretch(rest: Setup, frames: list[int]) -> tuple[float, float]:
    """The smallest and the greatest expected fibre stretch, from the line between attachments and the bending by rotating bones."""
    if len(rest.attached) < 2:
        return 1.0, 1.0
    length, half = guess.length_of(rest), guess.thickness_of(rest) / 2
    found = []
    for frame, line in zip(frames, guess.spans(rest, tuple(frames)) / length, strict=True):
        bent = half / length * guess.turn(rest, frame)
        found += [float(line) - bent, float(line) + bent]
    return max(min(found), 0.2), max(found)


def stretched(rest: Setup, positions: Floats) -> tuple[float, float]:
    """The smallest and the greatest stretch of the surface, at ``positions`` (n, 3), along the line between its attachments. At
    each extreme, a hundredth of the surface's area is left out, as it may consist of single triangles at a rim.
    """
    if len(rest.attached) < 2:
        return 1.0, 1.0
    triangles, axis = rest.surface.triangles, guess.axis_of(rest)
    parts = np.linalg.pinv(edge_vectors(rest.surface.points[triangles])) @ axis
    along, moved = (
        np.linalg.norm(np.einsum("tij,tj->ti", edge_vectors(points[triangles]), parts), axis=1)
        for points in (rest.surface.points, positions)
    )
    some, areas = along > _ALONG, triangle_areas(rest.surface.points, triangles)
    low, high = np.quantile(moved[some] / along[some], (0.01, 0.99), weights=areas[some], method="inverted_cdf")
    return float(low), float(high)


def _near(bone: Bone, points: Floats, moved: Mapping[int, Floats] | Mapping[float, Floats], doubt: float) -> Near:
    """The nearness of ``points`` (n, 3) to a ``bone``. ``moved``: their positions (n, 3) at each frame; ``doubt``: the maximum
    error of these positions, as a fraction of the path of each point past the bone.
    """
    low, high = bone.surface.points.min(axis=0), bone.surface.points.max(axis=0)
    local = np.stack([apply(np.linalg.inv(bone.pose(frame)), at) for frame, at in moved.items()])
    off = doubt * np.linalg.norm(local - points, axis=2)
    gap = np.maximum(np.maximum(low - local, local - high), 0).max(axis=2) - off  # the gap to the box around the bone
    some = gap < _FELT
    if some.any():
        gap[some] = guess.distance(bone, local[some]) - off[some]
    nearest = gap.min(axis=1, initial=np.inf)
    depths = np.sqrt((np.minimum(gap, 0) ** 2).sum(axis=1) / max(1, gap.shape[1]))
    first = int(nearest.argmin())
    return Near(float(nearest[first]), float(depths.max()), float(list(moved)[first]))
