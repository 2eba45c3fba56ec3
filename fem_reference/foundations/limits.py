"""Ranges of deformation in which a law is valid, of parameters in the literature, and the tolerance of the energy balance."""

from dataclasses import dataclass
from math import inf
from typing import Literal

from fem_reference.foundations.records import Record

# The accepted difference of energy and work in a load step, as a fraction of the maximum energy so far. Above it the balance is
# computed again with a state halfway through the step; if a difference remains, the run is doubtful.
ENERGY_GAP = 0.05

# V/V0 is det F; the fibre stretch is the stretch in the energies, isochoric and with the prestretch.
Measure = Literal["V/V0", "fibre stretch"]


@dataclass(frozen=True)
class Limit:
    """The states in which a law is valid: their ``measure`` is between ``low`` and ``high``, both without unit."""

    measure: Measure
    low: float = 0.0
    high: float = inf


class Range(Record):
    """The range of a parameter in the literature, from ``low`` to ``high`` as scene files write them, and its ``source``. All
    values in the range are equally likely (``spread`` ``"uniform"``), or all their logarithms (``"log-uniform"``).
    """

    low: str | float
    high: str | float
    source: str
    spread: Literal["uniform", "log-uniform"] = "uniform"
