"""Twisting in the catalogue is only printed of until it is measured, on ladders that end with their finest mesh."""

from functools import partial

from fem_reference.verification import parts, torsion


def test_importing_makes_nothing() -> None:
    # Entries are only described: materials, meshes and truths are made as they are measured.
    for entry in torsion.ENTRIES:
        assert isinstance(entry.measure, partial)
        assert isinstance(entry.truth, partial) or entry.truth.__name__.startswith("_true")


def test_a_ladder_ends_with_its_finest_mesh() -> None:
    # 1 + h^2 of h = 2 and 1 falls at order 2 to 1.
    found = parts.ladder(None, lambda _, count: 1 + (2 / count) ** 2, (1, 2), 2.0, lambda: 1.0)
    assert (found.value, found.order, found.ladder) == (2.0, 2.0, ((2.0, 5.0), (1.0, 2.0)))
