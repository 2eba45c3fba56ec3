"""Settings of the reference solver."""

from typing import Annotated, Literal

from pydantic import Field

from fem_reference.foundations.records import Record
from fem_reference.foundations.units import Time
from fem_reference.problems.body import ELEMENTS
from fem_reference.solvers.common.protocol import Trade


class BodySettings(Record):
    """Numerical settings for a body. The sizes of load steps are differences of frame numbers.

    ``element``: one of ``body.ELEMENTS``. ``first_step``: the first load step. The step grows by half after an easy step (at most 5
    Newton iterations), up to ``largest_step`` if given, and is halved, down to ``smallest_step``, if Newton's method needs more
    than ``newton_iterations`` or a cell inverts. ``residual`` [N, mm3]: Newton's method ends when the norm of the nodal forces and
    of the residual of the volume equation is at most this value. ``quadrature_degree``: the degree of the polynomials that are
    integrated exactly on a straight cell; the default depends on the element.

    ``linear_solver``: ``"direct"`` factorises each system. ``"lagged"`` uses inexact FGMRES, preconditioned with a factorisation
    that is reused until a new one is cheaper; if even the smallest load step fails, systems are solved exactly from then on.
    ``"multigrid"`` uses FGMRES with two levels of elements. The default depends on the size. ``precision``: the precision of
    factorisations, by default double for ``"direct"`` and single for ``"lagged"``. Both settings change the time, not the result.

    ``follow``: ``"equilibrium"`` accepts any equilibrium that Newton's method finds. With ``"stable"``, if the equilibrium of a
    frame is unstable (and negative modes are counted), the body is moved along its lowest mode by a ``perturbation``, a fraction of
    its size, and the frame is solved again. Moves of 1, 2, 4 and 8 times this length, in both directions, are tried until there are
    fewer negative modes. ``reuse``: reuse the state of an earlier frame with the same load. ``time_limit``: the limit on processor
    time for each rank, by default none; if the wall-clock time exceeds about twenty times this limit, the status is *stalled*,
    which allows no conclusion. ``store_state``: each frame also stores the unknowns of every cell, from which ``results`` evaluates
    stress, pressure, det F and fibre stretch; by default only for a muscle whose frames together take at most 64 MB.
    """

    element: Annotated[str, Trade(tuple(ELEMENTS))] = "P2/P1"
    first_step: float = Field(default=10.0, gt=0)
    smallest_step: float = Field(default=0.02, gt=0)
    largest_step: Annotated[float | None, Trade((8.0, 4.0, 2.0, 1.0))] = Field(default=None, gt=0)
    newton_iterations: int = Field(default=14, gt=0)
    residual: Annotated[float, Trade((1e-4, 1e-6, 1e-8))] = Field(default=1e-8, gt=0)
    quadrature_degree: Annotated[int | None, Trade((2, 3, 4, 6))] = Field(default=None, gt=0)
    linear_solver: Literal["direct", "lagged", "multigrid"] | None = None
    precision: Literal["single", "double"] | None = None
    follow: Literal["equilibrium", "stable"] = "equilibrium"
    perturbation: float = Field(default=0.01, gt=0, lt=1)
    reuse: bool = True
    time_limit: Time | None = None
    store_state: bool | None = None


class Settings(BodySettings):
    """Numerical settings for a muscle. ``ranks``: the number of MPI processes, by default 2 if that is faster and two cores are
    idle, otherwise 1.
    """

    ranks: int | None = Field(default=None, gt=0, le=1024)


class FieldSettings(Record):
    """Settings for scalar fields. ``time_limit``: the limit on processor time, by default none."""

    time_limit: Time | None = None
