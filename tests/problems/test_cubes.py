"""Cubes against the laws by hand and root finding of ``validation``, and against equations of linear elasticity."""

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.problems.cubes import FREE, loaded, nominal_stress
from validation import homogeneous, laws
from validation.fibre_laws import FibrePassive

NEO = (make("neo_hooke", mu="10 kPa"), make("incompressible_penalty", bulk="10 MPa"))
FIBRES = make("fibre_passive", stress="300 kPa", p1=0.05, p2=6.6, optimal_stretch=1.0, linear_from=1.4)
LAW = laws.Together((laws.neo_hooke(0.01), FibrePassive(0.3, 0.05, 6.6, 1.0, 1.4)))
X, Y = np.eye(3)[:2]


def test_the_slope_of_the_energy_is_the_stress_by_hand() -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        F, fibre = np.eye(3) + 0.2 * rng.uniform(-1, 1, (3, 3)), np.array([0.6, 0.8, 0.0])
        expected = homogeneous.nominal_stress(LAW, 10.0, F, fibre)
        assert nominal_stress((*NEO, FIBRES), F, fibre) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("fibre", [X, Y], ids=["along", "across"])
@pytest.mark.parametrize("stretch", [0.7, 0.9, 1.1, 1.3])
def test_aligned_cubes_are_those_of_root_finding_by_another_path(stretch: float, fibre: np.ndarray) -> None:
    """Both leave 1e-8 of the stress or less on free sides; the bulk modulus over the shear modulus turns that into 1e-11 of J."""
    found = loaded((*NEO, FIBRES), (stretch, FREE, FREE), fibre)
    known = homogeneous.uniaxial(LAW, 10.0, stretch, fibre)
    assert found.stretches == pytest.approx(known.stretches, rel=1e-6)
    assert found.P[0, 0] == pytest.approx(known.P[0, 0], rel=1e-5)
    # There y is fixed instead of z: a fibre along y here is one along z there.
    planar = homogeneous.planar(LAW, 10.0, stretch, fibre if fibre[0] else np.eye(3)[2])
    assert loaded((*NEO, FIBRES), (stretch, FREE, 1.0), fibre).P[0, 0] == pytest.approx(planar.P[0, 0], rel=1e-4)


def test_at_an_angle_the_modulus_is_that_of_linear_elasticity() -> None:
    """Compliances add up by the fourth powers of cosine and sine (Lekhnitskii), with c = p1 p2 stress of the fibres.

    Fibres at 30 degrees are stretched, so that the law is linear there; the strain of 1e-4 leaves 1e-4 of p2, K / mu a thousandth.
    """
    mu, c = 0.01, 0.3 * 0.05 * 6.6
    poisson = 1 / (2 + c / (2 * mu))
    along, across = 3 * mu + c, 2 * mu * (2 - poisson)
    cosine, sine = np.cos(np.pi / 6) ** 2, np.sin(np.pi / 6) ** 2
    compliance = cosine**2 / along + sine**2 / across + cosine * sine * (1 / mu - 2 * 0.5 / along)
    fibre = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])
    found = loaded((*NEO, FIBRES), (1 + 1e-4, FREE, FREE), fibre)
    assert found.P[0, 0] / 1e-4 == pytest.approx(1 / compliance, rel=2e-3)
    assert found.F[0, 1] != 0


def test_strains_of_an_incompressible_cube_add_up_to_zero() -> None:
    found = loaded((*NEO, FIBRES), (0.9, FREE, FREE), Y)
    assert found.poisson_ratio(0, 1) + found.poisson_ratio(0, 2) == pytest.approx(1, abs=2e-3)  # K / mu is a thousand
    assert found.poisson_ratio(0, 1) < found.poisson_ratio(0, 2)


@pytest.mark.parametrize("stretch", [float("nan"), 0.0, -0.9, float("inf")])
def test_a_stretch_that_means_nothing_is_refused(stretch: float) -> None:
    with pytest.raises(InputError, match="stretches: got"):
        loaded(NEO, (stretch, FREE, FREE), X)


def test_no_state_is_an_error() -> None:
    """Of a cube squeezed to a thousandth, whose fibres across the load would be stretched a thousand times."""
    with pytest.raises(ArithmeticError, match="no homogeneous state"):
        loaded((*NEO, FIBRES), (1e-3, FREE, FREE), Y)
