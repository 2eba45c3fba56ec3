"""Blocks under plates, weights and pressure, against minima of energy, quadrature and the general law."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import minimize_scalar

from validation import homogeneous, laws, loads

MU, BULK = 0.01, 0.5


def stored(stretch: float, across: float) -> float:
    """Energy per rest volume [MPa] of a block stretched along one axis and across it."""
    J = stretch * across**2
    return MU / 2 * (J ** (-2 / 3) * (stretch**2 + 2 * across**2) - 3) + BULK / 2 * (J - 1) ** 2


@pytest.mark.parametrize("stretch", [0.125, 0.5, 1.0, 1.7])
def test_a_squeezed_block_takes_the_width_of_least_energy(stretch: float) -> None:
    guess = stretch**-0.5
    least = minimize_scalar(
        lambda across: stored(stretch, across),
        bounds=(0.7 * guess, 1.4 * guess),
        method="bounded",
        options={"xatol": 1e-12},
    )
    found = np.sqrt(loads.squeezed_volume(MU, BULK, stretch) / stretch)
    assert found == pytest.approx(least.x, rel=1e-6)  # a minimum is flat: the root of rounding


@pytest.mark.parametrize("stretch", [0.125, 0.5, 1.7])
def test_the_plate_does_the_work_of_squeezing(stretch: float) -> None:
    def energy(at: float) -> float:
        return stored(at, np.sqrt(loads.squeezed_volume(MU, BULK, at) / at)) * 12.0

    near, far = ((energy(stretch + s) - energy(stretch - s)) / (2 * s) for s in (1e-4, 2e-4))
    assert loads.squeeze_force(MU, BULK, stretch, 12.0) == pytest.approx((4 * near - far) / 3, rel=1e-8)


@pytest.mark.parametrize("stretch", [0.5, 1.7])
def test_the_plate_pulls_as_the_law_says(stretch: float) -> None:
    state = homogeneous.pulled(laws.neo_hooke(MU), BULK, loads.squeeze_force(MU, BULK, stretch, 3.0) / 3.0)
    assert stretch == pytest.approx(state.stretches[0], rel=1e-11)


@pytest.mark.parametrize("stretch", [0.4, 0.9, 1.0, 1.6])
def test_confined_stress_is_that_of_the_law(stretch: float) -> None:
    P = homogeneous.nominal_stress(laws.neo_hooke(MU), BULK, np.diag([1.0, 1.0, stretch]), laws.X)
    assert loads.confined_stress(MU, BULK, stretch) == pytest.approx(P[2, 2], rel=1e-12, abs=1e-16)


@pytest.mark.parametrize("stress", [-20.0, -0.3, 0.0, 0.2, 5.0])
def test_confined_stretch_undoes_confined_stress(stress: float) -> None:
    stretch = loads.confined_stretch(MU, BULK, stress)
    # near 1 the stress has the rounding of the stretch times K; far below it grows as the stretch^(-8/3)
    assert loads.confined_stress(MU, BULK, stretch) == pytest.approx(stress, rel=1e-9, abs=1e-14)


@pytest.mark.parametrize("weight", [0.01, 0.001, -0.004])
def test_the_top_of_a_column_sinks_by_what_every_slice_loses(weight: float) -> None:
    height = 30.0
    lost = quad(lambda Z: loads.confined_stretch(MU, BULK, -weight * (height - Z)) - 1, 0, height, epsrel=1e-12)[0]
    assert loads.column_top(MU, BULK, weight, height) == pytest.approx(lost, rel=1e-9)


def test_a_light_column_sinks_as_in_small_strain() -> None:
    """``-weight H^2 / (2 (K + 4 mu / 3))``; the next term is of the order of the strain, 1e-5."""
    weight, height = 1e-7, 30.0
    truth = -weight * height**2 / (2 * (BULK + 4 * MU / 3))
    assert loads.column_top(MU, BULK, weight, height) == pytest.approx(truth, rel=1e-5)


def test_a_body_in_a_fluid_has_the_pressure_of_the_fluid() -> None:
    pressure = 0.1
    F = np.cbrt(loads.pressed_volume(BULK, pressure)) * np.eye(3)
    P = homogeneous.nominal_stress(laws.neo_hooke(MU), BULK, F, laws.X)
    assert P @ F.T / np.linalg.det(F) == pytest.approx(-pressure * np.eye(3), abs=1e-15)
