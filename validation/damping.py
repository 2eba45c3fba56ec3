"""Tissue with a drag of ``-coefficient v`` per unit rest volume, without inertia: derived here from the balance of forces.

``coefficient`` c [MPa s/mm^2], ``mu`` and ``bulk`` [MPa], lengths [mm].
"""

import numpy as np


def terminal_velocity(force: float, coefficient: float) -> float:
    """Velocity [mm/s] of a free body under a ``force`` per unit rest volume [N/mm3]: ``f - c v = 0``."""
    return force / coefficient


def relaxation_rate(mu: float, bulk: float, coefficient: float, length: float) -> float:
    """Rate [1/s] of the slowest mode of a bar in uniaxial small strain, fixed at one end and free at the other:
    ``c du/dt = M d2u/dx2`` with ``M = bulk + 4/3 mu`` has ``u = sin(k x) exp(-M k^2 t / c)``, ``k = pi / (2 length)``.
    """
    return (bulk + 4 / 3 * mu) * (np.pi / (2 * length)) ** 2 / coefficient
