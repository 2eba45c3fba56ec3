"""Bodies with inertia: free fall, longitudinal waves of a bar in uniaxial strain, and a bar that is pulled slowly. Derived here.

Lengths [mm]; ``modulus`` of uniaxial strain ``bulk + 4/3 mu`` [MPa]; ``density`` [tonne/mm^3].
"""

import math


def fall(acceleration: float, seconds: float) -> float:
    """Distance [mm] of a fall from rest with an ``acceleration`` [mm/s^2]."""
    return acceleration * seconds**2 / 2


def uniaxial_modulus(mu: float, bulk: float) -> float:
    """Modulus [MPa] of a bar at small strain whose sides cannot move."""
    return bulk + 4 / 3 * mu


def first_frequency(modulus: float, density: float, length: float) -> float:
    """Lowest frequency [rad/s] of longitudinal waves in a bar with one end fixed and the other free, a quarter of a wave long:
    ``density d2u/dt2 = modulus d2u/dx2``.
    """
    return math.pi / (2 * length) * math.sqrt(modulus / density)


def pull_of_inertia(density: float, length: float, area: float, acceleration: float) -> float:
    """Force [N] in addition to the elastic force at the end that is pulled with ``acceleration`` [mm/s^2], if the other end is
    fixed. Points accelerate in proportion to their distance x from the fixed end, so that
    ``modulus d2u/dx2 = density acceleration x / length``. Exact to first order in the square of the speed.
    """
    return density * length * area * acceleration / 3
