"""Checks of states that a solver calls converged, from recorded positions and forces, independent of the solver's iterations."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from itertools import chain, pairwise

import numpy as np

from fem_reference.effects import in_situ, touching
from fem_reference.foundations.mesh import Floats, Surface, boundary, diagonal, place_of, vertex_areas
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.geometry.distance import distances, flattened
from fem_reference.geometry.penetrations import Depths, depths
from fem_reference.geometry.signed_distance import Grid
from fem_reference.geometry.skins import spacing
from fem_reference.problems.body import Body
from fem_reference.problems.checks import SAME
from fem_reference.problems.loads import external_load
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.overlaps import BETWEEN, longest_edge, overlap_at, through_itself, unseen
from fem_reference.problems.setup import AttachedVertices, Bone
from fem_reference.runs.contents import scalar_vectors, vector_names
from fem_reference.runs.store import Run

# The accuracy of positions as a fraction of the size of the body; the rounding of stored values is a thousandth of this.
ROUNDING = 1e-9
# The error of exactly attached vertices may be this strain (a stretch of 4) times their distance from the attached facets.
_STRAIN = 3.0
# Safety factor on the mean extension of springs from the recorded force: the extension is computed at vertices, not at springs.
_SPRINGS = 1.5
# The maximum rotation of a bone per load step, on average between two frames; beyond it the sense of rotation is unknown.
_TURN = 1.01 * math.pi / 2
# The penetration of a crease between contact points, as a fraction of the spacing; right-angled edges penetrate more (``BETWEEN``).
_CREASE = 0.1
# The penetration that self-contact of a part allows, for any recorded pressure, is less than this fraction of the spacing.
_OWN = 0.5
# A bone that penetrates by more than this fraction of half its thickness has broken through contact, whatever the stiffness.
_GIVEN_WAY = 0.75
# The maximum imbalance of forces, as a multiple of the residual of all unknowns together.
BALANCE = 10.0


@dataclass(frozen=True)
class RunCheck:
    """The check ``name``: the ``value`` at a ``frame`` and ``place``, and the maximum ``allowed`` value, both in ``unit``."""

    name: str
    value: float
    allowed: float
    unit: str
    frame: float
    place: str = ""

    @property
    def met(self) -> bool:
        """True if the value is allowed; False for a value that is not a number."""
        return self.value <= self.allowed

    @property
    def share(self) -> float:
        """The ratio of the value to the allowed value; infinite if either is not a number; huge if 0 is allowed and exceeded."""
        return math.inf if math.isnan(share := self.value / (self.allowed or 1e-300)) else share

    def __str__(self) -> str:
        value, allowed = ("not a number" if one is None else f"{one:.3g}" for one in (self.value, self.allowed))
        where = f" at {self.place}" if self.place else ""
        return f"{self.name}: {value}{self.unit and f' {self.unit}'} in frame {self.frame:g}{where}, allowed {allowed}"


RunChecks = tuple[RunCheck, ...]
# A function from a frame number to positions (n, 3) [mm], None if they are unknown.
Nodes = Callable[[int], Floats | None]


def of_body(body: Body, solved: Run) -> RunChecks:
    """Check that all states exist, are finite and have the prescribed positions, and that parts that may touch do not cross."""
    numbers, points = tuple(state.number for state in solved.states), [state.points for state in solved.states]
    found = (_complete(body.frames, numbers), _finite(numbers, points))
    if not all(one.met for one in found):
        return found
    return (*found, *worst(chain(_prescribed(body, solved), _overlaps(body, solved))))


def _prescribed(body: Body, solved: Run) -> Iterator[RunCheck]:
    begun = body.start is not None  # if so, the first state is prescribed
    for state in solved.states[1:] if begun else solved.states:
        for entry in body.prescribed:
            if entry.stiffness is None and isinstance(entry.on, str):
                nodes = np.unique(body.mesh.facets[entry.on])
                rest, along = body.mesh.points[nodes], list(entry.components)
                wanted = entry.displacements(rest, state.number)
                off = np.abs((state.points[nodes] - rest - wanted)[:, along]).max(axis=1)
                # The prescriptions of two regions may differ by this amount where the regions meet.
                allowed = SAME * (body.size + float(np.abs(wanted).max()))
                yield _at(f"prescribed at {entry.name}", off, np.full(len(off), allowed), state.number, rest)


def _overlaps(body: Body, solved: Run) -> Iterator[RunCheck]:
    """Overlap of parts that may touch; overlap at rest or due to smoothing, compliance or gaps between points is allowed."""
    for law in body.touching:
        edge, between, depth = longest_edge(body.mesh, law), unseen(body.mesh, law), partial(overlap_at, body.mesh, law)
        at_rest = depth(body.mesh.points) if law.relaxed else 0.0
        for state in solved.states:
            pressure = state.scalars.get(law.pressure_name, state.scalars.get("touching_pressure", 0.0))
            most = _OWN / 2 * edge if law.one == law.other else np.inf
            give = np.min([pressure / law.stiffness, state.scalars.get("touching_depth", np.inf), most])
            given = law.smoothing + float(give) + between + law.allowance(state.number) * at_rest
            yield RunCheck(f"{law.one} in {law.other}", depth(state.points), given, "mm", state.number)


def of_muscle(problem: MuscleProblem, run: Run, nodes: Nodes = lambda _: None) -> RunChecks:
    """Check that all frames exist in order and are finite, that attachments are on their bones, that load steps are small enough,
    that forces balance, and that the surface crosses neither a bone nor itself. ``nodes``: the points of the tetrahedra, if known.
    """
    fibres = [] if run.fibre_positions is None else [run.fibre_positions]
    arrays = [np.concatenate([array[i] for array in (run.positions, *fibres)]) for i in range(len(run.numbers))]
    found = (_complete(problem.frames, run.numbers), _finite(run.numbers, arrays))
    if not all(one.met for one in found):
        return found
    if problem.start is not None:  # if so, the first state is prescribed
        scalars = {name: values[1:] for name, values in run.scalars.items()}
        run = replace(run, numbers=run.numbers[1:], positions=run.positions[1:], scalars=scalars)
    attached = chain.from_iterable(_attached(problem, run, entry) for entry in problem.attached)
    crossed = chain(_depths(problem, run, nodes), _creases(problem, run))
    return (*found, *worst(chain(attached, _steps(problem, run), _balance(problem, run), crossed)))


def worst(checks: Iterable[RunCheck]) -> RunChecks:
    """The check of each name that is nearest to its allowed value, or exceeds it most."""
    found = dict[str, RunCheck]()
    for one in checks:
        if one.name not in found or one.share > found[one.name].share:
            found[one.name] = one
    return tuple(found.values())


@lru_cache(maxsize=8)
def _areas(surface: Surface) -> Floats:
    return vertex_areas(surface.points, surface.triangles)


def _at(name: str, values: Floats, allowed: Floats, frame: float, places: Floats) -> RunCheck:
    """The check at the point (n, 3) whose ``values`` (n,) [mm] are nearest to ``allowed`` (n,), or exceed it most."""
    i = int(np.argmax(values / allowed))
    return RunCheck(name, float(values[i]), float(allowed[i]), "mm", frame, place_of(places[i]))


def _complete(wanted: tuple[float, ...], numbers: tuple[float, ...]) -> RunCheck:
    """The number of missing or misplaced frames."""
    lost = sum(one != other for one, other in zip(wanted, numbers, strict=False)) + abs(len(wanted) - len(numbers))
    first = next((one for one, other in zip(wanted, numbers, strict=False) if one != other), wanted[-1])
    return RunCheck("frames that are missing or out of order", float(lost), 0.0, "", first)


def _finite(numbers: tuple[float, ...], arrays: list[Floats]) -> RunCheck:
    """The number of positions that are not finite."""
    lost = [0 if np.isfinite(array).all() else int((~np.isfinite(array)).any(axis=1).sum()) for array in arrays]
    frame = numbers[int(np.argmax(np.array(lost) > 0))] if lost else 0
    return RunCheck("positions that are not finite", float(sum(lost)), 0.0, "", frame)


def _attached(problem: MuscleProblem, run: Run, entry: AttachedVertices) -> Iterator[RunCheck]:
    """The distance of exactly attached vertices from their positions on the bone; the limit is a strain times their distance from
    the attached facets. For springs, the mean extension; the limit follows from the force (with ``in_situ``, plus the force at
    rest), divided by stiffness and area.
    """
    rest, skin = problem.surface.points[entry.vertices], problem.attached_skins.get(entry.attachment)
    facets = Surface(problem.mesh.points, problem.mesh.facets[entry.attachment])
    facets_away = cache(lambda: distances(rest, facets).distance)
    weights = _areas(problem.surface)[entry.vertices]
    size, forces = diagonal(problem.surface.points), run.scalars.get(f"force_{entry.attachment}")
    at_rest = 0.0 if forces is None or in_situ.among(problem.effects) is None else float(forces[0])
    for i, number in enumerate(run.numbers):
        away = run.positions[i][entry.vertices] - apply(entry.bone.pose(number), rest)
        if entry.stiffness is None:
            off, allowed = np.linalg.norm(away, axis=1), ROUNDING * size + _STRAIN * facets_away()
            places = run.positions[i][entry.vertices]
            yield _at(f"{entry.attachment} away from {entry.bone.name}", off, allowed, number, places)
        elif forces is not None and skin is not None:
            mean = float(np.linalg.norm(weights @ away) / weights.sum())
            yielded = (float(forces[i]) + at_rest) / (entry.stiffness * float(skin.areas.sum()))
            name, most = f"mean extension of springs of {entry.attachment}", _SPRINGS * yielded + 1e-4 * size
            yield RunCheck(name, mean, most, "mm", number)


def _steps(problem: MuscleProblem, run: Run) -> Iterator[RunCheck]:
    """The rotation or travel of a bone per load step, on average between two frames; frames that needed no step are skipped."""
    counts = run.scalars.get("load_steps", np.full(len(run.numbers), np.nan))
    contact, attached = problem.contact, {entry.bone.name for entry in problem.attached}
    bones = [bone for bone in problem.bones if bone.name in attached or (contact and contact.is_by(bone.name))]
    alike, farthest = len({bone.motion for bone in bones}) == 1, 1.01 * diagonal(run.surface.points)
    for i, (before, number) in enumerate(pairwise(run.numbers), start=1):
        for bone in bones if counts[i] > 0 else ():
            turns = bone.motion is not None and bone.motion.centre is not None
            if bone.motion is None or (alike and not turns):
                continue
            travelled = _travel(bone.motion, before, number) / float(counts[i])
            word, allowed, unit = ("rotation", _TURN, "rad") if turns else ("travel", farthest, "mm")
            yield RunCheck(f"{word} of {bone.name} per load step", travelled, allowed, unit, number)


def _travel(motion: RigidMotion, before: float, after: float) -> float:
    """The travel [rad or mm] of a bone between two frames; if it moves out and back, both directions count."""
    stops = [before, *(frame for frame in motion.frames if before < frame < after), after]
    return float(np.abs(np.diff(np.interp(stops, motion.frames, motion.amounts))).sum())


def _balance(problem: MuscleProblem, run: Run) -> Iterator[RunCheck]:
    """The sums of the forces and of the moments that bones exert on the muscle, by attachments and contact. They should be 0
    without external loads, otherwise in balance with the loads. A user's own effects may be loads, so with them there is no check.
    """
    residual = BALANCE * run.origin.get("settings", {}).get("residual", math.nan)
    allowed = residual * math.sqrt(run.outcome.cost.get("unknowns", math.nan))
    own = all(type(one).__module__.startswith("fem_reference.effects.") for one in problem.effects)
    outer = any(one.outer for one in problem.effects)
    kinds = (("force", "N", 1.0), ("moment", "N mm", float(np.abs(run.positions).max())))
    for kind, unit, arm in kinds if own and math.isfinite(allowed) else ():
        for i, value in enumerate(() if outer else run.scalars.get(f"net_{kind}", ())):
            yield RunCheck(f"residual {kind}", float(value), allowed * arm, unit, run.numbers[i])
        carriers = vector_names(run.scalars, f"{kind}_on_")  # bones, and muscles that may touch this muscle
        carried = np.sum([getattr(run, kind)(name) for name in carriers], axis=0)
        for i, load in _loads(problem, run, kind) if outer and carriers else ():
            off, rounding = (float(np.linalg.norm(one)) for one in (carried[i] - load, ROUNDING * load))
            yield RunCheck(f"{kind}s that bones do not carry", off, allowed * arm + rounding, unit, run.numbers[i])


def _loads(problem: MuscleProblem, run: Run, kind: str) -> Iterator[tuple[int, Floats]]:
    """Frame index and sum (3,) of external loads: as recorded, or computed for forces that do not depend on the deformation."""
    if f"load_{kind}_x" in run.scalars:
        yield from enumerate(scalar_vectors(run.scalars, "load_", kind))
    for i, number in enumerate(run.numbers if kind == "force" else ()):
        if (load := external_load(problem, number)) is not None:
            yield i, load.force


def _states(run: Run, bones: Sequence[Bone]) -> Iterator[tuple[int, int]]:
    """Index and number of each frame in which muscle and ``bones`` are not where they were at rest or in an earlier frame."""
    seen, near = [(np.array([np.eye(4) for _ in bones]), run.surface.points)], ROUNDING * diagonal(run.surface.points)
    for i, number in enumerate(run.numbers):
        poses, points = np.array([bone.pose(number) for bone in bones]), run.positions[i]
        posed = (one for earlier, one in seen if np.abs(poses - earlier).max(initial=0.0) <= near)
        alike = (one for one in posed if np.abs(points[:9] - one[:9]).max() <= near)  # full comparisons are rare
        if not any(np.abs(points - one).max() <= near for one in alike):
            seen.append((poses, points))
            yield i, number


def _depths(problem: MuscleProblem, run: Run, nodes: Nodes) -> Iterator[RunCheck]:
    """The penetration of the muscle and each bone in contact. If the surface, whose triangles may be large, penetrates too deeply,
    the boundary of the tetrahedra is checked too; the check fails only if both penetrate too deeply.
    """
    rest, apart = run.surface, spacing(problem.surface)
    skin = cache(lambda: Surface(problem.mesh.points, boundary(problem.mesh.tets)[0]))
    pressures = np.nan_to_num(run.scalars.get("contact_pressure", np.zeros(len(run.numbers))))
    for i, number in _states(run, problem.obstacles):
        muscle = run.surface.moved_to(run.positions[i])
        for bone in problem.obstacles:
            pressure = float(pressures[i])
            check_of = partial(_deep, bone, number, give(problem, bone, pressure, apart), pressed=pressure > 0)
            check = check_of(muscle, rest)
            if not check.met and (now := nodes(number)) is not None:
                check = min(check, check_of(skin().moved_to(now), skin()), key=lambda one: one.share)
            yield check


def _deep(bone: Bone, number: int, give: float, muscle: Surface, rest: Surface, *, pressed: bool) -> RunCheck:
    """The overlap of bone and muscle. Above ``give``, only the excess over rest counts; deep inside the bone the check fails."""
    found = depths(muscle, bone.surface, bone.shape, bone.pose(number))
    half, (deepest, place) = bone.shape.half_thickness, found.deepest()
    if deepest > give:
        deepest, place = found.deepest(_at_rest(rest, bone))
        give += flattened(muscle, place) / half if pressed else 0.0
    allowed = min(give, _GIVEN_WAY * half)
    return _at(f"{bone.name} in the muscle", np.array([deepest]), np.array([allowed]), number, place[None])


@lru_cache(maxsize=8)
def _at_rest(muscle: Surface, bone: Bone) -> Depths:
    return depths(muscle, bone.surface, bone.shape, np.eye(4))


def give(problem: MuscleProblem, bone: Bone, pressure: float, apart: float) -> float:
    """The allowed penetration [mm] under a ``pressure`` [MPa], with contact points at a spacing of ``apart / 2`` [mm]."""
    assert problem.contact is not None  # called only with contact
    known = bone.shape.error if isinstance(bone.shape, Grid) else 0.0
    return pressure / problem.contact.stiffness + known + BETWEEN * apart


def _creases(problem: MuscleProblem, run: Run) -> Iterator[RunCheck]:
    """The self-penetration of the muscle's surface in excess of that at rest. Penetration that self-contact allows is accepted."""
    surface, law, none = run.surface, touching.among(problem.effects), np.zeros(len(run.numbers))
    pressure = np.nan_to_num(run.scalars.get("touching_pressure", none)) / (law.stiffness if law else np.inf)
    most = _OWN * (apart := spacing(surface))
    gives = np.minimum(pressure, np.nan_to_num(run.scalars.get("touching_depth", none + most)).clip(max=most))
    gives += _CREASE * apart
    for i, number in _states(run, ()):
        depth, place = through_itself(surface.moved_to(run.positions[i]), surface)
        yield _at("self-penetration of the muscle", np.array([depth]), gives[[i]], number, place[None])
