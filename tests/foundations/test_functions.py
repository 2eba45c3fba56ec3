"""Functions of expressions in numpy."""

import numpy as np
import pytest

from fem_reference.foundations.functions import Numpy

X = np.array([0.2, 1.0, 3.0])


def test_they_are_inverse_to_each_other() -> None:
    assert Numpy.log(Numpy.exp(X)) == pytest.approx(X)
    assert Numpy.sqrt(X) ** 2 == pytest.approx(X)
    assert Numpy.cos(X) ** 2 + Numpy.sin(X) ** 2 == pytest.approx(np.ones(3))


def test_above_is_strict_and_takes_arrays() -> None:
    assert Numpy.above(X, 1.0, 10 * X, -X).tolist() == [-0.2, -1.0, 30.0]
