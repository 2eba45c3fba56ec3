"""An independent solver as a second opinion: Lagrange elements of scikit-fem, solved by scipy's sparse LU factorisation.

``field`` solves for scalar fields, ``body`` for bodies, whose stress and stiffness are derivatives of energies by ``jets``.
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
# Functions that solve in memory and return a run.
solve_field, solve_body = SOLVES[0].run, SOLVES[1].run
