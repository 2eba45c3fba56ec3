"""What is compared of two solvers is what it says."""

import numpy as np
import pytest

from fem_reference.runs.store import Frame
from fem_reference.verification.second_opinion import differences


def test_each_kind_of_difference_is_felt() -> None:
    rest = np.zeros((2, 3))

    def state(x: float = 2.0, energy: float = 4.0, force: float = 5.0, moment: float = 8.0) -> Frame:
        points = np.array([[0.0, 0.0, x], [1.0, 0.0, 0.0]])
        forces, moments = {"top": np.array([force, 1.0, 0.0])}, {"top": np.array([0.0, 0.0, moment])}
        return Frame(1.0, points=points, forces=forces, moments=moments, scalars={"energy": energy})

    def changed(**values: float) -> dict[str, float]:
        return {name: value for name, value in differences(state(), state(**values), rest).items() if value}

    assert changed() == {}
    assert changed(x=2.5) == {"positions": 0.25}
    assert changed(energy=5.0) == {"energy": 0.25}
    assert changed(force=6.0) == {"forces": pytest.approx(0.2, rel=1e-15)}
    assert changed(moment=6.0) == {"moments": 0.25}
