"""Blowing up in the catalogue: what is quick is measured as true, every spoil is found out."""

import numpy as np
import pytest

from fem_reference import catalogue, truths
from fem_reference.continuum import Reached, Solved
from fem_reference.runs import Outcome
from fem_reference.verification import inflation
from fem_reference.verification.lab import lab

# Above 4 s, or like another one: left to the verb verify.
SLOW = {
    "inflation_sphere_pressure_tetrahedra",
    "inflation_sphere_pressure_hexahedra",
    "inflation_sphere_pressure_mooney_rivlin",
    "inflation_tube_pressure",
    "inflation_limit_stretch",
    "inflation_fall_beyond_limit",
}
QUICK = [entry for entry in inflation.ENTRIES if entry.name not in SLOW]


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


@pytest.mark.parametrize("entry", inflation.ENTRIES, ids=lambda entry: entry.name)
def test_spoilt(entry, fem) -> None:
    result = catalogue.result(entry, entry.spoiled(fem), 0.0, spoiled=True)
    assert result.word == "fail"
    assert result.error > 3 * result.within


def test_what_is_left_out_is_there() -> None:
    assert {entry.name for entry in inflation.ENTRIES} >= SLOW


def test_the_slope_of_the_energy_is_the_pressure() -> None:
    # The energy of the closed form, integrated over 200 Gauss points, at the frames of the entries: its slope over the enclosed
    # volume is the pressure, up to the polynomial, 1e-6.
    sphere = truths.find("rivlin").Sphere(inflation.MU, inflation.INNER, inflation.OUTER)
    ticks, weights = np.polynomial.legendre.leggauss(200)

    def energy(stretch: float) -> float:
        half = (stretch - 1) / 2
        along = 1 + half * (ticks + 1)
        pressures = np.array([sphere.pressure(one) for one in along])
        return float(half * np.sum(weights * pressures * np.pi / 2 * inflation.INNER**3 * along**2))

    for largest, count in ((1.6, 8), (inflation.BEYOND, 10)):
        frames = inflation.stretches(largest, count)
        states = tuple(Reached(frame, np.zeros((0, 3)), {}, {}, {"energy": energy(frame)}) for frame in frames)
        curve = inflation.slope(Solved(states, Outcome("converged", "", {})))
        for stretch in (1.2, 1.5, largest):
            pressure = curve(stretch) / (np.pi / 2 * inflation.INNER**3 * stretch**2)
            assert pressure == pytest.approx(sphere.pressure(stretch), rel=3e-6)


def test_a_slope_of_what_was_not_reached_says_why() -> None:
    with pytest.raises(ArithmeticError, match="diverged: too far"):
        inflation.slope(Solved((), Outcome("diverged", "too far", {})))
