"""An independent second solver: Lagrange elements of scikit-fem, with equations solved by scipy's sparse LU factorisation.

``field`` solves scalar problems, and ``body`` finds equilibria of bodies, with stress and stiffness from energies by ``jets``.
"""

from fem_reference.solvers.common.protocol import BodySolver, FieldSolver
from fem_reference.solvers.scikit_fem import body, field
from fem_reference.solvers.scikit_fem.body import ScikitBodySettings
from fem_reference.solvers.scikit_fem.field import ScikitFieldSettings, assemble, space

__all__ = ["SOLVES", "ScikitBodySettings", "ScikitFieldSettings", "assemble", "solve_body", "solve_field", "space"]

SOLVES = (
    FieldSolver(settings=ScikitFieldSettings, solve=field.solve, example={}),
    BodySolver(settings=ScikitBodySettings, solve=body.solve, example={}),
)
# Functions that solve a problem in memory and return the run.
solve_field, solve_body = SOLVES[0].run, SOLVES[1].run
