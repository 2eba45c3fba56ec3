"""Reasons to doubt a reference: each from what its run recorded, none of a run that recorded nothing wrong."""

import numpy as np
import pytest

from fem_reference.assessment.doubts import doubts
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.foundations.mesh import Surface
from fem_reference.runs.store import Outcome, Run

REST = Surface(np.eye(3), np.array([[0, 1, 2]]))


def reference(status: str = "converged", **scalars: list[float]) -> Run:
    values = {name: np.array(each) for name, each in scalars.items()}
    positions = np.broadcast_to(REST.points, (3, 3, 3))
    return Run("reference", "fenicsx", Outcome(status, ""), (0, 10, 20), REST, positions, scalars=values)


def test_a_run_that_recorded_nothing_wrong_is_not_doubted() -> None:
    assert doubts(reference()) == []
    fine = {"negative_modes": [0, np.nan, 0], "min_det_F": [1, 0.5, 0.11], "outside_law": [0, 0, np.nan]}
    assert doubts(reference(**fine, energy_gap=[0, 0.9 * ENERGY_GAP, np.nan])) == []


@pytest.mark.parametrize(
    ("scalars", "why"),
    [
        ({"negative_modes": [0, 1, 2]}, "unstable equilibrium in 2 of 3 frames"),
        ({"min_det_F": [1, 0.5, 0.2], "min_det_F_quadrature": [1, 0.05, 0.4]}, "det F falls to 0.0500"),
        (
            {"outside_law": [0, 1, 1]},
            "cells are outside the range that a law is meant for in 2 of 3 frames, first in 10",
        ),
        ({"energy_gap": [0, -0.135, 0.1]}, "-13.5 % of the energy without work at frame 10"),
    ],
)
def test_each_reason_says_where(scalars: dict[str, list[float]], why: str) -> None:
    (found,) = doubts(reference(**scalars))
    assert found.startswith(why)


def test_what_ended_early_and_is_unstable_has_both_reasons() -> None:
    assert doubts(reference("timed out", negative_modes=[1, 0, 0])) == [
        "timed out",
        "unstable equilibrium in 1 of 3 frames",
    ]
