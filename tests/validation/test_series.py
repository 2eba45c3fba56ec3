"""A bar of two materials in series: like one bar where they are the same, like its soft part where the other is rigid."""

import pytest

from validation.loads import confined_stress
from validation.series import stress

LENGTHS = (4.0, 1.0, 10.0)


def test_two_bars_of_one_material_are_one() -> None:
    assert stress(0.01, 0.1, 1.0, LENGTHS, 12.0) == pytest.approx(confined_stress(0.01, 0.1, 1.2), rel=1e-12)


def test_beside_a_rigid_part_the_other_is_stretched_alone() -> None:
    found = stress(0.01, 0.1, 1e12, (4.0, 0.0, 10.0), 12.0)
    assert found == pytest.approx(confined_stress(0.01, 0.1, 8 / 6), rel=1e-10)


def test_springs_in_series_in_small_strain() -> None:
    """Compliances add up: 6 mm / M, 4 mm / (1000 M), with M = K + 4 mu / 3."""
    modulus, more = 0.1 + 4 * 0.01 / 3, 1e-6
    found = stress(0.01, 0.1, 1000.0, (4.0, 0.0, 10.0), 10 + more)
    assert found == pytest.approx(more / (6 / modulus + 4 / (1000 * modulus)), rel=1e-5)
