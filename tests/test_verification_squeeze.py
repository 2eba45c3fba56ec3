"""The entries on squeezed blocks: each passes, and fails with its spoil."""

import importlib.util

import pytest

from fem_reference.catalogue import Entry, result
from fem_reference.verification.lab import lab
from fem_reference.verification.squeeze import ENTRIES


@pytest.fixture(scope="module")
def place():
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    with lab() as opened:
        yield opened


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_entry_passes(entry: Entry, place) -> None:
    found = result(entry, entry.measure(place), 0.0, spoiled=False)
    assert found.word == "pass", (found.finding, found.error)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_spoil_fails_clearly(entry: Entry, place) -> None:
    found = result(entry, entry.spoiled(place), 0.0, spoiled=True)
    assert found.error >= 10 * found.within, found.finding


def test_a_squeezed_block_tells_of_its_smallest_determinant(place) -> None:
    note = next(entry for entry in ENTRIES if entry.name == "bonded_squeeze_is_inverted").measure(place).note
    # The corner folds over at its vertex while det F is far from zero at all quadrature points.
    assert "inverted: Newton's method converged, but det F fell to -0.0" in note
    assert "at a vertex" in note
