"""The error of a case on meshes each twice as fine."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Ladder:
    """The same case on meshes each twice as fine: ``cells`` and ``errors`` by mesh, and the ``order`` measured on the finest two.

    ``against`` says what an error is: the L2 distance to the exact solution, or the rms distance at the vertices to
    the finest solution of order 2. ``order`` is NaN where the errors are rounding.
    """

    element: str
    cells: tuple[int, ...]
    errors: tuple[float, ...]
    order: float
    against: str
