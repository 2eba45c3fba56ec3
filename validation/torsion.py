"""Saint-Venant torsion of a bar of square section."""

import numpy as np


def square_bar_stiffness(shear_modulus: float, side: float) -> float:
    """Torque divided by twist per length [N mm2], for a bar of square section that is free to warp.

    ``mu a^4 (1/3 - 64/pi^5 sum over odd n of tanh(n pi / 2) / n^5)`` = 0.1406 mu a^4. Source: Timoshenko and Goodier,
    Theory of Elasticity, 3rd edition 1970, art. 109. No digitisation error: the series is summed to rounding.
    """
    n = np.arange(1, 200, 2)
    series = np.sum(np.tanh(n * np.pi / 2) / n**5.0)
    return float(shear_modulus * side**4 * (1 / 3 - 64 / np.pi**5 * series))
