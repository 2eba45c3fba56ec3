"""The independent second opinion: Lagrange elements of scikit-fem, solved by scipy's sparse LU factorisation.

``field`` has scalar fields; ``body`` has bodies, whose stress and stiffness are the derivatives that ``jets`` carry along.
"""

from fem_reference.solvers.common.protocol import BodySolver, FieldSolver
from fem_reference.solvers.scikit_fem import body, field
from fem_reference.solvers.scikit_fem.body import BodySettings, solve_body
from fem_reference.solvers.scikit_fem.field import FieldSettings, assemble, solve_field, space

__all__ = ["SOLVES", "BodySettings", "FieldSettings", "assemble", "solve_body", "solve_field", "space"]

SOLVES = (
    FieldSolver(settings=FieldSettings, solve=field.solve, example={}),
    BodySolver(settings=BodySettings, solve=body.solve, example={}),
)
