"""Ranges of validity of laws, ranges of parameters in the literature, and the tolerance of the energy balance."""

from dataclasses import dataclass
from math import inf
from typing import Literal

from fem_reference.foundations.records import Record

# The accepted difference between the change of energy and the work in a load step, as a fraction of the maximum energy so far. If
# the difference is larger, the balance is computed again with an additional state halfway through the step; if it is still larger,
# the run is doubtful.
ENERGY_GAP = 0.05

# V/V0 is det F. The fibre stretch is the stretch on which the energies depend: isochoric, and including the prestretch.
Measure = Literal["V/V0", "fibre stretch"]


@dataclass(frozen=True)
class Limit:
    """Range in which a law is valid: its ``measure``, which is dimensionless, lies between ``low`` and ``high``."""

    measure: Measure
    low: float = 0.0
    high: float = inf


class Range(Record):
    """Range of a parameter in the literature, from ``low`` to ``high`` (written as in scene files), and its ``source``. All values
    in the range are equally likely (``spread`` ``"uniform"``), or all their logarithms are (``"log-uniform"``).
    """

    low: str | float
    high: str | float
    source: str
    spread: Literal["uniform", "log-uniform"] = "uniform"
