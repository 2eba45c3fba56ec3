"""Stored energy as a metric: differences, runs without any, and a bar that covers a mesh of half the size."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small
from numpy.testing import assert_allclose

from fem_reference.metrics import at_rest, change, context_of, find, measure
from fem_reference.problems.of_case import setup
from fem_reference.studies import workflow
from tests.metrics.test_joint_moment import context, pulled


def test_differences_from_the_reference_and_the_energy_itself() -> None:
    run, other = (replace(pulled(), scalars={"energy": np.array(values)}) for values in ((0, 5, 9), (0, 2, np.nan)))
    given, bare = context(run), pulled()
    (itself,), (off,) = (measure(run, of, given, ["energy"]) for of in (at_rest(run), other))
    assert_allclose(itself.values, [0, 5, 9])
    assert_allclose(off.values, [0, 3, np.nan])
    assert itself.unit == "N mm"
    assert measure(bare, run, given, ["energy"]) == measure(run, bare, given, ["energy"]) == ()


@pytest.mark.slow
def test_the_bar_covers_a_mesh_of_half_the_size_which_is_softer(tmp_path: Path) -> None:
    """A bar whose end turns by 0.2 rad: of more shapes the least energy is less."""
    found = []
    for size in ("6 mm", "3 mm"):
        changes = {"frames.last": 5, "frames.every": 5, "muscle.tet_size": size}
        case = workflow.load_case(small.write(tmp_path / size[0]), changes)
        run = workflow.solve(case, store=tmp_path / "store")
        found.append((case, run, find(change(run, context_of(setup(case), run), ["energy"]), "energy", "stored")))
    (case, run, coarse), (*_, fine) = found
    bars = workflow.error_bars(case, run, store=tmp_path / "store")
    assert bars is not None
    assert coarse is not None
    assert fine is not None
    bar = bars.find("change", "energy", "stored")
    assert bar is not None
    assert 0 < coarse.values[-1] - fine.values[-1] <= bar.values[-1]
    assert bar.values[-1] < 0.3 * fine.values[-1]
