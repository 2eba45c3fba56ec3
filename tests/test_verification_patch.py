"""Every element passes its patch test and turns rigidly, and a wrong boundary is noticed."""

import pytest

from fem_reference.catalogue import Entry, result
from fem_reference.verification.lab import lab
from fem_reference.verification.patch import ENTRIES


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
