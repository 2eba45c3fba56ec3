"""Twisting in the catalogue: what is quick is measured as true, every spoil is found out."""

from functools import partial

import pytest

from fem_reference import catalogue
from fem_reference.verification import torsion
from fem_reference.verification.lab import lab

# Above 4 s, or like another one: left to the verb verify.
SLOW = {"torsion_moment_tetrahedra", "torsion_moment_hexahedra", "torsion_axial_force"}
QUICK = [entry for entry in torsion.ENTRIES if entry.name not in SLOW]


@pytest.fixture(scope="module")
def fem():
    with lab() as opened:
        yield opened


@pytest.mark.parametrize("entry", QUICK, ids=lambda entry: entry.name)
def test_true(entry, fem) -> None:
    result = catalogue.result(entry, entry.measure(fem), 0.0, spoiled=False)
    assert result.word == "pass", (result.finding, result.truth)
    # What quadratic elements promise for the work of stresses, 4, with room for meshes that are not fine enough yet.
    assert result.finding.order is None or result.finding.order > 3.5


@pytest.mark.parametrize("entry", torsion.ENTRIES, ids=lambda entry: entry.name)
def test_spoilt(entry, fem) -> None:
    result = catalogue.result(entry, entry.spoiled(fem), 0.0, spoiled=True)
    assert result.word == "fail"
    assert result.error > 3 * result.within


def test_what_is_left_out_is_there() -> None:
    assert {entry.name for entry in torsion.ENTRIES} >= SLOW


def test_importing_makes_nothing() -> None:
    # Entries are only told of: matter, meshes and truths are made as they are measured.
    for entry in torsion.ENTRIES:
        assert isinstance(entry.measure, partial)
        assert isinstance(entry.truth, partial) or entry.truth.__name__.startswith("_true")


def test_a_ladder_ends_with_its_finest_mesh() -> None:
    # 1 + h^2 of h = 2 and 1 falls at order 2 to 1.
    found = torsion.ladder(None, lambda _, count: 1 + (2 / count) ** 2, (1, 2), 2.0, lambda: 1.0)
    assert (found.value, found.order, found.ladder) == (2.0, 2.0, ((2.0, 5.0), (1.0, 2.0)))
