"""The equations of the second opinion: forces are slopes of the energy, the tangent that of the forces."""

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.solvers.scikit_fem import ScikitBodySettings, solve_body
from fem_reference.solvers.scikit_fem.equations import Equations
from fem_reference.verification import regions
from tests.solvers.scikit_fem.test_body import loaded


@pytest.mark.parametrize("element", ["P1", "P2/P1", "Q1/P0"])
def test_the_tangent_is_the_slope_of_the_forces(element) -> None:
    equations = Equations(loaded(element), element, None)
    random = np.random.default_rng(1)
    here, direction = 0.05 * random.normal(size=(2, equations.space.size))
    step = 1e-5
    late, early = (equations.assembled(here + sign * step * direction, 1.0)[0] for sign in (1, -1))
    _, tangent = equations.assembled(here, 1.0)
    # Central differences: step squared times third derivatives of about 1e3, and rounding of forces of about 10 N over the step.
    assert tangent @ direction == pytest.approx((late - early) / (2 * step), abs=1e-7)


@pytest.mark.parametrize("element", ["P2", "P2/P0", "Q2/Q1"])
def test_forces_are_the_slope_of_the_energy(element) -> None:
    given = loaded(element)
    equations = Equations(Body(given.mesh, given.effects[:-1], (), (0.0, 1.0), given.fibre), element, None)
    random = np.random.default_rng(2)
    here, direction = 0.03 * random.normal(size=(2, equations.space.size))
    step = 1e-5
    slope = (equations.energy(here + step * direction, 1.0) - equations.energy(here - step * direction, 1.0)) / (
        2 * step
    )
    assert equations.assembled(here, 1.0)[0] @ direction == pytest.approx(slope, abs=1e-7)


def test_a_bar_of_two_materials_in_series_has_the_force_of_the_closed_form():
    """With its border on faces of cells: rounding is left, and Newton's residual of 1e-10 N of 0.15 N."""
    solved = solve_body(regions.bar("P2", 5, 0.0), ScikitBodySettings(element="P2"))
    assert solved.last.forces["x1"][0] == pytest.approx(regions.truth(0.0), rel=1e-8)


def test_a_membrane_is_refused():
    body = Body(
        shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"),
        (make("membrane", on="z1", thickness=1.0, mu=1.0),),
        (),
        (0, 1),
    )
    with pytest.raises(
        InputError, match="effects: got membrane, want other effects: this solver has no surface energies"
    ):
        solve_body(body, ScikitBodySettings(element="P2"))
