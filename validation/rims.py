"""Exponents of the displacement at the rim of a clamped area: u ~ r^lambda, with r the distance from the rim.

Where a clamped face meets a free face at an angle ``a`` in the body, in plane strain, lambda is the smallest positive root of
``sin^2(lambda a) = ((k + 1)^2 - 4 lambda^2 sin^2 a) / (4 k)`` with ``k = 3 - 4 nu`` (Williams, J. Appl. Mech. 19 (1952) 526-528).
Away from the rim the error of finite elements on uniform meshes decreases with the mesh size to the power 2 lambda, whatever their
degree, because the interpolation errors of the displacement and of the dual solution, in energy, are each of order lambda
(Nitsche's argument). On meshes of size ``h ~ r^(1 - m)`` the power is ``2 lambda / m``, up to the limit of the degree (Apel, Sandig
and Whiteman, Math. Meth. Appl. Sci. 19 (1996) 63-85).
"""

import numpy as np
from scipy.optimize import brentq, minimize_scalar


def exponent(angle: float, poisson: float) -> float:
    """The exponent lambda at an ``angle`` [rad] in the body between a sixth and three quarters of a turn, where lambda is real.

    >>> round(exponent(np.pi, 0.5), 4), round(exponent(np.pi / 2, 0.5), 4), round(exponent(np.pi / 2, 0.3), 3)
    (0.5, 0.5946, 0.711)
    """
    k = 3 - 4 * poisson

    def miss(power: float) -> float:
        return float(4 * k * np.sin(power * angle) ** 2 - (k + 1) ** 2 + 4 * power**2 * np.sin(angle) ** 2)

    powers = np.linspace(0.05, 1.0, 2000)
    values = np.array([miss(power) for power in powers])
    crossing = np.flatnonzero(values[:-1] * values[1:] < 0)
    if len(crossing):
        return float(brentq(miss, powers[crossing[0]], powers[crossing[0] + 1], xtol=1e-14))
    near = int(np.argmax(values))  # a double root, as on a flat face of an incompressible body
    bounds = powers[near - 1], powers[near + 1]
    return float(
        minimize_scalar(lambda power: -miss(power), bounds=bounds, method="bounded", options={"xatol": 1e-12}).x
    )


def far_order(angle: float, poisson: float, grading: float = 1.0) -> float:
    """The order of the error far from a rim, on meshes graded with the power ``grading`` (1: uniform)."""
    return 2 * exponent(angle, poisson) / grading
