"""Forces and moments of external loads."""

import numpy as np
from numpy.testing import assert_allclose

from fem_reference.foundations.loads import Wrench, dead, total


class Half:
    """A volume of 8 about (1, 2, 3), and a region of 2 about (0, 0, 5)."""

    def measure(self, on=None):
        return (8.0, 8 * np.array([1.0, 2, 3])) if on is None else (2.0, 2 * np.array([0.0, 0, 5]))

    def facing(self, _):
        return None

    def motion(self):
        return None


def test_a_dead_load_acts_at_the_mean_place() -> None:
    weight = dead((0, 0, -0.5), Half())
    assert_allclose(weight.force, [0, 0, -4])
    assert_allclose(weight.moment, np.cross([1, 2, 3], [0, 0, -4]))
    pulled = dead((1, 0, 0), Half(), "top")
    assert_allclose(pulled.moment, np.cross([0, 0, 5], [2, 0, 0]))
    assert_allclose(total([weight, pulled]).force, [2, 0, -4])
    assert_allclose(total([weight, pulled]).moment, weight.moment + pulled.moment)


def test_no_loads_are_nothing() -> None:
    assert isinstance(total([]), Wrench)
    assert_allclose(total([]), np.zeros((2, 3)))
