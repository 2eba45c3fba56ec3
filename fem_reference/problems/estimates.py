"""What is known of a muscle scene before it is solved, and the effects that it needs by that."""

import logging
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fem_reference.effects import Effect, Energy, Interaction, Ramped, State, total_energy
from fem_reference.effects.contact import among
from fem_reference.foundations.indicators import Estimates, Indicator, Near
from fem_reference.foundations.mesh import Floats, Ints, enclosed_volume, vertex_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.problems.muscle import RigidBody, Setup
from fem_reference.scenes.muscle import MuscleCase

log = logging.getLogger(__name__)

# What an effect may change without being needed, in sizes of the tetrahedra that the scene is solved on: error bars of shipped
# references are 0.03 to 0.06 of these, root mean square of the surface.
TOLERANCE = 0.01
# By how much of the way that a point goes past a bone the guess of where it is may be wrong. In `hip_flexion` it is by 0.83.
_DOUBT = 1.0
# So many frames, evenly spread, and so many vertices are looked at.
_FRAMES, _VERTICES = 9, 1500
_ALONG = 0.7  # of a direction lies in triangles that are asked for the stretch along it
_FELT = 1.0  # [mm] from a bone, more than any smoothing of contact


@dataclass(frozen=True)
class Decision:
    """Whether an effect is ``needed``: by its ``indicator`` (None: part of the material) and the ``bound`` [mm] of that;
    ``turned_out``: the frame whose solution showed it, None where it was known before.
    """

    effect: Effect
    needed: bool
    indicator: Indicator | None
    bound: float
    turned_out: int | None = None

    def __str__(self) -> str:
        if self.indicator is None:
            return f"{self.effect.title}: kept, part of the material"
        word, one = ("needed" if self.needed else "left out"), self.indicator
        if self.turned_out is not None:
            word += f" as it turned out at frame {self.turned_out}"
        elif self.needed and isinstance(self.effect, Interaction):
            word = "watched for, and in the equations where something is pressed"
        because = f"about {one.estimate:.2g} mm of displacement, {self.bound:.2g} mm allowed"
        return f"{self.effect.title}: {word}, {because}; {one.rule}: {one.number:.2g}"


def decisions(scene: MuscleCase, rest: Setup) -> tuple[Decision, ...]:
    """Of each effect of a scene whether that needs it, before it is solved."""
    known = estimates(scene, rest)
    return tuple(_decision(effect, known) for effect in scene.effects)


def missed(
    scene: MuscleCase, rest: Setup, known: Estimates, numbers: tuple[int, ...], positions: Floats
) -> tuple[Decision, ...]:
    """The effects that a scene left out and should not have, by what was ``known`` before and by where its surface went,
    ``positions`` (f, n, 3) at frame ``numbers``: those of the first frame that shows one.
    """
    left = [one.effect for one in scene.decisions if not one.needed]
    bones = rest.bones if among(left) else ()
    for number in _sampled(numbers):
        now = _solved(known, rest, bones, number, positions[numbers.index(number)])
        found = tuple(one for one in (_decision(effect, now) for effect in left) if one.needed)
        if found:
            return tuple(replace(one, turned_out=number) for one in found)
    return ()


def _decision(effect: Effect, known: Estimates) -> Decision:
    found = effect.indicator(known)
    needed = found is None or not found.estimate <= known.tolerance
    return Decision(effect, needed, found, known.tolerance)


def _solved(known: Estimates, rest: Setup, bones: tuple[RigidBody, ...], number: int, at: Floats) -> Estimates:
    """What was ``known`` before, with where the surface is ``at`` (n, 3) in a frame that was solved, beside those ``bones``."""
    chosen = _chosen(rest)
    points, moved = rest.surface.points[chosen], at[chosen]
    return replace(
        known,
        travel=float(np.linalg.norm(moved - points, axis=1).max()),
        stretch=stretched(rest, at),
        near={bone.name: _near(bone, points, {number: moved}, rest.free[chosen], 0.0) for bone in bones},
    )


def _chosen(rest: Setup) -> Ints:
    """The vertices that are looked at."""
    return np.unique(np.linspace(0, len(rest.surface.points) - 1, _VERTICES).astype(int))


def estimates(scene: MuscleCase, rest: Setup) -> Estimates:
    """What effects ask of a scene: by a guess of where the surface goes, each point with the bones that it is nearest to."""
    frames, chosen = _sampled(scene.numbers), _chosen(rest)
    points = rest.surface.points[chosen]
    weights = _weights(points, rest)
    moved = {frame: _guess(points, weights, rest, frame) for frame in frames}
    speed, jump, acceleration = _motion(points, weights, rest, scene.numbers)
    return Estimates(
        length=_length(rest),
        thickness=_thickness(rest),
        shear=_shear(scene),
        travel=max(float(np.linalg.norm(at - points, axis=1).max()) for at in moved.values()),
        stretch=_stretch(rest, frames),
        interval=scene.frames.interval,
        speed=speed,
        jump=jump,
        acceleration=acceleration,
        frames=_instants(scene),
        tolerance=TOLERANCE * scene.muscle.tet_size / 2**scene.muscle.refinements,
        near={bone.name: _near(bone, points, moved, rest.free[chosen], _DOUBT) for bone in rest.bones},
    )


def _sampled(numbers: tuple[int, ...]) -> list[int]:
    return [numbers[i] for i in np.unique(np.linspace(0, len(numbers) - 1, _FRAMES).round().astype(int))]


def _instants(scene: MuscleCase) -> tuple[float, ...]:
    """All frame numbers, and those between them at which a ramp has a knot."""
    knots = [knot.frame for effect in scene.effects if isinstance(effect, Ramped) for knot in effect.ramp]
    first, last = scene.frames.first, scene.frames.last
    return tuple(sorted({*map(float, scene.numbers), *(knot for knot in knots if first <= knot <= last)}))


def _weights(points: Floats, rest: Setup) -> Floats:
    """How much (n, a) each of ``points`` goes with each attachment: as one over its distance, so that what is between two of them
    goes straight, as a muscle does that is pulled tight.
    """
    if not rest.attached:
        return np.zeros((len(points), 0))
    away = [cKDTree(rest.surface.points[entry.vertices]).query(points)[0] for entry in rest.attached]
    near = 1 / np.maximum(np.stack(away, axis=1), 1e-3)
    return np.asarray(near / near.sum(axis=1, keepdims=True))


def _guess(points: Floats, weights: Floats, rest: Setup, frame: float) -> Floats:
    """Where ``points`` (n, 3) go by the motion of the bones that the muscle is attached to."""
    found = np.array(points) if not rest.attached else np.zeros_like(points)
    for i, entry in enumerate(rest.attached):
        found += weights[:, [i]] * apply(entry.bone.pose(frame), points)
    return found


def _motion(points: Floats, weights: Floats, rest: Setup, numbers: tuple[int, ...]) -> tuple[float, float, float]:
    """The greatest speed, jump of velocity and acceleration of the guess, root mean square over the points, by frame numbers: where
    the velocity changes more than it does before and after, it jumps.
    """
    some = slice(None, None, max(1, len(points) // 100))
    at = np.linspace(numbers[0], numbers[-1], min(401, 4 * (numbers[-1] - numbers[0]) + 1))
    path = np.stack([_guess(points[some], weights[some], rest, frame) for frame in at])
    velocity = np.diff(path, axis=0) / (at[1] - at[0])
    first = np.concatenate([np.zeros_like(velocity[:1]), velocity])  # it starts from rest
    change = np.sqrt((np.diff(first, axis=0) ** 2).sum(axis=2).mean(axis=1))
    typical = float(np.median(change))
    jumps = change[change > 5 * typical + 1e-12]
    speed = float(np.sqrt((velocity**2).sum(axis=2).mean(axis=1)).max())
    smooth = change[change <= 5 * typical + 1e-12]
    return speed, float(jumps.max(initial=0.0)), float(smooth.max(initial=0.0)) / (at[1] - at[0])


def _centres(rest: Setup, frame: float | None = None) -> list[Floats]:
    """The middle of each attachment, at rest or at a frame."""
    middles = [rest.surface.points[entry.vertices].mean(axis=0, keepdims=True) for entry in rest.attached]
    if frame is None:
        return [middle[0] for middle in middles]
    return [apply(entry.bone.pose(frame), middle)[0] for entry, middle in zip(rest.attached, middles, strict=True)]


def spans(rest: Setup, numbers: tuple[int, ...]) -> Floats:
    """The distance (f,) [mm] between the middles of the first attachment and of the last, by frame; nothing without two."""
    if len(rest.attached) < 2:
        return np.zeros(0)
    ends = [_centres(rest, number) for number in numbers]
    return np.array([float(np.linalg.norm(middles[0] - middles[-1])) for middles in ends])


def _length(rest: Setup) -> float:
    """From the first attachment to the last, or all of the muscle where it has not two."""
    middles = _centres(rest)
    extent = float(np.linalg.norm(np.ptp(rest.surface.points, axis=0)))
    return float(np.linalg.norm(middles[0] - middles[-1])) or extent if len(middles) > 1 else extent


def _thickness(rest: Setup) -> float:
    """Of a plate of its volume and area."""
    surface = rest.surface
    return (
        2 * enclosed_volume(surface.points, surface.triangles) / vertex_areas(surface.points, surface.triangles).sum()
    )


def _shear(scene: MuscleCase) -> float:
    """The shear modulus at rest [MPa] of all that is stored in the material, without fibres."""
    laws = [
        (one, 1.0) for one in scene.effects if isinstance(one, Energy) and one.stored and not isinstance(one, Ramped)
    ]
    isotropic = [(law, amount) for law, amount in laws if not law.needs]
    small = 1e-3
    sheared = State(F=((1.0, small, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)), pressure=0.0, fibre=(0.0, 0.0, 1.0))
    return 2 * float(total_energy(isotropic or laws, sheared)) / small**2 or np.finfo(float).tiny


def _stretch(rest: Setup, frames: list[int]) -> tuple[float, float]:
    """The smallest and the greatest stretch of fibres that is to be expected: of the line between attachments, and of what is bent
    by as much as bones turn.
    """
    if len(rest.attached) < 2:
        return 1.0, 1.0
    length, half = _length(rest), _thickness(rest) / 2
    found = []
    for frame in frames:
        middles = _centres(rest, frame)
        first, last = (rest.attached[i].bone.pose(frame)[:3, :3] for i in (0, -1))
        bent = half / length * float(Rotation.from_matrix(first.T @ last).magnitude())
        line = float(np.linalg.norm(middles[0] - middles[-1])) / length
        found += [line - bent, line + bent]
    return max(min(found), 0.2), max(found)


def stretched(rest: Setup, positions: Floats) -> tuple[float, float]:
    """The smallest and the greatest stretch of the surface, at ``positions`` (n, 3), along the line between its attachments;
    without the hundredths of its area where it is least and most, which single triangles at a rim may be.
    """
    if len(rest.attached) < 2:
        return 1.0, 1.0
    triangles, middles = rest.surface.triangles, _centres(rest)
    axis = (middles[-1] - middles[0]) / np.linalg.norm(middles[-1] - middles[0])
    edges = _edges(rest.surface.points, triangles)
    parts = np.linalg.pinv(edges) @ axis
    along = np.linalg.norm(_combined(edges, parts), axis=1)
    areas = np.linalg.norm(np.cross(edges[:, :, 0], edges[:, :, 1]), axis=1) / 2
    some = along > _ALONG
    moved = _combined(_edges(positions, triangles[some]), parts[some])
    found = np.linalg.norm(moved, axis=1) / along[some]
    low, high = np.quantile(found, (0.01, 0.99), weights=areas[some], method="inverted_cdf")
    return float(low), float(high)


def _edges(points: Floats, triangles: Ints) -> Floats:
    """Two edges (t, 3, 2) of each triangle, as columns."""
    corners = points[triangles]
    return np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=2)


def _combined(edges: Floats, parts: Floats) -> Floats:
    """The sums (t, 3) of ``edges`` (t, 3, 2) by their ``parts`` (t, 2)."""
    return np.asarray(np.einsum("tij,tj->ti", edges, parts))


def _near(bone: RigidBody, points: Floats, moved: dict[int, Floats], free: NDArray[np.bool_], doubt: float) -> Near:
    """How near the free points come to a ``bone``, which may be wrong by ``doubt`` of the way that they go past it."""
    low, high = bone.surface.points.min(axis=0), bone.surface.points.max(axis=0)
    nearest, deepest, when = np.inf, 0.0, 0.0
    for frame, at in moved.items():
        local = apply(np.linalg.inv(bone.pose(frame)), at)[free]
        off = doubt * np.linalg.norm(local - points[free], axis=1)
        gap = np.maximum(np.maximum(low - local, local - high), 0).max(axis=1, initial=0) - off  # to its box
        some = gap < _FELT
        if some.any():
            solid = bone.solid
            distance = solid.sample(local[some]).distance if solid else signed_distances(local[some], bone.surface)
            gap[some] = distance - off[some]
        if gap.min(initial=np.inf) < nearest:
            nearest, when = float(gap.min()), float(frame)
        deepest = max(deepest, float(np.sqrt((np.minimum(gap, 0) ** 2).sum() / max(1, len(gap)))))
    return Near(nearest, deepest, when)
