"""How the reference is solved."""

from pydantic import Field

from fem_reference.records import Record
from fem_reference.units import Time


class BodySettings(Record):
    """Numerics of a body; steps are in frame numbers.

    ``element``: one of ``continuum.ELEMENTS``. ``first_step`` and ``smallest_step`` bound the load step: it grows by half after an
    easy step (at most 5 Newton iterations), up to ``largest_step`` where there is one, and is halved when Newton needs more than
    ``newton_iterations`` or a cell inverts.
    ``residual`` [N, mm3] ends Newton's iteration: the norm of out-of-balance nodal forces and of the volume equation.
    ``quadrature_degree``: of the polynomials that are integrated exactly on a straight cell, by default what the element needs.
    ``time_limit``: when to give up, by default never.
    """

    element: str = "P2/P1"
    first_step: float = Field(default=10.0, gt=0)
    smallest_step: float = Field(default=0.02, gt=0)
    largest_step: float | None = Field(default=None, gt=0)
    newton_iterations: int = Field(default=14, gt=0)
    residual: float = Field(default=1e-8, gt=0)
    quadrature_degree: int | None = Field(default=None, gt=0)
    time_limit: Time | None = None


class Settings(BodySettings):
    """Numerics of a muscle; ``ranks``: MPI processes, by default two where the machine has them: they change the time, not the
    answer.
    """

    ranks: int | None = Field(default=None, gt=0)
