"""Creep in the catalogue: its rate is read from two heights."""

import numpy as np
import pytest

from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.verification import damping


def test_a_rate_is_that_of_an_exponential() -> None:
    # 10 + e^(-3 t) at t = 0.5 and 1.5, above a height of 10 at rest: the rate is 3.
    heights = (10.0, 10 + np.exp(-1.5), 10 + np.exp(-4.5))
    states = [Frame(i, points=np.array([[0.0, 0.0, 0.0], [0.0, 0.0, z]])) for i, z in enumerate(heights)]
    run = collected(states, Outcome("converged", "", {}))
    assert damping.relaxation_rate(run, (1, 2), 1.0) == pytest.approx(3, rel=1e-12)
