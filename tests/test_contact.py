"""The law of contact: a pressure that is the slope of an energy, without a jump in itself or in its slope."""

import numpy as np
import pytest

from fem_reference.contact import Contact

D, K = 0.1, 2.0
LAW = Contact("top", K, D)


def test_the_slope_is_that_of_the_pressure() -> None:
    # Central differences; the law is quadratic by pieces, so that they are exact away from its joints.
    gaps = np.array([-0.5, -0.15, -0.05, 0.0, 0.07, 0.15, 2.0])
    pressure, slope = LAW.pressure(gaps)
    after, before = (LAW.pressure(gaps + sign * 1e-6)[0] for sign in (1, -1))
    assert slope == pytest.approx((after - before) / 2e-6, abs=1e-9)
    assert (pressure >= 0).all()


def test_it_begins_at_the_smoothing_and_is_a_spring_deep_inside() -> None:
    pressure, slope = LAW.pressure(np.array([D, 0.0, -D, -1.0]))
    assert pressure == pytest.approx([0, K * D / 4, K * D, K * 1.0])
    assert slope == pytest.approx([0, -K / 2, -K, -K])


def test_neither_pressure_nor_slope_jumps() -> None:
    for joint in (D, -D):
        (before, after), slopes = LAW.pressure(np.array([joint - 1e-9, joint + 1e-9]))
        assert before == pytest.approx(after, abs=1e-8)
        assert slopes[0] == pytest.approx(slopes[1], abs=1e-7)
