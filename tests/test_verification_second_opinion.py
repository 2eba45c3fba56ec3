"""The entries on two solvers: each passes, fails with its spoil, and what is compared is what it says."""

import importlib.util

import numpy as np
import pytest

from fem_reference.catalogue import Entry, result
from fem_reference.continuum import Reached
from fem_reference.verification.lab import lab
from fem_reference.verification.second_opinion import ENTRIES, differences

CHEAP = [entry for entry in ENTRIES if entry.name != "second_opinion_mooney_rivlin"]


@pytest.fixture(scope="module")
def place():
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    with lab() as opened:
        yield opened


@pytest.mark.parametrize("entry", CHEAP, ids=lambda entry: entry.name)
def test_entry_passes(entry: Entry, place) -> None:
    found = result(entry, entry.measure(place), 0.0, spoiled=False)
    assert found.word == "pass", (found.finding, found.error)


@pytest.mark.parametrize("entry", CHEAP, ids=lambda entry: entry.name)
def test_spoil_fails_clearly(entry: Entry, place) -> None:
    # One percent of a modulus is some tenths of a percent of a force or an energy.
    found = result(entry, entry.spoiled(place), 0.0, spoiled=True)
    assert found.error > 1e-3, found.finding


def test_each_way_to_differ_is_felt() -> None:
    rest = np.zeros((2, 3))

    def state(x: float = 2.0, energy: float = 4.0, force: float = 5.0, moment: float = 8.0) -> Reached:
        points = np.array([[0.0, 0.0, x], [1.0, 0.0, 0.0]])
        forces, moments = {"top": np.array([force, 1.0, 0.0])}, {"top": np.array([0.0, 0.0, moment])}
        return Reached(1.0, points, forces, moments, {"energy": energy})

    def changed(**values: float) -> dict[str, float]:
        return {name: value for name, value in differences(state(), state(**values), rest).items() if value}

    assert changed() == {}
    assert changed(x=2.5) == {"positions": 0.25}
    assert changed(energy=5.0) == {"energy": 0.25}
    assert changed(force=6.0) == {"forces": pytest.approx(0.2, rel=1e-15)}
    assert changed(moment=6.0) == {"moments": 0.25}
