"""Quantities that show whether a run is stable: values for each frame, with the worst point."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from fem_reference.assessment.stress import History
from fem_reference.foundations.mesh import Floats, Surface, TetMesh, diagonal, enclosed_volume, tet_volumes
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import outer_windings
from fem_reference.geometry.interpenetration import penetration as depth_of
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.problems.joining import Span
from fem_reference.problems.overlaps import through_itself
from fem_reference.problems.setup import Bone


@dataclass(frozen=True, eq=False)
class Followed:
    """A run whose health is measured.

    ``surface``: the surface at rest. ``positions`` (f, n, 3) [mm]: the positions of its vertices at frame ``numbers``. ``mesh`` and
    ``nodes`` (f, k, 3) [mm]: for a solver with tetrahedra, the mesh at rest and the positions of its nodes. ``bones``: the bones
    with which ``free`` (n,) vertices may be in contact. ``truth`` (f, n, 3) [mm]: the positions of the same vertices in the
    reference. ``integrated`` (f,), or (f, b) for several bodies: V/V0 from the solver. ``negative_modes`` (f,): the number of
    negative modes. ``material_modes`` (f,): the number of those that are certainly due to the material. ``least_determinant`` (f,):
    the smallest det F. ``values`` (f, N) and ``range``: the values of a scalar field, and the range of its boundary values.
    ``spans``: the slices of the arrays that belong to each of several bodies. Data that are not known are None.
    """

    numbers: tuple[int, ...]
    surface: Surface
    positions: Floats
    mesh: TetMesh | None = None
    nodes: Floats | None = None
    bones: tuple[Bone, ...] = ()
    free: NDArray[np.bool_] | None = None
    truth: Floats | None = None
    integrated: Floats | None = None
    negative_modes: Floats | None = None
    material_modes: Floats | None = None
    least_determinant: Floats | None = None
    values: Floats | None = None
    range: tuple[float, float] = (0.0, 0.0)
    spans: tuple[Span, ...] = ()

    @cached_property
    def bodies(self) -> "tuple[Followed, ...]":
        """The run of each body; the run itself if there is only one body."""
        return tuple(self._of(i, span) for i, span in enumerate(self.spans)) or (self,)

    def _of(self, i: int, span: Span) -> "Followed":
        """The run of body ``i`` alone, with the surface, the tetrahedra and the volume in its ``span``."""
        integrated = None if self.integrated is None else self.integrated[:, i]
        triangles, mesh, nodes = self.surface.triangles - span.vertices.start, self.mesh, self.nodes
        own = ((triangles >= 0) & (triangles < span.vertices.stop - span.vertices.start)).all(axis=1)
        if mesh is not None and nodes is not None:
            mesh = replace(
                mesh, points=mesh.points[span.points], tets=mesh.tets[span.cells] - span.points.start, facets={}
            )
            nodes = nodes[:, span.points]
        surface = Surface(self.surface.points[span.vertices], triangles[own])
        return Followed(self.numbers, surface, self.positions[:, span.vertices], mesh, nodes, integrated=integrated)

    @property
    def size(self) -> float:
        """The diagonal of the body at rest [mm]."""
        return diagonal(self.surface.points)


_LOOKS = 33  # the number of sampled positions of a vertex on its path from one frame to the next

# Values (f,) of a quantity, and the worst point in each frame: in words (f,), and its position (f, 3). The last two are None if
# there is no worst point.
Found = tuple[Floats, list[str] | None, Floats | None]


def volume(run: Followed) -> Found:
    """The change of the enclosed volume, in per cent of the volume at rest; for several bodies the maximum change."""
    if run.spans:
        changes = np.array([volume(one)[0] for one in run.bodies])
        return np.max(changes, axis=0), None, None
    if run.integrated is not None:
        return 100 * np.abs(run.integrated - 1), None, None
    triangles, whole = run.surface.triangles, enclosed_volume(run.surface.points, run.surface.triangles)
    now = np.array([enclosed_volume(points, triangles) for points in run.positions])
    return 100 * np.abs(now / whole - 1), None, None


def inside_out(run: Followed) -> Found:
    """The inverted fraction of the body [%].

    For a body with tetrahedra it is the fraction of the volume at rest, otherwise the fraction of the triangles of the surface. For
    curved elements, whose corners do not show inversion, it is 0 or 100 according to the smallest det F.
    """
    if run.least_determinant is not None:
        words = [f"det F is at least {value:.2g}" for value in run.least_determinant]
        return np.where(run.least_determinant > 0, 0.0, 100.0), words, None
    if run.mesh is not None and run.nodes is not None:
        rest = tet_volumes(run.mesh.points, run.mesh.tets)
        ratios = np.array([tet_volumes(nodes, run.mesh.tets) for nodes in run.nodes]) / rest
        worst = np.argmin(np.where(np.isnan(ratios), -np.inf, ratios), axis=1)
        share = 100 * np.where(ratios > 0, 0.0, rest).sum(axis=1) / rest.sum()
        frames = np.arange(len(ratios))
        words = [f"V/V0 is {ratios[i, k]:.2g} in tetrahedron {k}" for i, k in enumerate(worst)]
        return share, words, run.nodes[frames[:, None], run.mesh.tets[worst]].mean(axis=1)
    shares, points = [], []
    for positions in run.positions:
        moved = run.surface.moved_to(positions)
        windings = outer_windings(moved)
        shares.append(np.nan if np.isnan(windings).all() else 100 * float(np.mean(~(windings >= 0))))
        points.append(positions[moved.triangles[np.argmin(np.nan_to_num(windings, nan=-np.inf))]].mean(axis=0))
    return np.array(shares), None, np.array(points)


def from_rest(run: Followed) -> Found:
    """The maximum distance of a vertex from its position at rest, in per cent of the size of the body."""
    return _off(run, np.broadcast_to(run.surface.points, run.positions.shape))


def from_first(run: Followed) -> Found:
    """The maximum distance of a vertex from its position in a rigid motion with the first bone, in per cent of the body's size."""
    poses = [run.bones[0].pose(number) for number in run.numbers]
    return _off(run, np.array([apply(pose, run.surface.points) for pose in poses]))


def from_reference(run: Followed) -> Found:
    """The maximum distance of a vertex from its position in the reference, in per cent of the body's size; NaN if unknown."""
    return _off(run, np.full(run.positions.shape, np.nan) if run.truth is None else run.truth)


def stretch(run: Followed) -> Found:
    """The maximum stretch of an edge of the surface, relative to rest."""
    edges = np.unique(np.sort(run.surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    states = np.concatenate([run.surface.points[None], run.positions])
    rest, *lengths = np.linalg.norm(states[:, edges[:, 1]] - states[:, edges[:, 0]], axis=2)
    ratios = np.array(lengths) / rest
    worst = np.argmax(np.where(np.isnan(ratios), np.inf, ratios), axis=1)
    frames = np.arange(len(ratios))
    return ratios[frames, worst], None, run.positions[frames[:, None], edges[worst]].mean(axis=1)


def penetration(run: Followed) -> Found:
    """The maximum depth of a free vertex inside a bone, in per cent of the size of the body."""
    depths = np.zeros(run.positions.shape[:2])
    for bone in run.bones:
        for i, (number, points) in enumerate(zip(run.numbers, run.positions, strict=True)):
            depths[i] = np.maximum(depths[i], -bone.distances(number, points))
    return _deepest(run, depths)


def passed(run: Followed) -> Found:
    """The maximum depth inside a bone that a free vertex reaches on its path from the previous frame, in per cent of the body's
    size. The path is straight, relative to the bone. This detects a bone that crosses the body and is outside it in both frames.
    """
    depths = np.zeros(run.positions.shape[:2])
    for bone in run.bones:
        seen = [
            apply(np.linalg.inv(bone.pose(number)), points)
            for number, points in zip(run.numbers, run.positions, strict=True)
        ]
        for i, (before, after) in enumerate(pairwise(seen)):
            for share in np.linspace(0, 1, _LOOKS):
                depth = -bone.shape.sample(before + share * (after - before)).distance
                depths[i + 1] = np.maximum(depths[i + 1], depth)
    return _deepest(run, depths)


def _deepest(run: Followed, depths: Floats) -> Found:
    """The maximum of the ``depths`` (f, n) [mm] of free vertices, in per cent of the size of the body."""
    return _worst(run, 100 * np.where(True if run.free is None else run.free, depths, 0.0) / run.size)


def pierced(run: Followed) -> Found:
    """The maximum depth of a vertex of a bone inside the body, in per cent of the size of the body. This detects thin bones, which
    fit between the vertices of the body.
    """
    values, places = np.zeros(len(run.numbers)), np.tile(run.surface.points[0], (len(run.numbers), 1))
    for i, (number, points) in enumerate(zip(run.numbers, run.positions, strict=True)):
        body = run.surface.moved_to(points)
        for bone in run.bones:
            there = apply(bone.pose(number), bone.surface.points)
            near = there[((there >= points.min(axis=0)) & (there <= points.max(axis=0))).all(axis=1)]
            depth = -signed_distances(near, body) if len(near) and np.isfinite(points).all() else np.zeros(0)
            if len(depth) and depth.max() > values[i]:
                values[i], places[i] = depth.max(), near[np.argmax(depth)]
    return 100 * values / run.size, None, places


def crossed(run: Followed) -> Found:
    """The maximum depth to which bodies, or parts of one body, penetrate each other, in per cent of the size of the body. The depth
    is 0 if an exact test finds no intersecting triangles. Triangles of a single body that intersect at rest are ignored.
    """
    values, places = np.full(len(run.numbers), np.nan), np.tile(run.surface.points[0], (len(run.numbers), 1))
    for i, finite in enumerate(np.isfinite(run.positions).all(axis=(1, 2))):
        if finite:
            now = [one.surface.moved_to(one.positions[i]) for one in run.bodies]
            found = [through_itself(there, one.surface) for there, one in zip(now, run.bodies, strict=True)]
            found += [depth_of(*pair) for pair in combinations(now, 2)]
            values[i], places[i] = max(found, key=lambda one: one[0])
    return 100 * values / run.size, None, places


def overshoot(run: Followed) -> Found:
    """The maximum distance of the values of a scalar field from the range of its boundary values, in per cent of this range."""
    assert run.values is not None  # only scalar fields have this quantity
    low, high = run.range
    beyond = np.maximum(run.values - high, low - run.values).max(axis=1)
    return 100 * np.maximum(beyond, 0.0) / (high - low), None, None


def _off(run: Followed, wanted: Floats) -> Found:
    with np.errstate(over="ignore", invalid="ignore"):
        return _worst(run, 100 * np.linalg.norm(run.positions - wanted, axis=2) / run.size)


def _worst(run: Followed, each: Floats) -> Found:
    """The maximum over the vertices of the values ``each`` (f, n), for each frame, with the vertex and its position."""
    worst = np.argmax(np.where(np.isnan(each), np.inf, each), axis=1)
    frames = np.arange(len(each))
    return each[frames, worst], [f"at vertex {vertex}" for vertex in worst], run.positions[frames, worst]


_SHAPE = (volume, inside_out, from_rest, from_first, from_reference, stretch)
_CONTACT = (penetration, passed, pierced, crossed)
QUANTITIES: dict[str, Callable[[Followed], Found]] = {one.__name__: one for one in (*_SHAPE, *_CONTACT, overshoot)}


def unstable(run: Followed) -> str:
    """The frames in which a run is in unstable equilibrium, in words; empty without such frames, or if modes were not counted."""
    if run.negative_modes is None or not (run.negative_modes > 0).any():
        return ""
    first, most = int(np.argmax(run.negative_modes > 0)), run.negative_modes.max()
    own = np.nan if run.material_modes is None else np.nanmax(run.material_modes)
    doubt = "" if np.isnan(own) else f", at least {own:.0f} of them due to the material"
    return f"an unstable equilibrium from frame {run.numbers[first]} on, with up to {most:.0f} negative modes{doubt}"


def history(run: Followed, quantity: str) -> History:
    """The history of a ``quantity`` of a run over its frames."""
    values, words, points = QUANTITIES[quantity](run)
    return History(quantity, "" if quantity == "stretch" else "%", run.numbers, values, tuple(words or ()), points)
