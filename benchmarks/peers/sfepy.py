"""SfePy: finite elements with terms compiled in C, and a term of our own for fibres."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from benchmarks import bodies
from benchmarks.peers import Solve, Solved
from benchmarks.peers.problem import QUADRATURE, RESIDUAL, Bend, Muscle, tension
from fem_reference.foundations.mesh import Floats

PACKAGES = ("sfepy", "pypardiso")
TUNED = (
    "its compiled terms, a vectorised one for fibres, which it does not have; Pardiso; each load step begins from the state "
    "before, moved along with the ends: it puts prescribed displacements in before it solves, by which cells would turn inside out"
)
OMITTED: dict[str, str] = {}
# Pairs of axes in its order of symmetric tensors, and how often each occurs.
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_TWICE = np.array([1.0, 1.0, 1.0, 2.0, 2.0, 2.0])


@contextmanager
def opened() -> Iterator[Solve]:
    """SfePy imported; it says nothing meanwhile."""
    import sfepy.terms
    from sfepy.base.base import output

    output.set_output(quiet=True)
    fibres = _term()
    if fibres.name not in sfepy.terms.term_table:
        sfepy.terms.register_term(fibres)
    term = sfepy.terms.term_table[fibres.name]

    def solve(muscle: Muscle) -> Solved:
        term.law, term.directions = muscle.law, muscle.fibres
        return _solve(muscle)

    try:
        yield solve
    finally:
        output.set_output(quiet=False)


def _solve(muscle: Muscle) -> Solved:
    from sfepy.solvers.ls import PyPardisoSolver
    from sfepy.solvers.nls import Newton
    from sfepy.solvers.ts_solvers import SimpleTimeSteppingSolver

    problem, displacement = _problem(muscle)
    iterations, nodes, bend = 0, displacement.field.get_coor(), Bend()

    def count(*_: Any, **__: Any) -> bool:
        nonlocal iterations
        iterations += 1
        return True

    class Steps(SimpleTimeSteppingSolver):  # type: ignore[misc]
        def solve_step(self, ts: Any, nls: Any, vec: Any, prestep_fun: Any = None) -> Any:  # noqa: ARG002
            variables = problem.equations.variables
            full = variables.make_full_vec(vec)
            moved = bend(nodes, ts.time) - bend(nodes, ts.time - ts.dt)
            full[variables.di.indx["u"]] += moved.ravel()
            return nls(variables.reduce_vec(full))

    newton = {
        "i_max": 25,
        "eps_a": RESIDUAL,
        "eps_r": 1.0,
        "ls_on": 1e30,
        "lin_red": None,
        "is_new_jacobian_fun": count,
    }
    last = muscle.body.frames[-1]
    solver = Newton(newton, lin_solver=PyPardisoSolver({}), status={})
    problem.set_solver(Steps({"t0": 0.0, "t1": last, "n_step": int(last) + 1}, nls=solver, context=problem))
    unknowns, corners = 0, len(muscle.mesh.points)
    try:
        variables = problem.solve(save_results=False, verbose=False)
        unknowns = int(variables.adi.n_dof_total)
        converged = solver.status["condition"] == 0
    except ValueError as error:
        return Solved(False, str(error), iterations, unknowns, muscle.mesh.points)
    moved = np.asarray(variables["u"]()).reshape(-1, 3)[:corners]
    return Solved(
        converged,
        "" if converged else "Newton's method did not converge",
        iterations,
        unknowns,
        muscle.mesh.points + moved,
    )


def _problem(muscle: Muscle) -> tuple[Any, Any]:
    """The equations with their boundary conditions, and the unknown displacement."""
    from sfepy.discrete import Equation, Equations, FieldVariable, Function, Integral, Material, Problem
    from sfepy.discrete.conditions import Conditions, EssentialBC
    from sfepy.discrete.fem import FEDomain, Field, Mesh
    from sfepy.terms import Term

    mesh, order = muscle.mesh, 1 if muscle.mesh.kind == "hexahedron" else 2
    cells = mesh.cells[:, [0, 1, 3, 2, 4, 5, 7, 6]] if order == 1 else mesh.cells
    ids = [np.zeros(len(cells), np.int32)]
    made = Mesh.from_data(
        "muscle", np.array(mesh.points), None, [np.array(cells, np.int32)], ids, ["3_8" if order == 1 else "3_4"]
    )
    domain = FEDomain("domain", made)
    omega = domain.create_region("Omega", "all")
    bottom = domain.create_region("Bottom", "vertices in (z < 0.001)", "facet")
    top = domain.create_region("Top", f"vertices in (z > {bodies.LENGTH - 0.001:.3f})", "facet")
    of_u = Field.from_args("of_u", np.float64, "vector", omega, approx_order=order)
    of_p = Field.from_args("of_p", np.float64, "scalar", omega, approx_order=int(muscle.element[-1]))
    u, v = FieldVariable("u", "unknown", of_u), FieldVariable("v", "test", of_u, primary_var_name="u")
    p, q = FieldVariable("p", "unknown", of_p), FieldVariable("q", "test", of_p, primary_var_name="p")
    m = Material("m", mu=muscle.law["mu"], compress=1 / muscle.law["bulk"])
    integral = Integral("i", order=QUADRATURE[muscle.element])

    def term(text: str, **arguments: Any) -> Any:
        return Term.new(text, integral, omega, **arguments)

    balance = term("dw_tl_he_neohook(m.mu, v, u)", m=m, v=v, u=u) + term("dw_tl_fibres(m.mu, v, u)", m=m, v=v, u=u)
    balance = balance + term("dw_tl_bulk_pressure(v, u, p)", v=v, u=u, p=p)
    volume = term("dw_tl_volume(q, u)", q=q, u=u) - term("dw_integrate(q)", q=q)
    volume = volume + term("dw_dot(m.compress, q, p)", m=m, q=q, p=p)  # its pressure is positive where ours is negative
    problem = Problem("muscle", equations=Equations([Equation("balance", balance), Equation("volume", volume)]))
    bend = Function("bend", lambda ts, coors, **_: Bend()(coors, ts.time))
    ends = [EssentialBC("bottom", bottom, {"u.all": 0.0}), EssentialBC("top", top, {"u.all": bend})]
    problem.set_bcs(ebcs=Conditions(ends))
    problem.set_ics(ics=Conditions([]))
    return problem, u


def _term() -> Any:
    """The class of the term: with s = a.Ca, l = J^(-1/3) sqrt(s), T = l dW/dl and N = a (x) a / s - C^-1 / 3 the stress is T N."""
    from sfepy.terms.terms_hyperelastic_tl import HyperElasticTLBase

    class Fibres(HyperElasticTLBase):  # type: ignore[misc]
        name = "dw_tl_fibres"
        family_data_names = ("det_f", "sym_c", "sym_inv_c")
        law: dict[str, float]
        directions: Floats

        def _fibre(self, det: Floats, c: Floats, inverse: Floats) -> tuple[Floats, ...]:
            """T, its slope, l and s at each point, a (x) a and N (cells, points, 6)."""
            a = self.directions
            pair = np.stack([a[:, i] * a[:, j] for i, j in _PAIRS], axis=1)[:, None]
            s = (c[..., 0] * pair * _TWICE).sum(axis=-1)
            stretch = det[..., 0, 0] ** (-1 / 3) * np.sqrt(s)
            force, slope = tension(self.law, stretch)
            return force, slope, stretch, s, pair, pair / s[..., None] - inverse[..., 0] / 3

        def stress_function(self, out: Floats, _: Any, *state: Floats) -> None:
            force, *_, N = self._fibre(*state)
            out[..., 0] = force[..., None] * N

        def tan_mod_function(self, out: Floats, _: Any, *state: Floats) -> None:
            force, slope, stretch, s, pair, N = self._fibre(*state)
            inverse = state[2][..., 0]
            out[:] = (slope * stretch)[..., None, None] * N[..., :, None] * N[..., None, :]
            out -= (2 * force / s**2)[..., None, None] * pair[..., :, None] * pair[..., None, :]
            entry = {pair: k for k, pair in enumerate(_PAIRS)} | {(j, i): k for k, (i, j) in enumerate(_PAIRS)}
            for row, (i, j) in enumerate(_PAIRS):
                for column, (k, m) in enumerate(_PAIRS):
                    ik, jm, im, jk = (inverse[..., entry[one]] for one in ((i, k), (j, m), (i, m), (j, k)))
                    out[..., row, column] += force / 3 * (ik * jm + im * jk)

    return Fibres
