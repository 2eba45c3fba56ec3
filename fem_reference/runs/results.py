"""Full results of a reference run, such as displacement, stress, pressure and det F, at any points in the muscle.

A run that is solved with ``store_state = true`` stores its unknowns. They determine all results: the deformation gradient through
the basis functions of the element, and the stress through the energies of the effects, differentiated by ``jets``. FEniCSx is not
needed.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from fem_reference.effects import Effect, Energy, State, elastic_state, in_situ, regions_named
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.jets import JET_FUNCTIONS, variables
from fem_reference.foundations.material_point import NUMPY, Functions
from fem_reference.foundations.mesh import Floats, Ints, TetMesh, edge_vectors, tet_volumes
from fem_reference.geometry.embedding import Locator
from fem_reference.geometry.regions import INWARDS, Region
from fem_reference.problems.body import reference_nodes
from fem_reference.problems.muscle import setup
from fem_reference.problems.stresses import AT_ONCE, first_piola
from fem_reference.runs import states, store
from fem_reference.runs.states import NodalState
from fem_reference.scenes.case import Case
from fem_reference.scenes.casefile import muscle, read_muscle

NAMES = (
    "displacement",
    "deformation_gradient",
    "det_F",
    "pressure",
    "fibre_stretch",
    "cauchy_stress",
    "von_mises",
    "fibre_stress",
)
# A point is outside the tetrahedra if its distance from them exceeds this fraction of the mesh's diagonal; less is rounding.
ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Results:
    """The ``states`` of a muscle, by frame number, with its ``mesh`` and ``effects``. ``regions``: the regions in which effects
    act, by name. ``fibre`` (m, 3): the unit vectors along the fibres at the centroids of the tetrahedra, if known. The solver uses
    directions at quadrature points, which differ from these by 2 degrees (rms) in a bar with tetrahedra of 6 mm.
    """

    mesh: TetMesh
    effects: tuple[Effect, ...]
    states: Mapping[float, NodalState]
    fibre: Floats | None = None
    regions: Mapping[str, Region] = field(default_factory=dict)

    @property
    def frames(self) -> tuple[float, ...]:
        """The available frame numbers."""
        return tuple(self.states)

    def evaluate(self, points: ArrayLike, frame: float, names: Sequence[str] | None = None) -> dict[str, Floats]:
        """Results by name at ``points`` (n, 3) [mm], given in the rest state, for a ``frame`` number in ``frames``.

        ``names``: the results to compute, by default all that exist. They are ``displacement`` (n, 3) [mm];
        ``deformation_gradient`` F (n, 3, 3), ``F[i, k] = dx_i / dX_k``; ``det_F`` (n,); ``pressure`` (n,) [MPa], the mixed unknown,
        which is positive where the volume grows; ``fibre_stretch`` (n,), ``|F fibre|``; ``cauchy_stress`` (n, 3, 3) [MPa];
        ``von_mises`` (n,) [MPa]; and ``fibre_stress`` (n,) [MPa], the stress along the deformed fibre. All are NaN at a point
        outside the tetrahedra. F and the stress are discontinuous between tetrahedra, so a shared point has the values of one of
        its tetrahedra. The stress is NaN where det F is not positive. Raises InputError if the run does not have the frame or the
        result.
        """
        wanted = self._checked(names, self._state(frame))
        found = np.asarray(points, float)
        if found.ndim != 2 or found.shape[1] != 3 or not np.isfinite(found).all():
            got = f"an array {found.shape}{'' if np.isfinite(found).all() else ' with entries that are not finite'}"
            raise InputError("points", got, "finite coordinates (n, 3) [mm] in the rest state")
        embedding = self._locator.embed(found)
        inside = np.flatnonzero(embedding.outside <= ROUNDING * self._locator.diagonal)
        values = self.evaluate_in(embedding.tets[inside], embedding.barycentric[inside], frame, wanted)
        everywhere = {name: np.full((len(found), *value.shape[1:]), np.nan) for name, value in values.items()}
        for name, value in values.items():
            everywhere[name][inside] = value
        return everywhere

    def evaluate_in(
        self, tets: Ints, barycentric: Floats, frame: float, names: Sequence[str] | None = None
    ) -> dict[str, Floats]:
        """The results of :meth:`evaluate` at points with ``barycentric`` coordinates (n, 4) in the tetrahedra ``tets`` (n,)."""
        state = self._state(frame)
        wanted = self._checked(names, state)
        acting = [(effect, effect.amount(frame)) for effect in self.effects]
        parts = []
        for start in range(0, max(len(tets), 1), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            places = _Places(self, state, np.asarray(tets[some], np.int64), barycentric[some])
            parts.append(places.values(wanted, acting))
        return {name: np.concatenate([part[name] for part in parts]) for name in wanted}

    def energies(self, frame: float) -> dict[str, float]:
        """The energy W [N mm] of each effect with an energy, by its name in scene files, for a ``frame`` number in ``frames``.
        Contact and springs are not included. The share of an effect in a moment is -dW/dtheta with the angle theta of the joint.
        """
        state, (rule, shares), found = self._state(frame), _rule(), dict[str, float]()
        acting = [(effect, effect.amount(frame)) for effect in self.effects]
        volumes = tet_volumes(self.mesh.points, self.mesh.tets)
        for some in np.array_split(np.arange(len(volumes)), len(volumes) * len(rule) // AT_ONCE + 1):
            places = _Places(self, state, np.repeat(some, len(rule)), np.tile(rule, (len(some), 1)))
            weights = np.outer(volumes[some], shares).ravel()
            for name, density in places.energies(acting):
                found[name] = found.get(name, 0.0) + float((weights * density).sum())
        return found

    def names(self, state: NodalState) -> tuple[str, ...]:
        """The names of the results that can be computed from a ``state``."""
        lacking = {"pressure"} if state.pressure.shape[1] == 0 else set()
        lacking |= {"fibre_stretch", "fibre_stress"} if self.fibre is None else set()
        return tuple(name for name in NAMES if name not in lacking)

    @cached_property
    def _locator(self) -> Locator:
        return Locator(self.mesh)

    def _checked(self, names: Sequence[str] | None, state: NodalState) -> tuple[str, ...]:
        there = self.names(state)
        for name in names or ():
            if name not in there:
                raise InputError("names", f'"{name}"', f"one of {', '.join(there)}, which this run has")
        return there if names is None else tuple(names)

    def _state(self, frame: float) -> NodalState:
        """The state at a ``frame``. Raises InputError if there is none, or if its arrays do not fit the mesh and the effects."""
        if frame not in self.states:
            raise InputError("frame", f"{frame:g}", f"one of {', '.join(f'{number:g}' for number in self.frames)}")
        state, m = self.states[frame], len(self.mesh.tets)
        shapes = state.displacement.shape, state.pressure.shape
        allowed = [((m, k, 3), (m, l)) for k in (4, 10) for l in (0, 1, 4)]  # noqa: E741
        if shapes not in allowed:
            want = f"({m}, 4 or 10, 3) and ({m}, 0, 1 or 4), as the mesh has {m} tetrahedra"
            raise InputError(f"state at frame {frame:g}", f"arrays {shapes[0]} and {shapes[1]}", want)
        own = state.response.shape, state.response_pressure.shape
        if in_situ.among(self.effects) is not None and own != shapes:
            got = f"arrays response {own[0]} and response_pressure {own[1]}"
            want = f"{shapes[0]} and {shapes[1]}: they determine the stress at rest of a muscle in situ"
            raise InputError(f"state at frame {frame:g}", got, want)
        return state


def of_run(folder: Path | str, case: str | Path | Case) -> Results:
    """The results of the run in ``folder``. ``case``: the name or folder of its case, or the case as changed for that run.
    Raises InputError if there is no run with states, or if the run belongs to another case.
    """
    folder = Path(folder)
    run = store.load(folder)
    mesh, fibre = states.read_rest(folder)
    scene = read_muscle(case) if isinstance(case, str | Path) else muscle(case)
    if run.origin.get("scene") != scene.key:
        raise InputError(folder, f"a run of a scene other than {scene.place}", "the scene that was solved")
    regions = setup(scene).regions if scene.region else {}
    return Results(mesh, scene.effects, states.StoredStates(folder, run.numbers), fibre, regions)


class _Places:
    """Points in the tetrahedra ``tets`` (n,) of ``results`` at a ``state``, with all quantities on which an effect may depend."""

    def __init__(self, results: Results, state: NodalState, tets: Ints, barycentric: Floats) -> None:
        self.results, self.state, self.tets, self.corners = results, state, tets, barycentric
        corners = results.mesh.points[results.mesh.tets[tets]]
        self.places = np.einsum("na,nai->ni", barycentric + INWARDS * (1 / 4 - barycentric), corners)  # at rest
        inverse = np.linalg.inv(edge_vectors(corners))
        gradients = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
        self.functions, self.slopes = lagrange(barycentric, gradients, state.displacement.shape[1])
        self.displacement, self.F = self._moved(state.displacement)
        self.det_F = np.linalg.det(self.F)

    def _moved(self, nodal: Floats) -> tuple[Floats, Floats]:
        """The displacement (n, 3) [mm] and the deformation gradient (n, 3, 3) from ``nodal`` displacements (m, k, 3) [mm]."""
        inside = nodal[self.tets]
        gradient = np.einsum("nai,nak->nik", inside, self.slopes)
        return np.asarray(np.einsum("na,nai->ni", self.functions, inside)), np.eye(3) + gradient

    def _pressure(self, of_cells: Floats) -> Floats | None:
        """The pressure (n,) [MPa] from its values ``of_cells`` (m, l) [MPa]; None if the element has no pressure."""
        inside = of_cells[self.tets]
        if inside.shape[1] == 0:
            return None
        return inside[:, 0] if inside.shape[1] == 1 else np.asarray((inside * self.corners).sum(axis=1))

    def values(self, names: Sequence[str], acting: Sequence[tuple[Effect, float]]) -> dict[str, Floats]:
        """The results with these ``names``, as described in ``Results.evaluate``. ``acting``: the effects and their amounts."""
        values: dict[str, Any] = {
            "displacement": self.displacement,
            "deformation_gradient": self.F,
            "det_F": self.det_F,
        }
        at_rest = self.state.response_pressure if len(self.state.response) else np.zeros(1)
        values["pressure"] = self._pressure(self.state.pressure + at_rest)
        if {"cauchy_stress", "von_mises", "fibre_stress"} & set(names):
            stress = self.cauchy_stress(acting)
            values |= {"cauchy_stress": stress, "von_mises": von_mises(stress)}
        if self.results.fibre is not None and {"fibre_stretch", "fibre_stress"} & set(names):
            along = np.einsum("nik,nk->ni", self.F, self.results.fibre[self.tets])
            stretch = values["fibre_stretch"] = np.linalg.norm(along, axis=1)
            if "fibre_stress" in names:
                along /= stretch[:, None]
                values["fibre_stress"] = np.einsum("ni,nij,nj->n", along, values["cauchy_stress"], along)
        return {name: values[name] for name in names}

    def cauchy_stress(self, acting: Sequence[tuple[Effect, float]]) -> Floats:
        """The Cauchy stress ``sigma = 1/J dW/dF F^T`` (n, 3, 3) [MPa], where W is the sum of all energies per unit rest volume,
        which also depend on the pressure unknown (Holzapfel 2000, Nonlinear Solid Mechanics, eq. 6.10 and 3.8).
        """
        with np.errstate(all="ignore"):  # where det F is not positive
            jets = variables(self.F.reshape(-1, 9).T, curved=False)
            now = self._state([jets[0:3], jets[3:6], jets[6:9]], JET_FUNCTIONS)
            first = first_piola(acting, now, len(self.tets), self._at_rest(now))
            stress = np.einsum("nik,njk->nij", first, self.F) / self.det_F[:, None, None]
        stress[~(self.det_F > 0)] = np.nan
        return np.asarray(stress)

    def energies(self, acting: Sequence[tuple[Effect, float]]) -> Iterator[tuple[str, Floats]]:
        """Yield the name of each effect with an energy, and the energy per unit rest volume (n,) [MPa]."""
        with np.errstate(all="ignore"):  # where det F is not positive
            now = elastic_state(acting, self._state([list(row) for row in np.moveaxis(self.F, 0, -1)], NUMPY))
            for effect, amount in acting:
                if isinstance(effect, Energy):
                    yield type(effect).__module__.rpartition(".")[2], effect.weighted(replace(now, amount=amount))
            if len(self.state.response):
                whole = self._state([list(row) for row in np.moveaxis(self.F, 0, -1)], NUMPY)
                yield "in_situ", self._at_rest(whole)

    def _at_rest(self, state: State) -> Any:
        """The energy per unit rest volume (n,) [MPa], at ``state``, of the stress at rest of a body in situ; 0 for other bodies."""
        if not len(self.state.response):
            return 0.0
        slopes = self._moved(self.state.response)[1] - np.eye(3)
        shear, bulk = in_situ.moduli_of(self.results.effects)
        pressure = self._pressure(self.state.response_pressure)
        if pressure is None:
            pressure = bulk * np.trace(slopes, axis1=1, axis2=2)
        return in_situ.balancing(state, [list(row) for row in np.moveaxis(slopes, 0, -1)], pressure, shear)

    def _state(self, F: Sequence[Sequence[Any]], functions: Functions) -> State:
        """The state of the points as effects need it. The entries of ``F`` are arrays or jets, and ``functions`` apply to them."""
        state = self.state
        passed = state.before if len(state.before) else np.zeros_like(state.displacement)
        before, F_before = self._moved(passed)
        fibre = None if self.results.fibre is None else list(self.results.fibre[self.tets].T)
        return State(
            F=F,
            displacement=list(self.displacement.T),
            pressure=self._pressure(state.pressure),
            fibre=fibre,
            before=list(before.T),
            F_before=[list(row) for row in np.moveaxis(F_before, 0, -1)],
            rate=state.rate,
            regions={name: self.results.regions[name](self.places) for name in regions_named(self.results.effects)},
            functions=functions,
        )


@cache
def _rule() -> tuple[Floats, Floats]:
    """The barycentric coordinates (27, 4) and weights (27,) of a conical product rule of degree 5 (Gauss-Jacobi; Stroud 1971)."""
    (u, a), (v, b), (w, c) = (scipy.special.roots_jacobi(3, power, 0) for power in (2, 1, 0))
    x, y, z = np.meshgrid((1 + u) / 2, (1 + v) / 2, (1 + w) / 2, indexing="ij")
    rest = (1 - x) * (1 - y)
    shares = a[:, None, None] * b[:, None] * c
    corners = np.stack([x, (1 - x) * y, rest * z, rest * (1 - z)], axis=-1).reshape(-1, 4)
    return corners, shares.ravel() / shares.sum()


def von_mises(stress: Floats) -> Floats:
    """The von Mises stress ``sqrt(3/2 s : s)`` (n,) of stresses (n, 3, 3) with the deviators s (von Mises 1913)."""
    deviator = stress - np.trace(stress, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))))


def lagrange(barycentric: Floats, gradients: Floats, count: int) -> tuple[Floats, Floats]:
    """The Lagrange functions (n, count) of a tetrahedron and their gradients (n, count, 3) [1/mm], at ``barycentric`` coordinates L
    (n, 4). ``gradients`` (n, 4, 3) [1/mm]: the gradients of the coordinates. ``count``: the number of nodes, 4 or 10, which are in
    the order of ``body.reference_nodes``.

    Functions of degree 2 are ``L_i (2 L_i - 1)`` for a corner and ``4 L_i L_j`` for a mid-edge node (Zienkiewicz and Taylor 2000,
    The Finite Element Method, vol. 1, 8.12).
    """
    if count == 4:
        return barycentric, gradients
    nodes = reference_nodes("tetrahedron", 2)
    near = np.column_stack([1 - nodes.sum(axis=1), nodes]) > 0
    # The two corners at the ends of the edge of each node; for a node at a corner, this corner twice.
    i, j = near.argmax(axis=1), 3 - near[:, ::-1].argmax(axis=1)
    at_corner, scale = np.where(i == j, 1.0, 0.0), np.where(i == j, 2.0, 4.0)
    one, other = barycentric[:, i], barycentric[:, j]
    slopes = scale[:, None] * (one[..., None] * gradients[:, j] + other[..., None] * gradients[:, i])
    return scale * one * other - at_corner * one, slopes - at_corner[:, None] * gradients[:, i]
