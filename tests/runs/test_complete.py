"""Runs over all frames of a case: what was not reached is not a number."""

import numpy as np
import shapes

from fem_reference.runs.complete import complete
from fem_reference.runs.store import Outcome, Run


def test_frames_that_were_not_reached_are_not_numbers() -> None:
    rest = shapes.sphere(0)
    positions = np.stack([rest.points, rest.points + 1])
    run = Run(
        "one", "test", Outcome("diverged", "no"), (0, 10), rest, positions, scalars={"energy": np.array([1.0, 2.0])}
    )
    whole = complete(run, (0, 5, 10))
    assert whole.numbers == (0, 5, 10)
    assert np.array_equal(whole.positions[[0, 2]], positions)
    assert np.isnan(whole.positions[1]).all()
    assert whole.fibre_positions is None
    assert np.array_equal(whole.scalars["energy"], [1, np.nan, 2], equal_nan=True)
    assert complete(run, (0, 10)) is run


def test_fibres_and_frames_that_are_not_wanted() -> None:
    rest = shapes.sphere(0)
    moved = np.arange(18.0).reshape(3, 2, 3)
    run = Run(
        "one",
        "test",
        Outcome("converged", ""),
        (0, 5, 10),
        rest,
        np.zeros((3, *rest.points.shape)),
        fibre_positions=moved,
    )
    whole = complete(run, (5, 15))
    assert whole.positions.shape == (2, *rest.points.shape)
    assert whole.fibre_positions is not None
    assert np.array_equal(whole.fibre_positions[0], moved[1])
    assert np.isnan(whole.fibre_positions[1]).all()
