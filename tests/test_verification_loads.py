"""Entries of weights, pressures and dead forces find their truths, and miss them when something is wrong."""

import pytest

from fem_reference.catalogue import Entry, result
from fem_reference.verification.lab import lab
from fem_reference.verification.loads import ENTRIES


@pytest.fixture(scope="module")
def laboratory():
    with lab() as opened:
        yield opened


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_passes(entry: Entry, laboratory) -> None:
    found = result(entry, entry.measure(laboratory), 0.0, spoiled=False)
    assert found.word == "pass", (found.finding.value, found.truth, found.within)


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.name)
def test_its_spoil_fails_clearly(entry: Entry, laboratory) -> None:
    # By a thousand times what is allowed, so that no rounding decides.
    found = result(entry, entry.spoiled(laboratory), 0.0, spoiled=True)
    assert found.word == "fail"
    assert found.error > 1000 * found.within


def test_the_column_converges_at_twice_the_degree_of_its_elements(laboratory) -> None:
    # The displacement of the loaded end is as exact as the energy: order 4 for quadratic elements, 2 for linear ones.
    column = next(entry for entry in ENTRIES if entry.name == "heavy_column")
    assert column.measure(laboratory).order == pytest.approx(4, abs=0.05)
    assert column.spoiled(laboratory).order == pytest.approx(2, abs=0.05)
