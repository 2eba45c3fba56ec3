"""Scalar fields in FEniCSx agree with the second opinion and closed forms."""

import importlib
import importlib.util
from dataclasses import replace

import fields
import numpy as np
import pytest

from fem_reference.problems.scalar import FieldProblem, Flux, build
from fem_reference.runs.store import Run
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx import FieldSettings
from tests.solvers.fenicsx.test_session import resonant

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")),
        reason="FEniCSx is not installed",
    ),
]


DIFFUSION = {"name": "diffusion", "coefficient": 0.7}


def assert_agrees(problem: FieldProblem) -> Run:
    """Both discretisations are the same and their quadrature exact for the formulas here: they differ by rounding, 1e-9 at most."""
    solution = fenicsx.solve_field(problem, FieldSettings())
    peer = scikit_fem.solve_field(problem, scikit_fem.ScikitFieldSettings())
    assert (solution.outcome.status, peer.outcome.status) == ("converged", "converged")
    assert np.abs(solution.values - peer.values).max() <= 1e-9 * np.abs(peer.values).max()
    assert solution.outcome.cost["unknowns"] == peer.outcome.cost["unknowns"]
    assert np.ptp(peer.values) > 0.1  # there is something to agree on
    return solution


@pytest.mark.parametrize(("order", "form"), [(1, "galerkin"), (2, "supg")])
def test_an_interval(tmp_path, order, form) -> None:
    # The formulas are no polynomials: here both take Gauss's rule of 5 points.
    scene = fields.scene(
        tmp_path,
        domain={"interval": {"start": -1.0, "end": 2.0, "count": 12, "seed": 3}},
        effect=[
            DIFFUSION,
            {"name": "advection", "velocity": [3.0]},
            {"name": "reaction", "rate": 0.4},
            {"name": "source", "strength": "sin(pi*x) + exp(-x)*sqrt(x + 2) - tanh(x)/cos(x/2)", "where": "everywhere"},
        ],
        boundary=[{"on": "left", "value": 0.5}, {"on": "right", "slope": "1 - x**2"}],
        element=fields.element(order, form),
    )
    assert_agrees(build(scene))


@pytest.mark.parametrize("order", [1, 2])
def test_a_plate_with_a_slope_on_part_of_its_rim(tmp_path, order) -> None:
    scene = fields.scene(
        tmp_path,
        domain=fields.square(tmp_path, 6),
        effect=[
            DIFFUSION,
            {"name": "advection", "velocity": [1.0, -2.0]},
            {"name": "reaction", "rate": 0.4},
            {"name": "source", "strength": "5*x*y + x**3", "where": "y above average"},
        ],
        boundary=[
            {"on": "rim", "where": "0.05 - x", "value": "y**2"},
            {"on": "rim", "where": "x - 0.95", "slope": "2 - y**2"},
            {"on": "rim", "where": "y - 0.85", "slope": "x"},  # meets the facets of no other, but their vertices
        ],
        element=fields.element(order),
    )
    problem = build(scene)
    assert [len(flux.facets) for flux in problem.fluxes] == [5, 5]
    assert_agrees(problem)


@pytest.mark.parametrize("order", [1, 2])
def test_a_plate_stabilised_along_the_flow(tmp_path, order) -> None:
    scene = fields.scene(
        tmp_path,
        domain=fields.square(tmp_path, 6),
        effect=[
            {"name": "diffusion", "coefficient": 0.001},
            {"name": "advection", "velocity": [1.0, 0.5]},
            {"name": "reaction", "rate": 0.4},
            {"name": "source", "strength": "1 + x*y", "where": "everywhere"},
        ],
        boundary=[{"on": "rim", "value": "x - y"}],
        element=fields.element(order, "supg"),
    )
    problem = build(scene)
    assert problem.peclet > 20
    assert_agrees(problem)


def test_a_quadratic_field_is_met_exactly(tmp_path) -> None:
    # It is in the space, and the stabilised form adds nothing to a field without residual: 1e-10 for rounding.
    scene = fields.scene(
        tmp_path,
        domain=fields.square(tmp_path, 6),
        effect=[
            {"name": "diffusion", "coefficient": 0.05},
            {"name": "advection", "velocity": [3.0, -2.0]},
            {"name": "reaction", "rate": 0.4},
            {
                "name": "source",
                "strength": "-0.05*2 + 3*(2*x - y) - 2*(-x) + 0.4*(x**2 - x*y + 2)",
                "where": "everywhere",
            },
        ],
        boundary=[
            *({"on": "rim", "where": side, "value": "x**2 - x*y + 2"} for side in ("0.05 - x", "0.05 - y", "y - 0.95")),
            {"on": "rim", "where": "x - 0.95", "slope": "2*x - y"},
        ],
        element=fields.element(2, "supg"),
    )
    problem = build(scene)
    x, y = problem.mesh.nodes[2].T
    assert fenicsx.solve_field(problem, FieldSettings()).values[0] == pytest.approx(x**2 - x * y + 2, abs=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_a_closed_surface_fixed_at_some_vertices(tmp_path, order) -> None:
    (tmp_path / "bounds.csv").write_text("3,8,1\n1,-1,0.5\n")
    scene = fields.scene(
        tmp_path,
        domain=fields.sphere(tmp_path),
        effect=[
            DIFFUSION,
            {"name": "advection", "velocity": [1.0, 2.0, -3.0]},
            {"name": "source", "strength": "x*z - y", "where": "everywhere"},
        ],
        boundary=[{"bounds": "bounds.csv"}],
        element=fields.element(order, "supg" if order == 2 else "galerkin"),
    )
    problem = build(scene)
    values = assert_agrees(problem).values[0]
    assert values[[2, 7, 0]].tolist() == [1, -1, 0.5]


def test_equations_without_a_unique_solution_are_a_status(tmp_path) -> None:
    solution = fenicsx.solve_field(resonant(tmp_path), FieldSettings())
    assert solution.outcome.status == "diverged"
    assert "no unique solution (null pivots in their factorisation: 1)" in solution.outcome.message
    assert np.isnan(solution.values).all()
    assert solution.values[0].shape == (3,)


def test_a_formula_without_a_value_is_a_status(tmp_path) -> None:
    problem = resonant(tmp_path)
    right = np.array([[2]])
    solution = fenicsx.solve_field(replace(problem, fluxes=(Flux(right, "sqrt(-x)"),)), FieldSettings())
    assert solution.outcome.status == "diverged"
    assert "a formula may have no value somewhere" in solution.outcome.message
    assert np.isnan(solution.values).all()
