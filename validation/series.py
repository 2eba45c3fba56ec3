"""A bar of two materials in series that stretches along its axis only; one has ``ratio`` times the moduli of the other.

The nominal stress P is the same everywhere. The moduli at x are those of the soft material times ``1 + (ratio - 1) w(x)``, so the
stretch at x is that of the soft material under P divided by this factor (``loads.confined_stretch``). P follows from the length
of the bar. Derived by hand; roots and the integral to rounding. No digitisation error. ``mu`` and ``bulk`` [MPa].
"""

import numpy as np
from scipy.optimize import brentq

from validation.loads import confined_stress, confined_stretch


def stress(mu: float, bulk: float, ratio: float, lengths: tuple[float, float, float], longer: float) -> float:
    """The nominal stress [MPa] in a bar stretched to the length ``longer`` [mm]; ``lengths`` [mm]: of the stiff part, of the
    transition at its end, where w falls from 1 to 0 as ``(1000^t - 1) / 999``, and of the bar.
    """
    stiff, width, whole = lengths
    nodes, weights = np.polynomial.legendre.leggauss(60)
    t = (1 + nodes) / 2

    def length(found: float) -> float:
        ends = (stiff - width) * confined_stretch(mu, bulk, found / ratio)
        ends += (whole - stiff) * confined_stretch(mu, bulk, found)
        factors = 1 + (ratio - 1) * (1000**t - 1) / 999
        between = [confined_stretch(mu, bulk, found / factor) for factor in factors]
        return float(ends + width * (weights / 2) @ between)

    most = confined_stress(
        mu, bulk, 1 + (longer / whole - 1) * whole / (whole - stiff)
    )  # the stress if the stiff part were rigid
    return float(brentq(lambda found: length(found) - longer, 0.0, most, xtol=1e-16, rtol=1e-14))
