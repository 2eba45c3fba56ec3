"""Neo-Hookean blocks under plates, weight and pressure: ``mu/2 (I1bar - 3) + K/2 (J - 1)^2`` with a finite bulk modulus K.

Derived here from the energy by hand (Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.4: stress of a decoupled energy), as scalar
equations; roots to rounding. No digitisation error. ``mu`` and ``bulk`` [MPa].
"""

from scipy.optimize import brentq


def squeezed_volume(mu: float, bulk: float, stretch: float) -> float:
    """J of a block with free sides between frictionless plates, at the ``stretch`` of its height:
    ``mu/3 J^(-2/3) (J/stretch - stretch^2) + K J (J - 1) = 0``.
    """

    def lateral(J: float) -> float:
        return float(mu / 3 * J ** (-2 / 3) * (J / stretch - stretch**2) + bulk * J * (J - 1))

    inner, outer = (stretch**3, 1.0) if stretch < 1 else (1.0, stretch**3)
    return float(brentq(lateral, inner, outer, xtol=1e-15, rtol=1e-15)) if stretch != 1 else 1.0


def squeeze_force(mu: float, bulk: float, stretch: float, area: float) -> float:
    """The force of a plate on the block [N], positive in tension: ``mu J^(-2/3) (stretch - J / stretch^2) area``, ``area`` at rest
    [mm2]; J from :func:`squeezed_volume`.
    """
    J = squeezed_volume(mu, bulk, stretch)
    return float(mu * J ** (-2 / 3) * (stretch - J / stretch**2) * area)


def confined_stress(mu: float, bulk: float, stretch: float) -> float:
    """Nominal stress [MPa] along the only direction that stretches, ``F = diag(1, 1, l)``:
    ``2/3 mu (l^(1/3) - l^(-5/3)) + K (l - 1)``.
    """
    return float(2 / 3 * mu * (stretch ** (1 / 3) - stretch ** (-5 / 3)) + bulk * (stretch - 1))


def confined_stretch(mu: float, bulk: float, stress: float) -> float:
    """The stretch at which :func:`confined_stress` is ``stress`` [MPa], by root finding."""
    reach = 1 + abs(stress) / bulk
    low = min(0.5, (mu / (mu + 3 * abs(stress))) ** 0.6)
    return float(
        brentq(lambda stretch: confined_stress(mu, bulk, stretch) - stress, low, reach, xtol=1e-15, rtol=1e-15)
    )


def column_top(mu: float, bulk: float, weight: float, height: float) -> float:
    """Displacement [mm] of the top of a column that stands in a rigid frictionless box, under its ``weight`` per unit rest volume
    [N/mm3]; ``height`` H [mm] at rest.

    Equilibrium requires ``P(Z) = -weight (H - Z)``. The displacement is the integral of ``l - 1`` over Z, by parts
    ``H (l0 - 1) + W(l0) / weight`` with l0 at the bottom and ``W = mu/2 (l^(4/3) + 2 l^(-2/3) - 3) + K/2 (l - 1)^2``.
    For a hanging column ``weight`` is negative.
    """
    bottom = confined_stretch(mu, bulk, -weight * height)
    stored = mu / 2 * (bottom ** (4 / 3) + 2 * bottom ** (-2 / 3) - 3) + bulk / 2 * (bottom - 1) ** 2
    return float(height * (bottom - 1) + stored / weight)


def pressed_volume(bulk: float, pressure: float) -> float:
    """V / V0 of a body under a fluid ``pressure`` P [MPa] on all its faces: ``1 - P / K``, as the pressure is ``-U'(J)`` and an
    isochoric law adds nothing. P must be below K.
    """
    return 1 - pressure / bulk
