"""Stability of a state of equilibrium: the number of directions in which its energy falls."""

import numpy as np

from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError
from fem_reference.solvers.fenicsx.system import System


class Stability:
    """The inertia of the tangent of a ``system``, from an LDL^T factorisation that ``linear`` uses afterwards.

    An unknown pressure p has the energy ``p (J - 1) - p^2 / 2K``, which gives one negative pivot, -1/K. The other negative pivots
    are the negative modes of the displacement, with the corresponding pressure (Haynsworth 1968, doi 10.1016/0024-3795(68)90050-5).
    Prescribed unknowns have pivots of 1.
    """

    def __init__(self, system: System, linear: Factorised) -> None:
        space = system.unknowns.function_space
        self.system, self.linear = system, linear
        self.pressures = space.sub(1).collapse()[0].dofmap.index_map.size_global if space.num_sub_spaces > 1 else 0

    def of_material(self) -> float:
        """The number of negative modes that the material certainly has: modes along which the energy falls even if the pressure
        follows the volume at every point. An element with a pressure controls the volume on average only: shrinking in one place
        and swelling in another needs no energy, and under a stress of several shear moduli the energy may fall in such modes
        although the energy of the material does not. The elements' displacements are a subset of the body's, so the body has at
        least this many modes.
        """
        found = self.negative_modes(pointwise=self.pressures > 0)
        self.negative_modes()  # restores the tangent and its factors for the next solve
        return found

    def negative_modes(self, *, pointwise: bool = False) -> float:
        """The number of directions in which the energy falls from the present state; NaN if the tangent is singular.
        ``pointwise``: see ``cells``.
        """
        self.system.linearise(pointwise=pointwise)
        try:
            return float(self.linear.negative_pivots() - self.pressures)
        except LinearSolveError:
            return float(np.nan)
