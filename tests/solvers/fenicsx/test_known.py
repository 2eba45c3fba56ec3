"""States of earlier frames: taken up where all that acts is the same, the latest ones as far as memory goes."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference.solvers.fenicsx import known


def state(*acting: float) -> known.KnownState:
    return known.KnownState(np.array(acting), np.zeros(3), None)


def test_a_state_is_known_where_nothing_that_acts_differs_by_more_than_rounding() -> None:
    states = known.Known(MPI.COMM_SELF)
    assert states.find(np.array([0.0, 1.0])) is None
    here, there = state(0.0, 1.0), state(0.0, 2.0)
    states.add(here)
    states.add(there)
    assert states.find(np.array([1e-10, 1.0])) is here
    assert states.find(np.array([0.0, 2.0])) is there
    assert states.find(np.array([1e-6, 1.0])) is None  # a nanometre is another load
    assert states.find(np.array([0.0, 1.5])) is None


def test_the_latest_states_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(known, "_MOST", 2 * (3 + 1) * 8.0)  # bytes, two states of four numbers
    states = known.Known(MPI.COMM_SELF)
    for i in range(3):
        states.add(state(float(i)))
    assert states.find(np.array([0.0])) is None
    assert [states.find(np.array([float(i)])) is not None for i in (1, 2)] == [True, True]
