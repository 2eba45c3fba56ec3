"""Jets against derivatives by hand and by finite differences."""

import numpy as np
import pytest
from acting import ENERGIES, FIBRE, deformations, make

from fem_reference.effects import State
from fem_reference.foundations.jets import JET_FUNCTIONS, Jet, constant, variables
from fem_reference.foundations.material_point import NUMPY

FUNCTIONS = JET_FUNCTIONS
X = np.linspace(0.3, 1.7, 5)
# Each function of one variable beside its value and derivatives by hand.
BY_HAND = {
    "exp": (lambda x: FUNCTIONS.exp(2 * x), np.exp(2 * X), 2 * np.exp(2 * X), 4 * np.exp(2 * X)),
    "log": (FUNCTIONS.log, np.log(X), 1 / X, -1 / X**2),
    "sqrt": (FUNCTIONS.sqrt, X**0.5, 0.5 * X**-0.5, -0.25 * X**-1.5),
    "cos": (FUNCTIONS.cos, np.cos(X), -np.sin(X), -np.cos(X)),
    "sin": (FUNCTIONS.sin, np.sin(X), np.cos(X), -np.sin(X)),
    "power": (lambda x: x ** (-2 / 3), X ** (-2 / 3), -2 / 3 * X ** (-5 / 3), 10 / 9 * X ** (-8 / 3)),
    "difference": (lambda x: 1 - (x - X) - x, 1 - X, -2 + 0 * X, 0 * X),
    "quotient": (lambda x: (2 - x) / x, 2 / X - 1, -2 / X**2, 4 / X**3),
    "over": (lambda x: X / (X * x), 1 / X, -1 / X**2, 2 / X**3),
    "above": (lambda x: FUNCTIONS.above(x, 1.0, x**3, 2 * x), np.where(X > 1, X**3, 2 * X),
              np.where(X > 1, 3 * X**2, 2), np.where(X > 1, 6 * X, 0)),
    "above of a number": (lambda x: FUNCTIONS.above(x, 1.0, x * x, 7.0), np.where(X > 1, X**2, 7),
                          np.where(X > 1, 2 * X, 0), np.where(X > 1, 2, 0)),
}  # fmt: skip


@pytest.mark.parametrize("name", BY_HAND)
def test_derivatives_by_hand(name) -> None:
    function, value, slope, curvature = BY_HAND[name]
    (x,) = variables(X[None])
    jet = function(x)
    for got, expected in ((jet.value, value), (jet.slope[0], slope), (jet.curvature[0, 0], curvature)):
        # A handful of roundings of numbers up to 120.
        assert np.broadcast_to(got, X.shape) == pytest.approx(expected, rel=1e-13, abs=1e-13)
    flat = function(*variables(X[None], curved=False))  # nobody asks for the curvature
    assert (np.array_equal(flat.value, jet.value), np.array_equal(flat.slope, jet.slope)) == (True, True)
    assert flat.curvature is None


def test_mixed_derivatives_by_hand() -> None:
    # f = x^2 y / z
    x, y, z = values = np.array([[1.0, 2.0], [3.0, -1.0], [0.5, 4.0]])
    a, b, c = variables(values)
    jet = a**2 * b / c
    hessian = [
        [2 * y / z, 2 * x / z, -2 * x * y / z**2],
        [2 * x / z, 0 * x, -(x**2) / z**2],
        [-2 * x * y / z**2, -(x**2) / z**2, 2 * x**2 * y / z**3],
    ]
    assert jet.value == pytest.approx(x**2 * y / z, rel=1e-14)
    assert jet.slope == pytest.approx(np.array([2 * x * y / z, x**2 / z, -(x**2) * y / z**2]), rel=1e-14)
    assert jet.curvature == pytest.approx(np.array(hessian), rel=1e-14, abs=1e-14)


def test_powers_at_zero_have_their_derivatives() -> None:
    (x,) = variables(np.zeros((1, 1)))
    assert [float((x**e).slope.item()) for e in (0, 1, 2)] == [0, 1, 0]
    assert [float((x**e).curvature.item()) for e in (0, 1, 2)] == [0, 0, 2]


def test_arrays_and_numbers_leave_it_to_the_jet() -> None:
    (x,) = variables(X[None])
    for jet in (X * x, X + x, X - x, X / x, np.float64(2) * x, sum([x, x])):
        assert isinstance(jet, Jet)
    assert (X - x).value == pytest.approx(np.zeros(5))
    assert constant(3.0, x).value == pytest.approx(np.full(5, 3.0))
    assert not constant(3.0, x).slope.any()


def test_functions_of_numbers_and_arrays_are_those_of_numpy() -> None:
    for name in ("exp", "log", "sqrt", "cos", "sin"):
        assert getattr(FUNCTIONS, name)(X) == pytest.approx(getattr(np, name)(X), rel=1e-15)
        assert float(getattr(FUNCTIONS, name)(2.0)) == pytest.approx(float(getattr(np, name)(2.0)), rel=1e-15)
    assert FUNCTIONS.above(X, 1.0, 1.0, 0.0).tolist() == (X > 1).tolist()


@pytest.mark.parametrize("name", ENERGIES)
def test_stress_and_stiffness_of_every_energy(name) -> None:
    effect = make(name)
    here = np.array([np.append(F.ravel(), [0.3, -0.2, 0.5, 0.3]) for F in deformations()]).T

    def at(entries, functions) -> object:
        F = [entries[0:3], entries[3:6], entries[6:9]]
        return effect.energy(State(F, entries[9:12], entries[12], FIBRE, functions=functions))

    def jet(values: np.ndarray) -> Jet:
        found = at(variables(values), FUNCTIONS)
        ones = np.ones(values.shape[1])
        return Jet(found.value * ones, found.slope * ones, found.curvature * ones)

    exact, step = jet(here), 1e-6
    assert exact.value == pytest.approx(at(here, NUMPY), rel=1e-12, abs=1e-14)
    for i in range(13):
        move = step * np.eye(13)[i][:, None]
        late, early = jet(here + move), jet(here - move)
        # Central differences: rounding over the step, 2e-10, times exponents of about 10; the squared step adds nothing.
        for got, less, more in ((exact.slope, early.value, late.value), (exact.curvature, early.slope, late.slope)):
            size = max(np.abs(less).max(), np.abs(got[i]).max())
            assert got[i] == pytest.approx((more - less) / (2 * step), abs=1e-8 * size + 1e-12)
