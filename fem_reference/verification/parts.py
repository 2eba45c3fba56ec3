"""Parts of entries: effects as scene files write them, planes of symmetry, values on ladders of meshes."""

from collections.abc import Callable

from fem_reference.assessment import catalogue
from fem_reference.assessment.catalogue import Finding, Lab
from fem_reference.effects import Effect, make
from fem_reference.problems.body import ELEMENTS, Prescribed
from fem_reference.problems.paths import Rest

Value = Callable[[Lab, int], float]  # of so many cells

# Along the axes the planes through the origin are those of mirrors.
SYMMETRY = tuple(Prescribed(face, face, (axis,), Rest()) for axis, face in enumerate(("x0", "y0", "z0")))


def ramp(full: float = 1.0) -> list[dict[str, float]]:
    """From nothing at frame 0 to ``full`` at frame 1, as scene files write it."""
    return [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": full}]


def resistance(element: str, bulk: float) -> Effect:
    """The effect that resists volume change with the modulus ``bulk`` [MPa], for an ``element``."""
    name = "incompressible_penalty" if ELEMENTS[element][2] is None else "incompressible"
    return make(name, bulk=f"{bulk} MPa")


def neo_hooke(mu: float, bulk: float) -> tuple[Effect, ...]:
    """Material of the moduli ``mu`` and ``bulk`` [MPa], the latter in mixed form."""
    return make("neo_hooke", mu=f"{mu} MPa"), make("incompressible", bulk=f"{bulk} MPa")


def mooney_rivlin(c1: float, c2: float, bulk: float) -> tuple[Effect, ...]:
    """Material of ``c1``, ``c2`` and the modulus ``bulk`` [MPa], the latter in mixed form."""
    return make("mooney_rivlin", c1=f"{c1} MPa", c2=f"{c2} MPa"), make("incompressible", bulk=f"{bulk} MPa")


def zero() -> float:
    """The truth of what must vanish."""
    return 0.0


def once(lab: Lab, value: Value, count: int) -> Finding:
    """The ``value`` with ``count`` cells."""
    return Finding(value(lab, count))


def ladder(lab: Lab, value: Value, counts: tuple[int, ...], size: float, truth: Callable[[], float]) -> Finding:
    """The ``value`` with the last of ``counts`` cells, of size ``size / count`` [mm], and its convergence."""
    steps = tuple((size / count, value(lab, count)) for count in counts)
    return Finding(steps[-1][1], catalogue.order(steps, truth()), steps)
