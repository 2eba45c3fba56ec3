"""Stability of a state of equilibrium: the number of directions in which its energy decreases."""

import numpy as np

from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError
from fem_reference.solvers.fenicsx.system import System


class Stability:
    """Counts negative eigenvalues of the tangent of a ``system``, with an LDL^T factorisation that ``linear`` reuses afterwards.

    A pressure unknown p has the energy ``p (J - 1) - p^2 / 2K``, which gives one negative pivot, -1/K. All other negative pivots
    are negative modes of the displacement, with the corresponding pressure (Haynsworth 1968, doi 10.1016/0024-3795(68)90050-5).
    Prescribed unknowns have pivots of 1.
    """

    def __init__(self, system: System, linear: Factorised) -> None:
        space = system.unknowns.function_space
        self.system, self.linear = system, linear
        self.pressures = space.sub(1).collapse()[0].dofmap.index_map.size_global if space.num_sub_spaces > 1 else 0

    def of_material(self) -> float:
        """The number of negative modes that certainly belong to the material: modes along which the energy decreases even if the
        pressure follows the volume at every point.

        An element with a pressure controls the volume on average only. Shrinking at one point and swelling at another costs no
        energy, so under a stress of several times the shear modulus the energy of the element may decrease in such modes although
        the energy of the material does not. The displacements of the elements are a subset of those of the body, so the body has at
        least this many negative modes.
        """
        found = self.negative_modes(pointwise=self.pressures > 0)
        self.negative_modes()  # restores the tangent and its factors for the next solve
        return found

    def negative_modes(self, *, pointwise: bool = False) -> float:
        """The number of directions in which the energy decreases from the current state; NaN if the tangent is singular.
        ``pointwise``: see ``CellSums.add``.
        """
        self.system.linearise(pointwise=pointwise)
        try:
            return float(self.linear.negative_pivots() - self.pressures)
        except LinearSolveError:
            return float(np.nan)
