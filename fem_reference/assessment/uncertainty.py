"""Records of uncertainty: the band of a case's results for unknown parameters, its sensitivities, and candidates in the band."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.io.texts import plain

FORMAT = 1
Place = Literal["inside", "undecided", "outside", "no answer", ""]
# The rounding at the ends of a band, as a fraction of its width.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Parameter:
    """A parameter of a case: its ``key``, its ``title`` in words, its value in the case (``nominal``) and range, in ``unit``."""

    key: str
    title: str
    unit: str
    nominal: float
    low: float
    high: float
    spread: str
    source: str

    @property
    def contains(self) -> bool:
        """True if the case's own value is within the range."""
        return self.low <= self.nominal <= self.high

    def value(self, place: float) -> float:
        """The value at a ``place`` in the range, from -1 to 1, rounded to six digits.

        >>> Parameter("k", "k", "", 1.0, 1.0, 100.0, "log-uniform", "").value(0.0)
        10.0
        """
        return float(f"{self.at((place + 1) / 2):.6g}")

    def at(self, share: float) -> float:
        """The value at the fraction ``share`` of the range, from 0 to 1 or beyond; :meth:`place` is its inverse."""
        if self.spread == "log-uniform":
            with np.errstate(over="ignore"):
                return float(np.exp(math.log(self.low) + share * math.log(self.high / self.low)))
        return float(self.low + share * (self.high - self.low))

    def place(self, value: float) -> float:
        """The fraction of the range below a ``value``."""
        if self.spread == "log-uniform":
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class Failure:
    """A run of the design without a result: its parameters by key, and the reason."""

    values: dict[str, float]
    status: str
    message: str


@dataclass(frozen=True, eq=False)
class Band:
    """The band of a ``quantity`` over frame ``numbers`` (f,), in ``unit``: 5th percentile ``low``, ``median`` and 95th percentile
    ``high`` (f,), and the result of the case, ``nominal``; NaN if the quantity is not defined. ``bar`` (f,): the numerical error
    bar of this result, None if it has none. ``distance``: True for a distance from this result; smaller values are always inside.

    ``error``: the error of the surrogate, as a fraction of the variance, at runs excluded from its fit; NaN without a surrogate.
    ``by``: the source of the percentiles, Gaussian ``"process"`` or ``"runs"``; ``refused``: the reason why there is no band.
    ``first`` and ``total``: the fractions of the variance over all frames that are due to each parameter, by its key; empty if the
    surrogate is not accurate enough (``unreliable``).
    """

    quantity: str
    title: str
    unit: str
    numbers: tuple[int, ...]
    nominal: Floats
    low: Floats
    median: Floats
    high: Floats
    bar: Floats | None = None
    distance: bool = False
    error: float = math.nan
    by: str = ""
    refused: str = ""
    unreliable: str = ""
    first: dict[str, float] = field(default_factory=dict)
    total: dict[str, float] = field(default_factory=dict)

    @property
    def width(self) -> float:
        """The maximum width over the frames, NaN without a band."""
        widths = self.high - (0.0 if self.distance else self.low)
        return float(np.nanmax(widths)) if np.isfinite(widths).any() else math.nan

    @property
    def greatest_bar(self) -> float:
        """The maximum error bar over the frames, NaN without a bar."""
        known = self.bar is not None and np.isfinite(self.bar).any()
        return float(np.nanmax(self.bar)) if known else math.nan  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Placed:
    """A candidate in a band: by frame, its ``values``, its ``places`` (empty without a band), its distance ``beyond``."""

    candidate: str
    quantity: str
    values: Floats
    places: tuple[Place, ...]
    beyond: Floats

    @property
    def word(self) -> str:
        """The worst of :attr:`places`; empty if there is none."""
        found = set(self.places)
        return next((word for word in ("no answer", "outside", "undecided", "inside") if word in found), "")

    @property
    def share(self) -> float:
        """The fraction of the frames in which the candidate is inside; NaN if no frame counts."""
        counted = [one for one in self.places if one]
        return counted.count("inside") / len(counted) if counted else math.nan

    @property
    def worst(self) -> float:
        """The maximum distance beyond the band over the frames with an answer, 0 inside it; NaN without such frames."""
        counted = [far for far, one in zip(self.beyond, self.places, strict=True) if one not in ("", "no answer")]
        return float(max(counted, default=math.nan))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """The bands of a case from a number of ``runs`` of a design with a ``seed``, some of them ``failures``; ``fixed``: titles of
    the numbers that were not varied; ``size`` [mm] of the tetrahedra; ``lost``: the reasons why candidates have no run;
    ``seconds``: mean processor time of a run; ``refused``: the reason if the case itself has no solution, else empty.
    """

    case: str
    title: str
    size: float
    parameters: tuple[Parameter, ...]
    fixed: tuple[str, ...]
    runs: int
    seed: int
    failures: tuple[Failure, ...]
    bands: tuple[Band, ...]
    placed: tuple[Placed, ...] = ()
    lost: dict[str, str] = field(default_factory=dict)
    seconds: float = math.nan
    origin: dict[str, str] = field(default_factory=dict)
    refused: str = ""


def place(candidate: str, band: Band, values: Floats) -> Placed:
    """A candidate's ``values`` (f,) compared with a band: inside or outside by more than the error bar of the reference, else
    undecided; also undecided without a bar. A value that is not finite has "no answer".
    """
    bar = np.full(len(values), math.nan) if band.bar is None else band.bar
    above, below = band.high - values, math.inf if band.distance else values - band.low
    margin = (
        np.where(np.isfinite(values), np.minimum(above, below), math.nan)
        + _ROUNDING * np.nan_to_num(band.high - band.low)
        + _ROUNDING**2
    )
    defined = np.isfinite(band.high)
    places = tuple(
        _place(float(far), float(here)) if known else "" for far, here, known in zip(margin, bar, defined, strict=True)
    )
    return Placed(candidate, band.quantity, values, places, np.maximum(-margin, 0.0))


def _place(margin: float, bar: float) -> Place:
    """The place of a value by its distance inside a band (``margin``), negative outside.

    >>> _place(0.5, 0.2), _place(0.1, 0.2), _place(-0.3, 0.2), _place(-0.1, math.nan), _place(math.nan, 0.2)
    ('inside', 'undecided', 'outside', 'undecided', 'no answer')
    """
    if math.isnan(margin):
        return "no answer"
    if margin >= bar:
        return "inside"
    return "outside" if margin < -bar else "undecided"


def facts(found: Uncertainty) -> dict[str, Any]:
    """The bands of a case as valid JSON."""
    table: dict[str, Any] = plain({"format": FORMAT, **vars(found)})
    for placed, one in zip(found.placed, table["placed"], strict=True):
        one |= plain({"word": placed.word, "share": placed.share, "worst": placed.worst})
    return table
