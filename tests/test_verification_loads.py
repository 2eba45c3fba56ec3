"""The column of the catalogue under its own weight."""

import pytest

from fem_reference.verification.loads import ENTRIES


@pytest.mark.slow
def test_the_column_converges_at_twice_the_degree_of_its_elements(fem_lab) -> None:
    # The displacement of the loaded end is as exact as the energy: order 4 for quadratic elements, 2 for linear ones.
    column = next(entry for entry in ENTRIES if entry.name == "heavy_column")
    assert column.measure(fem_lab).order == pytest.approx(4, abs=0.05)
    assert column.with_negative_control(fem_lab).order == pytest.approx(2, abs=0.05)
