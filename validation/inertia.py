"""Bodies with inertia: a fall, longitudinal waves of a bar that cannot widen, and a bar that is pulled slowly. Derived here.

Lengths [mm], ``modulus`` of uniaxial strain, ``bulk + 4/3 mu``, [MPa], ``density`` [tonne/mm^3].
"""

import math


def fall(acceleration: float, seconds: float) -> float:
    """How far [mm] anything falls from rest by an ``acceleration`` [mm/s^2]."""
    return acceleration * seconds**2 / 2


def uniaxial_modulus(mu: float, bulk: float) -> float:
    """Of a bar of small strain whose sides cannot move outwards [MPa]."""
    return bulk + 4 / 3 * mu


def first_frequency(modulus: float, density: float, length: float) -> float:
    """Of longitudinal waves of a bar with one end fixed and one free [rad/s]: a quarter of the wave is in the bar,
    ``density d2u/dt2 = modulus d2u/dx2``.
    """
    return math.pi / (2 * length) * math.sqrt(modulus / density)


def pull_of_inertia(density: float, length: float, area: float, acceleration: float) -> float:
    """What a bar takes beside its elastic force [N] at the end that is pulled with ``acceleration`` [mm/s^2], the other end being
    fixed: points accelerate in proportion to their distance x from it, so that
    ``modulus d2u/dx2 = density acceleration x / length``. To first order in the square of the speed.
    """
    return density * length * area * acceleration / 3
