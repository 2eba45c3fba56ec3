"""Several muscles in one scene: a set-up and a problem for each muscle, and one body of all muscles with contact between them."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from fem_reference.effects import contact as contacts
from fem_reference.effects.touching import MuscleContact
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.indicators import Indicator
from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh, united
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import distances
from fem_reference.geometry.interpenetration import skin_of
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.skins import spacing
from fem_reference.problems import muscle
from fem_reference.problems.body import Body
from fem_reference.problems.estimates import Decision, decision, decisions, estimates
from fem_reference.problems.guess import length_of, thickness_of
from fem_reference.problems.joining import Span, called, join
from fem_reference.problems.muscle import RELAXING, MuscleProblem
from fem_reference.problems.problem import AtRest, Task
from fem_reference.problems.setup import Bone, Setup
from fem_reference.problems.touching import Touching
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase

_BETWEEN = 8  # samples of the motion of a bone between two stops


@dataclass(frozen=True, eq=False)
class MusclesSetup:
    """The set-ups of several ``muscles``, by name, with the same bones and frames. ``pairs``: muscles that may touch each other."""

    muscles: dict[str, Setup]
    pairs: tuple[tuple[str, str], ...]

    task: ClassVar[Task] = "solve"
    exact: ClassVar[None] = None
    field: ClassVar[None] = None
    body: ClassVar[None] = None

    @property
    def frames(self) -> tuple[int, ...]:
        """The requested frames."""
        return next(iter(self.muscles.values())).frames

    @property
    def bones(self) -> tuple[Bone, ...]:
        """The bones, which all muscles share."""
        return next(iter(self.muscles.values())).bones

    @property
    def rest(self) -> AtRest:
        """The rest state of all surfaces as one surface, without fibres and tetrahedra."""
        return AtRest(_surfaces(self.muscles.values()))


@dataclass(frozen=True, eq=False)
class MusclesProblem:
    """The ``problems`` of several muscles, by name, which are solved as one body. ``pairs``: the muscles that may touch each other;
    ``law``: the contact between them, None without contact; ``apart``: True if muscles must not cross, because contact acts between
    them or was left out as they stay apart.
    """

    problems: dict[str, MuscleProblem]
    pairs: tuple[tuple[str, str], ...]
    law: MuscleContact | None
    apart: bool

    task: ClassVar[Task] = "solve"
    exact: ClassVar[None] = None
    field: ClassVar[None] = None

    @property
    def frames(self) -> tuple[int, ...]:
        """The requested frames."""
        return next(iter(self.problems.values())).frames

    @property
    def bones(self) -> tuple[Bone, ...]:
        """The bones, which all muscles share."""
        return next(iter(self.problems.values())).bones

    @property
    def free(self) -> NDArray[np.bool_]:
        """Mask (n,) of the vertices of all surfaces that may be in contact with bones."""
        return np.concatenate([one.free for one in self.problems.values()])

    @property
    def seconds(self) -> float:
        """The time [s] that the meshing of all muscles took."""
        return sum(one.seconds for one in self.problems.values())

    @property
    def mesh_facts(self) -> dict[str, float | str]:
        """Facts about the meshes; the name of each fact begins with the name of the muscle."""
        return {called(name, key): fact for name, one in self.problems.items() for key, fact in one.mesh_facts.items()}

    @cached_property
    def rest(self) -> AtRest:
        """The rest state of everything whose positions a frame contains, in the order of the muscles."""
        found = list(self.problems.values())
        counts = np.concatenate([np.diff(one.fibres.offsets) for one in found])
        known = [one.directions for one in found]
        along = None
        if any(one is not None for one in known):
            blank = [np.tile([1.0, 0.0, 0.0], (len(one.mesh.tets), 1)) for one in found]
            along = np.concatenate([no if one is None else one for one, no in zip(known, blank, strict=True)])
        fibres = Polylines(np.concatenate([one.fibres.points for one in found]), np.cumsum([0, *counts]))
        mesh = TetMesh(*united([(one.mesh.points, one.mesh.tets) for one in found]), maker=found[0].mesh.maker)
        return AtRest(_surfaces(found), fibres, mesh, along)

    @property
    def muscle(self) -> MuscleProblem:
        """Raise InputError, as there is no single muscle."""
        raise InputError("muscle", f"several ({', '.join(self.problems)})", "a case of one muscle")

    def write_meshes(self, folder: Path) -> None:
        """Write surface, fibres and tetrahedra for ParaView, in ``folder``, where each muscle has a folder with its name."""
        for name, one in self.problems.items():
            (folder / name).mkdir(exist_ok=True)
            one.write_meshes(folder / name)

    @cached_property
    def body(self) -> Body:
        """The finite element body of all muscles, with contact between the free surfaces of muscles that may touch."""
        bodies, law, first = {name: one.body for name, one in self.problems.items()}, self.law, self.frames[0]
        touching, relaxed = list[Touching](), (first - RELAXING, first)
        for one, other in self.pairs:
            assert law is not None  # without contact no pair may touch
            at = called(one, "free"), called(other, "free")
            removed = relaxed if self._near_at_rest(one, other) else None
            smooth = law.friction is None
            touching.append(Touching(*at, law.stiffness, law.smoothing, law.friction, removed, smooth, law.own_normals))
        return join(bodies, tuple(touching))

    def _near_at_rest(self, one: str, other: str) -> bool:
        """True if the tetrahedra of two muscles overlap at rest, or are so close that they press against each other."""
        assert self.law is not None  # called with contact only
        skins = [skin_of(self.problems[name].mesh) for name in (one, other)]
        return _apart(*skins) < self.law.smoothing

    @cached_property
    def spans(self) -> tuple[Span, ...]:
        """The slices of the joined arrays that belong to each muscle."""
        found = self.problems.values()
        counts = [
            (len(one.surface.points), len(one.fibres.points), len(one.mesh.points), len(one.mesh.tets)) for one in found
        ]
        ends = np.cumsum([(0, 0, 0, 0), *counts], axis=0).tolist()
        return tuple(
            Span(name, *(slice(first, last) for first, last in zip(one, other, strict=True)))
            for name, one, other in zip(self.problems, ends, ends[1:], strict=False)
        )


def _surfaces(parts: Iterable[Setup]) -> Surface:
    return Surface(*united([(one.surface.points, one.surface.triangles) for one in parts]))


def setup(case: MusclesCase) -> MusclesSetup:
    """Read and check the surfaces of all muscles, and find the pairs that may touch. An InputError names the invalid part."""
    found = dict[str, Setup]()
    for i, part in enumerate(case.parts):
        with case.placed(i):
            found[case.muscle[i].name] = muscle.setup(part)
    law = case.touching
    gaps = {} if law is None else _gaps(case, found, law.smoothing)
    return MusclesSetup(found, tuple(pair for pair, gap in gaps.items() if law and gap < law.smoothing))


def build(case: MusclesCase, rest: MusclesSetup) -> MusclesProblem:
    """The problem of all muscles, each filled with tetrahedra and fibres."""
    built = dict[str, MuscleProblem]()
    for i, (part, (name, one)) in enumerate(zip(case.parts, rest.muscles.items(), strict=True)):
        with case.placed(i):
            built[name] = muscle.build(part, one)
    return MusclesProblem(built, rest.pairs, case.touching, case.apart)


def _gaps(case: MusclesCase, muscles: Mapping[str, Setup], felt: float) -> dict[tuple[str, str], float]:
    """A lower bound [mm] on the distance between each pair of muscles over all frames, by their names. It allows for bulging, loads
    and the pressure of bones, unless the motion of the bones alone may already bring the muscles within ``felt`` [mm].
    """
    parts, found = dict(zip(muscles, case.parts, strict=True)), dict[tuple[str, str], float]()
    beyond = cache(lambda name: _beyond(parts[name], muscles[name]))
    for pair in combinations(muscles, 2):
        gap = clearance(muscles[pair[0]], muscles[pair[1]])
        found[pair] = gap if gap < felt else gap - beyond(pair[0]) - beyond(pair[1])
    return found


def _beyond(case: MuscleCase, rest: Setup) -> float:
    """The distance [mm] by which a muscle may deviate from the motion of its bones. A muscle bulges as it shortens at constant
    volume, bones in contact displace it by their penetration, and external loads move it by at most its length.
    """
    if any(one.outer for one in case.effects):
        return length_of(rest)
    known, contact = estimates(case, rest), contacts.among(case.effects)
    bulge = thickness_of(rest) / 2 * (1 / math.sqrt(min(known.stretch[0], 1.0)) - 1)
    bones = known.near if contact and contact.bones is None else (contact.bones or () if contact else ())
    return bulge + max((-known.near[name].gap for name in bones if known.near[name].gap < 0), default=0.0)


def clearance(one: Setup, other: Setup) -> float:
    """A lower bound [mm] on the distance, over all frames, between two muscles that only follow the bones. It is the distance at
    rest minus the maximum displacement of each muscle with a bone, and negative if the muscles may cross.
    """
    between = max(spacing(one.surface), spacing(other.surface))  # distances are measured between vertices
    return _apart(one.surface, other.surface) - between - _travel(one) - _travel(other)


def _apart(one: Surface, other: Surface) -> float:
    """The distance [mm] between two surfaces, measured from the vertices of each to the other; 0 if they cross."""
    if len(crossings(one, other)):
        return 0.0
    found = [distances(a.points, b).distance.min() for a, b in ((one, other), (other, one))]
    return float(min(found))


def _travel(rest: Setup) -> float:
    """The maximum displacement [mm] of a point of the muscle that moves with any bone, sampled as in ``_instants``."""
    points = rest.surface.points
    moved = [
        np.linalg.norm(apply(bone.pose(frame), points) - points, axis=1).max()
        for bone in rest.bones
        for frame in (_instants(bone, rest.frames) if bone.motion else ())
    ]
    return float(max(moved, default=0.0))


def _instants(bone: Bone, frames: Sequence[int]) -> Floats:
    """The frame numbers at which the motion of a bone is sampled: ``frames``, keyframes within their range, and some in between."""
    assert bone.motion is not None  # called for moving bones only
    stops = sorted({*map(float, frames), *(one for one in bone.motion.frames if frames[0] <= one <= frames[-1])})
    return np.interp(np.linspace(0, len(stops) - 1, _BETWEEN * (len(stops) - 1) + 1), np.arange(len(stops)), stops)


def explained(case: MusclesCase, rest: MusclesSetup) -> tuple[Decision, ...]:
    """The decision on each effect. An effect on all muscles is needed if any muscle needs it; contact if two come close."""
    found = [decisions(part, one) for part, one in zip(case.parts, rest.muscles.values(), strict=True)]
    every: list[Decision] = []
    for effect in case.effects:
        if isinstance(effect, MuscleContact):
            every.append(_touches(case, rest, effect))
            continue
        asked = [one for some in found for one in some if one.effect is effect]
        owner = next((one.name for one in case.muscle if any(effect is some for some in one.effect)), "")
        every.append(replace(next((one for one in asked if one.needed), asked[0]), of=owner))
    return tuple(every)


def _touches(case: MusclesCase, rest: MusclesSetup, effect: MuscleContact) -> Decision:
    """The decision on contact between muscles, from the smallest clearance between two of them."""
    known = estimates(case.parts[0], next(iter(rest.muscles.values())))
    gaps = _gaps(case, rest.muscles, effect.smoothing)
    nearest = min(gaps, key=lambda pair: gaps[pair])
    depth = max(effect.smoothing - gaps[nearest], 0.0)
    rule = f"guaranteed clearance between muscles [mm] ({' and '.join(nearest)})"
    found = decision(effect, Indicator(rule, gaps[nearest], depth, effect.stiffness * depth), known)
    return replace(found, listed=case.choice == "listed")


def needed(case: MusclesCase, found: tuple[Decision, ...]) -> MusclesCase:
    """A copy of the case with only the effects, on all muscles or on one, that are needed according to the decisions ``found``."""
    kept: list[Any] = [one.effect for one in found if one.needed]
    own = tuple(
        one.model_copy(
            update={"effect": tuple(effect for effect in one.effect if any(effect is some for some in kept))}
        )
        for one in case.muscle
    )
    shared = tuple(effect for effect in case.effect if any(effect is some for some in kept))
    return case.model_copy(update={"choice": "listed", "effect": shared, "muscle": own, "decisions": found})
