"""The state at a point: invariants against numpy's, and those of simple shear and of extension by hand."""

import numpy as np
import pytest

from fem_reference.foundations.material_point import NUMPY, State

X = np.array([0.2, 1.0, 3.0])
F = np.eye(3) + np.random.default_rng(4).uniform(-0.3, 0.3, (3, 3))


def invariants(state: State) -> tuple[float, float, float]:
    return state.J, state.I1, state.I2


def test_invariants_are_those_of_the_matrix() -> None:
    state, C = State(F=F.tolist()), F.T @ F
    by_numpy = (np.linalg.det(F), np.trace(C), (np.trace(C) ** 2 - np.trace(C @ C)) / 2)
    assert invariants(state) == pytest.approx(by_numpy)
    assert np.array(state.C) == pytest.approx(C)
    assert np.array(state.cofactors) == pytest.approx(np.linalg.det(F) * np.linalg.inv(F).T)
    a = np.array([0.6, 0.0, 0.8])
    assert state.square_stretch(a) == pytest.approx(a @ C @ a)


def test_simple_shear_by_hand() -> None:
    k = 0.5
    state = State(F=[[1, k, 0], [0, 1, 0], [0, 0, 1]], fibre=(0.0, 1.0, 0.0))
    assert invariants(state) == pytest.approx((1, 3 + k**2, 3 + k**2))
    assert state.fibre_stretch == pytest.approx((1 + k**2) ** 0.5)


def test_the_fibre_stretch_has_no_share_in_a_change_of_volume() -> None:
    swollen = State(F=(1.7 * np.eye(3)).tolist(), fibre=(0.0, 0.6, 0.8))
    assert swollen.fibre_stretch == pytest.approx(1.0)


@pytest.mark.parametrize(("x", "found"), [(-3.0, 1.0), (1.5, 1.5), (9.0, 2.0)])
def test_a_value_stays_between_its_bounds(x, found) -> None:
    assert State(F=np.eye(3).tolist()).between(1.0, 2.0, x) == found


def test_functions_are_inverse_to_each_other() -> None:
    assert NUMPY.log(NUMPY.exp(X)) == pytest.approx(X)
    assert NUMPY.sqrt(X) ** 2 == pytest.approx(X)
    assert NUMPY.cos(X) ** 2 + NUMPY.sin(X) ** 2 == pytest.approx(np.ones(3))


def test_above_is_strict_and_takes_arrays() -> None:
    assert NUMPY.above(X, 1.0, 10 * X, -X).tolist() == [-0.2, -1.0, 30.0]
