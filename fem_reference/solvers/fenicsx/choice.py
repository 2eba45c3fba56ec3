"""Which solver of linear systems is taken."""

from fem_reference.solvers.fenicsx.linear import Factorised
from fem_reference.solvers.fenicsx.multigrid import Multigrid
from fem_reference.solvers.fenicsx.settings import BodySettings
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.system import System

# Unknowns below which a factorisation costs no more than a few iterations of anything else.
SMALL = 4000


def make(system: System, symmetric: bool, settings: BodySettings, spent: Spent) -> Factorised | Multigrid:
    """The solver that ``settings`` ask for, or the one for the size of the ``system``."""
    kind = settings.linear_solver or ("direct" if system.matrix.getSize()[0] < SMALL else "lagged")
    if kind == "multigrid":
        return Multigrid(system, settings.element, spent)
    precision = settings.precision or ("double" if kind == "direct" else "single")
    return Factorised(system.matrix, symmetric, kind == "lagged", precision, spent)
