"""The range of deformation in which a law is valid, that of a parameter in the literature, and how well energy and work agree."""

from dataclasses import dataclass
from math import inf
from typing import Literal

from fem_reference.foundations.records import Record

# Energy that grew without work, or was lost, within a load step, as a share of the greatest so far: beyond it a state halfway is
# looked at, and what then remains makes a run doubtful.
ENERGY_GAP = 0.05

# V/V0 is det F; the fibre stretch is that of the energies: isochoric, and with what is prestretched.
Measure = Literal["V/V0", "fibre stretch"]


@dataclass(frozen=True)
class Limit:
    """A law is meant for states whose ``measure`` lies from ``low`` to ``high``, both without unit."""

    measure: Measure
    low: float = 0.0
    high: float = inf


class Range(Record):
    """The range of a parameter in the literature, from ``low`` to ``high`` as scene files write them, and its ``source``. All
    values in it are taken for equally likely (``spread`` ``"uniform"``), or their logarithms (``"log-uniform"``).
    """

    low: str | float
    high: str | float
    source: str
    spread: Literal["uniform", "log-uniform"] = "uniform"
