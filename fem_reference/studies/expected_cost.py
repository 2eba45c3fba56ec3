"""The time that a reference will take, before it is solved."""

from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx import resources

# Measured on hip_flexion: seconds of processor time of one of Newton's iterations with so many unknowns, the exponent by which it
# grows, and iterations a frame.
_SECONDS, _UNKNOWNS, _EXPONENT, _ITERATIONS = 0.13, 5456, 1.15, 4


def seconds(body: Body, element: str) -> float:
    """The processor time [s] that FEniCSx takes for a muscle as a ``body``, within a factor of three."""
    unknowns = resources.unknowns(body.mesh, element)
    wanted = sum(frame >= body.first for frame in body.frames)
    return _SECONDS * float((unknowns / _UNKNOWNS) ** _EXPONENT) * _ITERATIONS * (wanted - 1)
