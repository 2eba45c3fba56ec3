"""Incompressible neo-Hookean material with a viscosity in parallel (Kelvin and Voigt), without inertia: Cauchy stress
``mu B + 2 eta D - p``. Derived here.

``mu`` [MPa], ``eta`` [MPa s].
"""


def squeeze_force(mu: float, eta: float, stretch: float, speed: float, area: float) -> float:
    """Of a smooth plate on a block [N] at ``stretch`` l of its height that changes by ``speed`` l' [1/s], above zero where it
    pulls; ``area`` at rest [mm2].

    Free sides widen by ``l^(-1/2)``, so that ``D = diag(-1/2, 1, -1/2) l'/l`` and the Cauchy stress under the plate is
    ``mu (l^2 - 1/l) + 3 eta l'/l``, over an area that is 1/l times as large.
    """
    return (mu * (stretch - stretch**-2) + 3 * eta * speed / stretch**2) * area


def creep_rate(mu: float, eta: float) -> float:
    """At which a small strain under a load that stays comes to its end [1/s]: ``3 mu e + 3 eta de/dt = s``, whatever the size of
    the body.
    """
    return mu / eta
