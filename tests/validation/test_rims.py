"""The exponents at rims of clamped areas against published ones."""

import numpy as np
import pytest

from validation.rims import exponent, far_order

# Williams 1952, figure 1 (clamped-free), and closed forms: where nothing yields on a flat face, 1/2.
KNOWN = [
    (180, 0.5, 0.5),
    (90, 0.5, 0.5946),
    (90, 0.3, 0.711),
    (225, 0.5, 0.339),
    (270, 0.45, 0.282),
    (135, 0.45, 0.525),
]


@pytest.mark.parametrize(("degrees", "poisson", "wanted"), KNOWN)
def test_exponents(degrees, poisson, wanted) -> None:
    assert exponent(np.radians(degrees), poisson) == pytest.approx(wanted, abs=6e-4)


def test_the_order_far_away_is_twice_the_exponent_and_grading_raises_it() -> None:
    assert far_order(np.pi, 0.5) == pytest.approx(1, abs=1e-6)
    assert far_order(np.pi, 0.5, 0.5) == pytest.approx(2, abs=1e-6)
