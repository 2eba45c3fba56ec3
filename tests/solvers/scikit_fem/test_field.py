"""The correct solver of scalar fields against closed forms and manufactured solutions: values, orders, eigenvalues."""

from functools import partial

import fields
import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

from fem_reference.geometry.field_mesh import l2_distance
from fem_reference.problems.scalar import at, build
from fem_reference.solvers import scikit_fem
from fem_reference.solvers.scikit_fem import ScikitFieldSettings

ENDS = [{"on": "left", "value": 0}, {"on": "right", "value": 1}]


def solved(problem):
    solution = scikit_fem.solve_field(problem, ScikitFieldSettings())
    assert solution.outcome.status == "converged"
    return solution.values[0]


def advected(folder, peclet: float, form: str, order: int = 1):
    """-psi'' + Pe psi' = 0 on 20 elements of (0, 1), psi = 0 and 1 at the ends; its values, and the closed form."""
    scene = fields.scene(
        folder,
        domain={"interval": {"start": 0.0, "end": 1.0, "count": 21}},
        effect=[{"name": "diffusion", "coefficient": 1.0}, {"name": "advection", "velocity": [peclet]}],
        boundary=ENDS,
        element=fields.element(order, form),
    )
    problem = build(scene)
    x = problem.mesh.nodes[order][:, 0]
    # expm1(Pe x) / expm1(Pe), written so that nothing overflows
    exact = (np.exp(peclet * (x - 1)) - np.exp(-peclet)) / -np.expm1(-peclet)
    return problem, solved(problem), exact


@pytest.mark.parametrize("peclet", [1.0, 100.0, 1e6])
def test_stabilised_advection_is_exact_at_the_nodes_and_monotone(tmp_path, peclet) -> None:
    _, values, exact = advected(tmp_path, peclet, "supg")
    assert np.abs(values - exact).max() < 1e-10
    assert (np.diff(values) >= -1e-14).all()  # rounding of a flat part


@pytest.mark.parametrize("peclet", [100.0, 1e6])
def test_plain_galerkin_oscillates(tmp_path, peclet) -> None:
    # Its difference equation has the root (1 + Pe h / 2) / (1 - Pe h / 2), negative where the mesh Peclet number is above 1:
    # the signs of neighbouring steps alternate.
    problem, values, exact = advected(tmp_path, peclet, "galerkin")
    assert problem.peclet == pytest.approx(peclet / 40)
    steps = np.diff(values)
    assert (steps[1:] * steps[:-1] < 0).all()
    root = (1 + peclet / 40) / (1 - peclet / 40)
    expected = (root ** np.arange(21) - 1) / (root**20 - 1)
    # At Pe = 1e6 the matrix is 25 000 times worse to solve.
    assert values == pytest.approx(expected, rel=1e-6, abs=1e-9 * np.abs(expected).max())
    assert np.abs(values - exact).max() > 0.1


@pytest.mark.parametrize(("peclet", "stabilised"), [(1.0, False), (39.0, False), (41.0, True), (1e6, True)])
def test_auto_stabilises_above_a_mesh_peclet_number_of_one(tmp_path, peclet, stabilised) -> None:
    problem, values, _ = advected(tmp_path, peclet, "auto")
    assert (problem.tau is not None) == stabilised
    assert (np.diff(values) >= -1e-14).all()


def test_quadratic_elements_are_stabilised_with_their_second_derivative(tmp_path) -> None:
    # psi = x^2 solves -k psi'' + v psi' = 2 v x - 2 k and lies in the space: a residual that leaves psi'' out would move it.
    scene = fields.scene(
        tmp_path,
        domain={"nodes": [0.0, 0.1, 0.25, 0.7, 1.0]},
        effect=[
            {"name": "diffusion", "coefficient": 0.01},
            {"name": "advection", "velocity": [3.0]},
            {"name": "source", "strength": "6*x - 0.02", "where": "everywhere"},
        ],
        boundary=ENDS,
        element=fields.element(2, "supg"),
    )
    problem = build(scene)
    assert problem.peclet > 10
    assert solved(problem) == pytest.approx(problem.mesh.nodes[2][:, 0] ** 2, abs=1e-12)


# u = sin(pi x) cos(pi y) solves -2 lap u + (1, -3) . grad u + u/2 = f.
EXACT = "sin(pi*x)*cos(pi*y)"
MANUFACTURED = [
    {"name": "diffusion", "coefficient": 2.0},
    {"name": "advection", "velocity": [1.0, -3.0]},
    {"name": "reaction", "rate": 0.5},
    {
        "name": "source",
        "strength": f"(4*pi**2 + 0.5)*{EXACT} + pi*cos(pi*x)*cos(pi*y) + 3*pi*sin(pi*x)*sin(pi*y)",
        "where": "everywhere",
    },
]
MIXED = [
    {"on": "rim", "where": "x - 0.999", "slope": "-pi*cos(pi*y)"},
    {"on": "rim", "where": "0.001 - x", "value": 0},
    {"on": "rim", "where": "0.001 - y", "value": "sin(pi*x)"},
    {"on": "rim", "where": "y - 0.999", "value": "-sin(pi*x)"},
]


@pytest.mark.slow
@pytest.mark.parametrize(("order", "form"), [(1, "galerkin"), (2, "galerkin"), (1, "supg"), (2, "supg")])
def test_manufactured_orders_in_the_plane(tmp_path, order, form) -> None:
    scene = fields.scene(
        tmp_path,
        domain=fields.square(tmp_path, 5),
        effect=MANUFACTURED,
        boundary=MIXED,
        element=fields.element(order, form),
    )
    problems = [build(scene, level) for level in range(4)]
    values = [solved(problem) for problem in problems]
    l2 = [l2_distance(problem.mesh, value, partial(at, EXACT)) for problem, value in zip(problems, values, strict=True)]
    h1 = [energy_norm(problem, value) for problem, value in zip(problems, values, strict=True)]
    assert np.log2(l2[-2] / l2[-1]) == pytest.approx(order + 1, abs=0.1)
    assert np.log2(h1[-2] / h1[-1]) == pytest.approx(order, abs=0.1)


def energy_norm(problem, values) -> float:
    """The L2 norm of the error's gradient, by the library's own quadrature; the gradient of EXACT by hand."""
    basis, _ = scikit_fem.space(problem)
    inside = np.empty(len(values))
    inside[scikit_fem.field.order_of(problem, basis)] = values
    x, y = np.pi * np.asarray(basis.global_coordinates())
    gradient = np.pi * np.stack([np.cos(x) * np.cos(y), -np.sin(x) * np.sin(y)])
    return float(np.sqrt((((basis.interpolate(inside).grad - gradient) ** 2).sum(axis=0) * basis.dx).sum()))


def on_sphere(folder, subdivisions: int, order: int, effect: list):
    scene = fields.scene(
        folder, domain=fields.sphere(folder, subdivisions), effect=effect, element=fields.element(order)
    )
    return build(scene)


DIFFUSION, REACTION = {"name": "diffusion", "coefficient": 1.0}, {"name": "reaction", "rate": 1.0}


@pytest.mark.slow
@pytest.mark.parametrize("order", [1, 2])
def test_poisson_on_the_sphere_is_of_order_two(tmp_path, order) -> None:
    # -lap u + u = 7 u for the harmonic u = xy of degree 2. On flat triangles no element is of a higher order than 2.
    source = {"name": "source", "strength": "7*x*y", "where": "everywhere"}
    errors = []
    for subdivisions in (2, 3, 4):
        problem = on_sphere(tmp_path, subdivisions, order, [DIFFUSION, REACTION, source])
        values, points = solved(problem)[: len(problem.mesh.points)], problem.mesh.points
        errors.append(np.sqrt(np.mean((values - points[:, 0] * points[:, 1]) ** 2)))
    assert np.log2(errors[-2] / errors[-1]) == pytest.approx(2, abs=0.1)


@pytest.mark.slow
def test_eigenvalues_on_the_sphere_are_of_order_two(tmp_path) -> None:
    # l (l + 1), each 2 l + 1 times: 0, 2 (3 times), 6 (5 times).
    errors = []
    for subdivisions in (2, 3, 4):
        stiffness, _ = scikit_fem.assemble(on_sphere(tmp_path, subdivisions, 1, [DIFFUSION, REACTION]))
        halved, _ = scikit_fem.assemble(on_sphere(tmp_path, subdivisions, 1, [DIFFUSION, REACTION | {"rate": 2.0}]))
        mass = halved - stiffness
        start = np.random.default_rng(0).normal(size=mass.shape[0])
        found = eigsh(stiffness - mass, k=9, M=mass, sigma=-0.5, v0=start, return_eigenvectors=False)
        errors.append(np.abs(np.sort(found) - [0, 2, 2, 2, 6, 6, 6, 6, 6]))
    assert np.max(errors[-1]) < 0.05
    orders = np.log2(errors[-2][1:] / errors[-1][1:])
    assert orders == pytest.approx(np.full(8, 2.0), abs=0.1)
    assert errors[-1][0] < 1e-10


def test_a_matrix_without_a_solution_is_a_status(tmp_path) -> None:
    # -psi'' + c psi = 0, psi = 0 at both ends, resonates at c = -pi^2; on three elements at -6 / 5 h^2 = -10.8: the symmetric
    # mode of stiffness 1 / h and mass 5 h / 6.
    scene = fields.scene(
        tmp_path,
        domain={"nodes": [0.0, 1 / 3, 2 / 3, 1.0]},
        effect=[DIFFUSION, {"name": "reaction", "rate": -10.8}],
        boundary=[{"on": "left", "value": 0}, {"on": "right", "value": 0}],
    )
    solution = scikit_fem.solve_field(build(scene), ScikitFieldSettings())
    assert solution.outcome.status == "diverged"
    assert "no unique solution" in solution.outcome.message
    assert np.isnan(solution.values).all()
