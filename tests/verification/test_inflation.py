"""Blowing up in the catalogue: the pressure is the slope of the energy."""

import numpy as np
import pytest

from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.verification import inflation, parts


def test_the_slope_of_the_energy_is_the_pressure() -> None:
    # The energy of the closed form, integrated over 200 Gauss points, at the frames of the entries: its slope over the enclosed
    # volume is the pressure, up to the polynomial, 1e-6.
    sphere = parts.find("rivlin").Sphere(inflation.MU, inflation.INNER, inflation.OUTER)
    ticks, weights = np.polynomial.legendre.leggauss(200)

    def energy(stretch: float) -> float:
        half = (stretch - 1) / 2
        along = 1 + half * (ticks + 1)
        pressures = np.array([sphere.pressure(one) for one in along])
        return float(half * np.sum(weights * pressures * np.pi / 2 * inflation.INNER**3 * along**2))

    for largest, count in ((1.6, 8), (inflation.BEYOND, 10)):
        frames = inflation.stretches(largest, count)
        states = tuple(Frame(frame, scalars={"energy": energy(frame)}) for frame in frames)
        curve = inflation.slope(collected(states, Outcome("converged", "", {})))
        for stretch in (1.2, 1.5, largest):
            pressure = curve(stretch) / (np.pi / 2 * inflation.INNER**3 * stretch**2)
            assert pressure == pytest.approx(sphere.pressure(stretch), rel=3e-6)


def test_a_slope_of_what_was_not_reached_says_why() -> None:
    with pytest.raises(ArithmeticError, match="diverged: too far"):
        inflation.slope(collected((), Outcome("diverged", "too far", {})))
