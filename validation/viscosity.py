"""Incompressible neo-Hookean material with a viscosity in parallel (Kelvin and Voigt), without inertia; its Cauchy stress is
``mu B + 2 eta D - p``. Derived here.

``mu`` [MPa], ``eta`` [MPa s].
"""


def squeeze_force(mu: float, eta: float, stretch: float, speed: float, area: float) -> float:
    """Force [N] of a smooth plate on a block at the ``stretch`` l of its height, which changes at ``speed`` l' [1/s]; positive in
    tension; ``area`` [mm2] at rest.

    The lateral stretch is ``l^(-1/2)``, so that ``D = diag(-1/2, 1, -1/2) l'/l``. The Cauchy stress under the plate is
    ``mu (l^2 - 1/l) + 3 eta l'/l``, on 1/l times the area at rest.
    """
    return (mu * (stretch - stretch**-2) + 3 * eta * speed / stretch**2) * area


def creep_rate(mu: float, eta: float) -> float:
    """Rate [1/s] at which a small strain under a constant load approaches its limit: ``3 mu e + 3 eta de/dt = s``, for a body of
    any size.
    """
    return mu / eta
