"""Muscle surfaces deformed as rigidly as possible (ARAP). Report section 5.5.2; Sorkine and Alexa 2007.

The edges around each vertex form a cell, which is rotated with as little distortion as possible. Frame number n is the state in
which the bones have their pose of frame n; attached vertices move exactly with their bone. Starting from the previous state, the
method alternates between the rotations of all cells (local step) and the positions of the free vertices (global step). If the rows
of attached vertices are removed from the equations and each edge has the same weight at both ends, each step minimises eq. 5.10
over its unknowns, so the energy never rises. This also holds with negative weights, because the matrix is still the positive
definite stiffness matrix of linear elements. Attachments by springs are treated as exact, and there is no contact.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from fem_reference.foundations.mesh import Floats, Ints, Surface, enclosed_volume
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import PositiveLength
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.arap_kernels import VertexCells, energy, fit_rotations, right_side
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow, refused, timed
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.common.state_checks import Trouble

Symmetric = Literal["cotangent", "clamped cotangent", "kirchhoff"]
Weights = Literal[Symmetric, "tutte"]
Fixed = Literal["remove", "ols"]

# A triangle is degenerate if its height is at most this fraction of its longest side.
_NO_AREA = 1e-6


class ArapSettings(Record):
    """Settings of the iteration of local and global steps; every key except ``tolerance`` is required.

    ``weights``: the weights of edges, "cotangent" (eq. 5.13), "clamped cotangent" (negative weights set to 0), "kirchhoff" (all 1)
    or "tutte" (kirchhoff, with each row divided by its diagonal). A cotangent weight is negative if the two angles opposite the
    edge sum to more than pi. With negative weights, as in libigl, rotating a cell by 180 degrees may lower the energy, so the rest
    state may be unstable. ``fixed``: the treatment of attached vertices, "remove" (their rows and columns are removed) or "ols"
    (only their columns are removed, and all rows are solved by least squares, eq. 5.12). With "remove", tutte weights give the same
    states as kirchhoff weights. ``rotations``: fitted before "each" global step, or once per frame ("first only"), in which case
    later iterations change nothing. ``volume_step``: after each global step, the free vertices are scaled by eq. 5.9 about the mean
    of all vertices. ``iterations``: the number per frame, or the maximum if there is a ``tolerance``. ``tolerance`` [mm]:
    iterations end after one in which no vertex moves farther than this; if some frame needs more than ``iterations``, the run ends
    ``out of steps``.
    """

    weights: Weights
    fixed: Fixed
    rotations: Literal["each", "first only"]
    volume_step: bool
    iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10, 30, 100))]
    tolerance: PositiveLength | None = None


def cells_of(surface: Surface, weights: Weights) -> VertexCells:
    """The cells of a closed surface, with the edge ``weights`` that the settings name."""
    matrix = _edge_weights(surface, weights)
    starts, neighbours = matrix.indptr.astype(np.int64), matrix.indices.astype(np.int64)
    return VertexCells(np.array(surface.points), starts, neighbours, matrix.data)  # compiled code needs writable arrays


def laplacian(cells: VertexCells) -> Any:
    """The sparse matrix L (n, n) of ``L p' = b``, which is the negative of the matrix in the report's Figure 5.5."""
    count = len(cells.rest)
    matrix = sparse.csr_array((cells.weights, cells.neighbours, cells.starts), shape=(count, count))
    return sparse.diags_array(matrix.sum(axis=1)) - matrix


def least_energy(points: Floats, cells: VertexCells) -> float:
    """The minimum energy [mm2] of eq. 5.10, with squared norms, over all rotations of cells, at ``points`` (n, 3)."""
    return energy(points, fit_rotations(points, cells), cells)


@dataclass(frozen=True, eq=False)
class GlobalStep:
    """The global step for given ``attached`` (k,) and ``free`` vertices (m,), with a matrix that is factorised once.

    ``pick`` (m, n): the matrix by which both sides of the equations are multiplied. It selects the rows of free vertices or, for
    least squares, is the transpose of their columns. ``coupling`` (m, k): ``pick`` times the columns of attached vertices.
    ``loose``: free vertices that are not connected to an attached vertex by nonzero weights. ``factor``: the LU factors, or None if
    there are loose vertices, no attached vertices or no free vertices; no vertex moves then.
    """

    cells: VertexCells
    attached: Ints
    free: Ints
    pick: Any
    coupling: Any
    factor: Any | None
    loose: Ints

    @classmethod
    def of(cls, cells: VertexCells, attached: Ints, fixed: Fixed) -> Self:
        """The global step of ``cells``; ``fixed`` is the treatment of ``attached`` vertices, as in the settings."""
        everything, matrix = np.arange(len(cells.rest)), laplacian(cells).tocsr()
        free = np.setdiff1d(everything, attached)
        columns, part = matrix[:, free], connected_components(matrix != 0, directed=False)[1]
        loose = np.flatnonzero(~np.isin(part, part[attached])) if len(attached) else attached[:0]
        pick = sparse.eye_array(len(everything), format="csr")[free] if fixed == "remove" else columns.T.tocsr()
        solvable = 0 < len(free) < len(everything) and len(loose) == 0
        factor = factorised(pick @ columns) if solvable else None
        return cls(cells, attached, free, pick, pick @ matrix[:, attached], factor, loose)

    def place(self, points: Floats, rotations: Floats) -> Floats:
        """Positions (n, 3) [mm] that solve ``L p' = b`` for given ``rotations``; attached vertices stay as in ``points``."""
        moved = points.copy()
        if self.factor is not None:
            right = self.pick @ right_side(rotations, self.cells) - self.coupling @ points[self.attached]
            moved[self.free] = self.factor.solve(right)
        return moved


@dataclass(frozen=True, eq=False)
class Relaxed:
    """The ``points`` (n, 3) [mm] of a frame after ``iterations``.

    ``met``: False if a tolerance was given and not reached. ``trouble``: the reason to end the run, or None.
    """

    points: Floats
    iterations: int
    met: bool
    trouble: Trouble | None = None


class Alternation(MovingSurface):
    """A surface whose free vertices are moved by the function ``relax`` after the attached vertices have moved with their bones."""

    advice = "a slower motion may help"

    def __init__(self, setup: Setup, system: GlobalStep, relax: Callable[[Floats], Relaxed]) -> None:
        super().__init__(setup)
        self.system, self.relax, self.relaxed = system, relax, Relaxed(self.points, 0, True)
        self.cost |= {"local_global_steps": 0, "frames_off_tolerance": 0}

    def move(self, number: int) -> None:
        """Move the attached vertices to their positions at frame ``number``, then relax the free vertices."""
        carry(self.points, self.setup, number)
        self.relaxed = self.relax(self.points)
        self.points = self.relaxed.points
        self.cost["local_global_steps"] += self.relaxed.iterations
        self.cost["frames_off_tolerance"] += not self.relaxed.met

    def trouble(self) -> Trouble | None:
        """The trouble with the surface or with its relaxation; None if there is none."""
        return super().trouble() or self.relaxed.trouble

    def frame(self, number: int) -> Frame:
        """The surface at frame ``number``, with its energy as a scalar."""
        energy = least_energy(self.points, self.system.cells)
        return replace(super().frame(number), scalars={"arap_energy_mm2": energy})

    def ending(self) -> Outcome:
        """The outcome: *converged*, or *out of steps* if some frame did not meet the tolerance."""
        frames = self.setup.frames[-1] - self.setup.frames[0]
        done = f"{frames} frames in {self.cost['local_global_steps']:.0f} iterations"
        if missed := self.cost["frames_off_tolerance"]:
            advice = "more iterations or a larger tolerance may help"
            return Outcome("out of steps", f"{done}; {missed:.0f} frames did not meet the tolerance; {advice}")
        return Outcome("converged", done)


def solve(setup: Setup, settings: ArapSettings, sink: Sink) -> Outcome:
    """Go through every frame number, from the first of ``setup.frames``, which is at rest, to the last."""
    return alternate(_alternation, setup, settings, sink)


def _alternation(setup: Setup, settings: ArapSettings) -> Alternation:
    system = GlobalStep.of(cells_of(setup.surface, settings.weights), setup.attached_vertices, settings.fixed)
    triangles, volume = setup.surface.triangles, enclosed_volume(setup.surface.points, setup.surface.triangles)

    def relax(points: Floats) -> Relaxed:
        rotations = fit_rotations(points, system.cells)
        for count in range(1, settings.iterations + 1):
            if count > 1 and settings.rotations == "each":
                rotations = fit_rotations(points, system.cells)
            moved = system.place(points, rotations)
            if settings.volume_step:
                moved = scaled(moved, triangles, system.free, volume)
            displacement, points = farthest(moved - points), moved
            if settings.tolerance is not None and displacement <= settings.tolerance:
                return Relaxed(points, count, True)
        return Relaxed(points, settings.iterations, settings.tolerance is None)

    return Alternation(setup, system, relax)


def alternate[S: Record](make: Callable[[Setup, S], Alternation], setup: Setup, settings: S, sink: Sink) -> Outcome:
    """Move the attached vertices and relax the free vertices at each frame number, with the model that ``make`` creates."""
    model = timed(make, setup, settings)
    if len(loose := model.system.loose):
        why = f"vertex {loose[0]}: only triangles without area or weight connect it to an attached vertex"
        hint = "kirchhoff weights do not depend on areas"
        return refused(model, setup.frames[0], sink, Trouble("diverged", f"{why}; {hint}"))
    return follow(model, setup, sink)


def scaled(points: Floats, triangles: Ints, free: Ints, volume: float) -> Floats:
    """``points`` (n, 3) after the ``free`` points are scaled about the mean of all points by the cube root of V0 / V (eq. 5.9).

    V0 is ``volume`` [mm3]. Attached vertices stay in place, so the result has this volume only if all vertices are free. A surface
    that encloses no volume is returned unchanged.
    """
    centre, inside = points.mean(axis=0), abs(enclosed_volume(points, triangles))
    factor = np.cbrt(volume / inside) if inside > 0 else 1.0
    found = points.copy()
    found[free] = centre + factor * (points[free] - centre)
    return found


def farthest(displacements: Floats) -> float:
    """The length of the longest of the ``displacements`` (n, 3)."""
    return float(np.sqrt(np.max(np.einsum("ij,ij->i", displacements, displacements))))


def factorised(matrix: Any) -> Any:
    """The LU factors of a sparse matrix that has a symmetric structure and needs no pivoting."""
    options = {"SymmetricMode": True}
    return splu(matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def cotangents(points: Floats, triangles: Ints) -> Floats:
    """The cotangent (m, 3) of the angle at each corner: negative if the angle is obtuse, and 0 in a degenerate triangle."""
    sides = [points[triangles[:, (k + 2) % 3]] - points[triangles[:, (k + 1) % 3]] for k in range(3)]
    doubled = np.linalg.norm(np.cross(sides[0], sides[1]), axis=1)
    longest = np.max([np.einsum("ij,ij->i", side, side) for side in sides], axis=0)
    products = np.stack([-np.einsum("ij,ij->i", sides[(k + 1) % 3], sides[(k + 2) % 3]) for k in range(3)], axis=1)
    flat = doubled <= _NO_AREA * longest
    return np.where(flat[:, None], 0.0, products / np.where(flat, 1.0, doubled)[:, None])


def _edge_weights(surface: Surface, name: Weights) -> Any:
    """A sparse matrix (n, n) with two weights for each edge, one for each end."""
    triangles, count = surface.triangles, len(surface.points)
    one, other = triangles[:, [1, 2, 0]].ravel(), triangles[:, [2, 0, 1]].ravel()  # ends of the edge opposite a corner
    ends = (np.concatenate([one, other]), np.concatenate([other, one]))
    halves = np.tile(cotangents(surface.points, triangles).ravel() / 2, 2)
    matrix = sparse.coo_array((halves, ends), shape=(count, count)).tocsr()
    if name in ("kirchhoff", "tutte"):
        matrix.data[:] = 1
    if name == "clamped cotangent":
        matrix.data = np.maximum(matrix.data, 0)
    if name == "tutte":
        matrix.data /= np.repeat(matrix.sum(axis=1), np.diff(matrix.indptr))
    return matrix


_REPORTED = {"weights": "clamped cotangent", "fixed": "remove", "rotations": "each", "volume_step": False}
_REPORTED |= {"iterations": 4}
# The second row adds the volume step (eq. 5.9) to each iteration (section 6.2).
_TABLE = (TableRow("ARAP", "arap", _REPORTED), TableRow("ARAP", "arap_volume_step", _REPORTED | {"volume_step": True}))
SOLVES = (MuscleSolver(settings=ArapSettings, solve=solve, example=_REPORTED | {"iterations": 3}, table=_TABLE),)
