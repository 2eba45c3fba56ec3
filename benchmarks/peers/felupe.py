"""FElupe: finite elements in numpy, with a hand-written law."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from benchmarks.peers import Solve, Solved
from benchmarks.peers.problem import RESIDUAL, Muscle, tension
from fem_reference.foundations.mesh import Floats

PACKAGES = ("felupe", "pypardiso")
TUNED = (
    "its body with pressures and volumes condensed cell by cell; a law by hand in place of automatic differentiation; "
    "Pardiso for symmetric matrices, one symbolic factorisation for all"
)
OMITTED = {"P2/P1": "its condensed body has pressures constant in cells; the mixed one in three fields is slower"}


@contextmanager
def opened() -> Iterator[Solve]:
    """FElupe and Pardiso imported."""
    import felupe
    import pypardiso

    def solve(muscle: Muscle) -> Solved:
        return _solve(felupe, pypardiso, muscle)

    yield solve


def _solve(felupe: Any, pypardiso: Any, muscle: Muscle) -> Solved:
    field = _field(felupe, muscle)
    region = field.region
    points = region.mesh.points
    law = _law(felupe)(muscle.law)
    shape = (3, region.quadrature.npoints, region.mesh.ncells)
    fibres = np.ascontiguousarray(np.broadcast_to(muscle.fibres.T[:, None, :], shape))
    body = felupe.SolidBodyNearlyIncompressible(law, field, bulk=muscle.law["bulk"], statevars=fibres)
    ends = muscle.fixed(points)
    fixed = (3 * np.concatenate(ends)[:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(points.size), fixed)
    linear, iterations = _linear(pypardiso), 0
    for frame in muscle.body.frames[1:]:
        paths = zip(muscle.body.prescribed, ends, strict=True)
        displaced = np.concatenate([entry.path(points[nodes], frame) for entry, nodes in paths])
        try:
            found = felupe.newtonraphson(
                items=[body],
                x0=field,
                dof0=fixed,
                dof1=free,
                ext0=displaced.ravel(),
                solver=linear,
                check=_check,
                verbose=0,
            )
        except felupe.tools.NewtonConvergenceError as error:
            return Solved(False, f"frame {frame:g}: {error}".strip(), iterations, len(free), muscle.mesh.points)
        field, iterations = found.x, iterations + found.iterations
    corners = slice(len(muscle.mesh.points))
    return Solved(True, "", iterations, len(free), (points + field[0].values)[corners])


def _field(felupe: Any, muscle: Muscle) -> Any:
    """The displacement on cells as FElupe has them: of a hexahedron it goes around the corners of two faces."""
    mesh = muscle.mesh
    if mesh.kind == "hexahedron":
        around = mesh.cells[:, [0, 1, 3, 2, 4, 5, 7, 6]]
        region = felupe.RegionHexahedron(felupe.Mesh(mesh.points, around, "hexahedron"))
    else:
        straight = felupe.Mesh(mesh.points, mesh.cells, "tetra")
        region = felupe.RegionQuadraticTetra(straight.add_midpoints_edges())
    return felupe.FieldContainer([felupe.Field(region, dim=3)])


def _check(f: Floats, dof1: Any, **_: Any) -> tuple[float, float, bool]:
    """Whether the nodal forces ``f`` on free nodes are in balance, by our measure in place of a relative one."""
    norm = float(np.linalg.norm(f[dof1]))
    return norm, norm, norm < RESIDUAL


def _linear(pypardiso: Any) -> Callable[[Any, Floats], Floats]:
    """Solves symmetric systems; the symbolic factorisation is made anew only where the pattern has changed: entries that happen
    to be zero are left out.
    """
    from scipy.sparse import triu

    pardiso = pypardiso.PyPardisoSolver(mtype=-2)
    last: Any = None

    def solve(matrix: Any, right: Floats) -> Floats:
        nonlocal last
        if not np.isfinite(matrix.data).all():  # Pardiso would not return
            return np.full_like(right, np.nan)
        upper = triu(matrix, format="csr")
        upper.sort_indices()
        known = (
            last is not None
            and np.array_equal(upper.indptr, last.indptr)
            and np.array_equal(upper.indices, last.indices)
        )
        pardiso.set_phase(23 if known else 13)  # numerical factorisation and solution, or with the symbolic one before
        last = upper
        return np.asarray(pardiso._call_pardiso(upper, np.asfortranarray(right)))

    return solve


def _law(felupe: Any) -> Any:
    """The class of the law: FElupe's isochoric neo-Hookean one, and beside it fibres whose rest directions are state variables.

    With g = F a, s = g.g and l = J^(-1/3) sqrt(s): dl/dF = l N with N = g (x) a / s - F^-T / 3, and P = T(l) N, T = l dW/dl.
    """
    dya, cdya_il, det, inv = felupe.math.dya, felupe.math.cdya_il, felupe.math.det, felupe.math.inv

    class Law(felupe.NeoHooke):  # type: ignore[misc]
        def __init__(self, law: dict[str, float]) -> None:
            super().__init__(mu=law["mu"])
            self.law = law
            self.x = [np.eye(3), np.zeros(3)]

        def _fibre(self, F: Floats, a: Floats) -> tuple[Floats, ...]:
            """Stretch, square of |g|, g (x) a, F^-T and N at each point."""
            J = det(F)
            transposed = inv(F, J).transpose(1, 0, 2, 3)
            g = np.einsum("iK...,K...->i...", F, a)
            s = np.einsum("i...,i...->...", g, g)
            pair = g[:, None] * a[None]
            return J ** (-1 / 3) * np.sqrt(s), s, pair, transposed, pair / s - transposed / 3

        def _gradient(self, x: Any) -> Any:
            stress, directions = super()._gradient(x)
            stretch, _, _, _, N = self._fibre(x[0], directions)
            stress += tension(self.law, stretch)[0] * N
            return [stress, directions]

        def _hessian(self, x: Any) -> Any:
            (tangent,) = super()._hessian(x)
            stretch, s, pair, transposed, N = self._fibre(x[0], x[-1])
            force, slope = tension(self.law, stretch)
            tangent += dya(slope * stretch * N, N)
            tangent -= dya(2 * force / s**2 * pair, pair)
            tangent += cdya_il(force / 3 * transposed, transposed)
            along = force / s * x[-1][:, None] * x[-1][None]
            for i in range(3):
                tangent[i, :, i] += along
            return [tangent]

    return Law
