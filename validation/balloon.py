"""A spherical balloon of a thin incompressible neo-Hookean sheet: ``p = 2 sigma h / r``, with ``sigma = mu (l^2 - l^-4)``.

The stretch l is r / R, the thickness now ``h = H / l^2``: ``p = 2 mu H / R (1/l - 1/l^7)``, largest at ``l = 7^(1/6)``
(Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.5, of rubber balloons). Derived by hand from the balance of a hemisphere. No
reading error.
"""


def pressure(mu: float, thickness: float, radius: float, stretch: float) -> float:
    """The pressure [MPa] in a balloon of the shear modulus ``mu`` [MPa]; ``thickness`` and ``radius`` [mm] are those at rest."""
    return 2 * mu * thickness / radius * (1 / stretch - stretch**-7)
