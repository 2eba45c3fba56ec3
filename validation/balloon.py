"""A spherical balloon of a thin incompressible neo-Hookean sheet: ``p = 2 sigma h / r``, with ``sigma = mu (l^2 - l^-4)``.

The stretch l is r / R and the present thickness ``h = H / l^2``, so ``p = 2 mu H / R (1/l - 1/l^7)``, greatest at ``l = 7^(1/6)``
(Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.5, on rubber balloons). Derived by hand from the equilibrium of a hemisphere. No
digitisation error.
"""


def pressure(mu: float, thickness: float, radius: float, stretch: float) -> float:
    """The pressure [MPa] in a balloon with shear modulus ``mu`` [MPa]; ``thickness`` and ``radius`` [mm] are those at rest."""
    return 2 * mu * thickness / radius * (1 / stretch - stretch**-7)
