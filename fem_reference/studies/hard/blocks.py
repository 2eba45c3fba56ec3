"""Problems of blocks: axis-aligned lattices of tetrahedra, whose boundary is the surface that solvers receive."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from fem_reference import effects
from fem_reference.effects.contact import among
from fem_reference.effects.touching import MuscleContact
from fem_reference.effects.touching import among as touching_among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh, tet_volumes
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import join
from fem_reference.geometry.block import kuhn, lattice_skin
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.geometry.skins import spacing
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems.contact import check_exempt
from fem_reference.problems.muscle import MuscleProblem, assembled, closed_form
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.problems.paths import Along
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.studies.hard.records import FACES, FIRST, Face, Hard, Hold, Lattice, Start

# The default material of blocks: the usual matrix material of muscle.
MATERIAL = (effects.make("neo_hooke", mu="10 kPa"), effects.make("incompressible", bulk="10 MPa"))
_LINES, _POINTS = 4, 9  # the number of measured lines in each block, and of points on each line
# The bones of attached faces are spheres far from the block; their radius and distance are relative to the size of the block.
_BALL, _AWAY = 0.01, 50.0
_SAME = 1e-9  # the maximum rounding difference between equal motions of two attachments, relative to the block's size


def problem(hard: Hard) -> MuscleProblem:
    """The problem of the block of ``hard``."""
    block, frames, acting = hard.block, hard.frames, hard.effect or MATERIAL
    assert block is not None  # a Hard record with a block has frames
    assert frames is not None
    nodes, tets = kuhn(block.cells)
    points = _placed(block, nodes)
    skin_nodes, triangles = lattice_skin(block.cells)
    index: Ints = np.ravel_multi_index(tuple(skin_nodes.T), tuple(np.add(block.cells, 1)))
    surface = Surface(points[index], triangles, f"the block of {hard.name}")
    ends = [_held(block, hold, skin_nodes, surface) for hold in hard.hold]
    _check_held(hard, ends, surface)
    others = (closed_form(bone, surface, join(hard.place, f"bone[{i}]")) for i, bone in enumerate(hard.bone))
    bones = (*(end.bone for end in ends), *others)
    size = np.asarray(block.size)
    middle, cell = np.asarray(block.corner) + size / 2, float((size / block.cells).min())
    start = Moved(hard.start, middle, cell) if hard.start else None
    setup = Setup(surface, bones, tuple(ends), frames.numbers, frames.interval, start=start)
    on_faces = {face: np.isin(triangles, _on(block, skin_nodes, face)).all(axis=1) for face in FACES}
    facets: dict[str, Ints] = {face: index[triangles[some]] for face, some in on_faces.items()}
    for end, hold in zip(ends, hard.hold, strict=True):
        if hold.middle:
            facets[end.attachment] = index[triangles[np.isin(triangles, end.vertices).any(axis=1)]]
    if not tet_volumes(points, tets).min() > 0:
        raise InputError("block.jitter", "a tetrahedron turned inside out", "a smaller jitter")
    return _filled(block, setup, TetMesh(points, tets, facets, maker="lattice"), acting)


def several(hard: Hard) -> MusclesProblem:
    """The problem of the block and the further bodies of ``hard``. Contact acts between any two of them if ``hard`` has the
    effect "touching".
    """
    law, apart = touching_among(hard.effect), dict[str, MuscleProblem]()
    parts = {FIRST: hard}
    for one in hard.beside:
        own = {"block": one.block, "hold": one.hold, "effect": one.effect or hard.effect}
        parts[one.name] = hard.model_copy(update=own)
    for name, part in parts.items():
        acting = tuple(effect for effect in part.effect if not isinstance(effect, MuscleContact))
        apart[name] = _named(name, problem(part.model_copy(update={"effect": acting})))
    # Each block has all bones, like the muscles of a scene.
    held = tuple(entry.bone for one in apart.values() for entry in one.attached)
    bones = (*held, *next(iter(apart.values())).bones[len(hard.hold) :])
    pairs = tuple(combinations(apart, 2)) if law else ()
    return MusclesProblem({name: replace(one, bones=bones) for name, one in apart.items()}, pairs, law, apart=True)


def _named(name: str, one: MuscleProblem) -> MuscleProblem:
    """The problem ``one``, with ``name`` as a prefix to the names of the bones of its attachments."""
    held = (replace(entry, bone=replace(entry.bone, name=f"{name}: {entry.bone.name}")) for entry in one.attached)
    return replace(one, attached=tuple(held))


@dataclass(frozen=True, eq=False)
class Moved:
    """The map from rest to the state that ``start`` describes, for a block with the centre ``middle`` (3,) [mm] and cells of size
    ``cell`` [mm].
    """

    start: Start
    middle: Floats
    cell: float

    def __call__(self, points: Floats) -> Floats:
        """The positions (n, 3) [mm] of ``points`` at rest. The random displacement of a point does not depend on the others."""
        match self.start.kind:
            case "point":
                return np.broadcast_to(self.middle, points.shape).copy()
            case "plane":
                return np.asarray(np.where([True, True, False], points, self.middle))
            case "inside out":
                return np.asarray(self.middle + (points - self.middle) * [1, 1, -1])
        seeds = np.round((points - self.middle) / self.cell * 1e6).astype(np.int64) @ [1, 7919, 104729]
        moves = np.array([np.random.default_rng(abs(seed)).uniform(-1, 1, 3) for seed in seeds])
        return np.asarray(points + self.start.amount * self.cell * moves.reshape(-1, 3))


def _filled(block: Lattice, setup: Setup, mesh: TetMesh, acting: tuple[effects.Effect, ...]) -> MuscleProblem:
    if among(acting) is not None:
        check_exempt(setup.exempt, "hold")
    x, y, z = (np.asarray(block.fibre) / np.linalg.norm(block.fibre)).tolist()
    fibre = Along((x, y, z)) if any("fibre" in effect.needs for effect in acting) else None
    return assembled(setup, mesh, acting, (_lines(block), fibre), block.points_apart or spacing(setup.surface))


def _placed(block: Lattice, nodes: Ints) -> Floats:
    """Positions [mm] of the lattice's ``nodes`` (n, 3); the last cell along an axis is ``grading`` times as long as the first."""
    shares = np.empty(nodes.shape)
    for k, (count, ratio) in enumerate(zip(block.cells, block.grading, strict=True)):
        lengths = ratio ** (np.arange(count) / max(count - 1, 1))
        shares[:, k] = np.concatenate([[0.0], np.cumsum(lengths) / lengths.sum()])[nodes[:, k]]
    if block.jitter:
        random = np.random.default_rng(block.seed).uniform(-1, 1, shares.shape) * block.jitter / np.array(block.cells)
        random[(nodes == 0) | (nodes == block.cells)] = 0  # faces stay flat, edges straight, and corners in place
        shares += random
    around = shares if block.rounding == 0 else (1 + _rounded(2 * shares - 1, block.rounding)) / 2
    return np.asarray(np.asarray(block.corner) + around * np.asarray(block.size))


def _rounded(unit: Floats, share: float) -> Floats:
    """Move points ``unit`` (n, 3) of the cube from -1 to 1 by the fraction ``share`` of the way to their images in the unit ball.

    The image of a coordinate x is ``x (1 - y^2/2 - z^2/2 + y^2 z^2/3)^(1/2)``, where y and z are the other two coordinates. This
    maps the surface of the cube onto the unit sphere.
    """
    y, z = (np.roll(unit, -turn, axis=1) ** 2 for turn in (1, 2))
    return np.asarray(unit * (1 - share + share * np.sqrt(1 - y / 2 - z / 2 + y * z / 3)))


def _on(block: Lattice, nodes: Ints, face: Face) -> Ints:
    """Indices (k,) of those ``nodes`` (n, 3) of the lattice that lie on a ``face``."""
    axis = "xyz".index(face[0])
    return np.flatnonzero(nodes[:, axis] == (block.cells[axis] if face[1] == "1" else 0))


def _held(block: Lattice, hold: Hold, nodes: Ints, surface: Surface) -> AttachedVertices:
    axis, largest = "xyz".index(hold.face[0]), max(block.size)
    vertices = _on(block, nodes, hold.face)
    if hold.middle:
        off = np.abs(nodes[vertices] - np.asarray(block.cells) / 2)
        off[:, axis] = 0
        vertices = vertices[[np.argmin(off.sum(axis=1))]]
    centre = surface.points.mean(axis=0)
    centre[axis] += (1 if hold.face[1] == "1" else -1) * _AWAY * largest
    x, y, z = centre.tolist()
    ball = Sphere((x, y, z), _BALL * largest)
    motion = hold.motion.poses() if hold.motion else None
    bone = Bone(f"bone of {hold.face}", tessellated(ball, surface.points, "hold"), motion, solid=ball)
    return AttachedVertices(hold.face, bone, vertices, hold.stiffness)


def _check_held(hard: Hard, ends: list[AttachedVertices], surface: Surface) -> None:
    """Raise InputError if two attachments move shared vertices to different positions: most solvers would obey only one of them."""
    assert hard.frames is not None  # a block has frames
    keyframes = (key.frame for hold in hard.hold if hold.motion for key in hold.motion.keyframes)
    frames = sorted({*hard.frames.numbers, *keyframes})
    for (_, one), (j, other) in combinations(enumerate(ends), 2):
        both = np.intersect1d(one.vertices, other.vertices)
        shared = surface.points[both]
        off = [np.ptp([apply(end.bone.pose(frame), shared) for end in (one, other)], axis=0) for frame in frames]
        if not np.max(off, initial=0.0) <= _SAME * max(hard.block.size if hard.block else (1.0,)):
            got = f"{other.attachment}, which shares {len(both)} vertices with {one.attachment} and moves differently"
            raise InputError(join(hard.place, f"hold[{j}].face"), got, "no common edge, or the same motion")


def _lines(block: Lattice) -> Polylines:
    """Straight lines through the block, along the axis nearest to its fibres."""
    axis = int(np.argmax(np.abs(block.fibre)))
    shares = np.empty((_LINES, _POINTS, 3))
    shares[:, :, axis] = np.linspace(0.05, 0.95, _POINTS)
    shares[:, :, (axis + 1) % 3] = np.array([0.3, 0.3, 0.7, 0.7])[:, None]
    shares[:, :, (axis + 2) % 3] = np.array([0.3, 0.7, 0.3, 0.7])[:, None]
    points = np.asarray(block.corner) + shares.reshape(-1, 3) * np.asarray(block.size)
    return Polylines(points, np.arange(0, _LINES * _POINTS + 1, _POINTS))
