"""Choice of the solver of linear systems."""

from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolver
from fem_reference.solvers.fenicsx.multigrid import Multigrid
from fem_reference.solvers.fenicsx.resources import SMALL
from fem_reference.solvers.fenicsx.settings import BodySettings
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.system import System


def make(system: System, symmetric: bool, settings: BodySettings, spent: Spent) -> LinearSolver:
    """The solver that ``settings`` ask for, or the one for the size of the ``system``."""
    kind = settings.linear_solver or ("direct" if system.matrix.getSize()[0] < SMALL else "lagged")
    if kind == "multigrid":
        return Multigrid(system, settings.element, spent)
    precision = settings.precision or ("double" if kind == "direct" else "single")
    return Factorised(system.matrix, symmetric, kind == "lagged", precision, spent)
