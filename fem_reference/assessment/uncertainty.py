"""Records of uncertainty: bands of results if parameters are uncertain, sensitivities, and candidates compared with bands."""

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
    """A parameter of a case: its ``key``, its ``title`` in words, its value in the case (``nominal``), and its range from ``low``
    to ``high``, all in ``unit``. ``spread``: the distribution over the range. ``source``: the source of the range.
    """

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
        """True if the value in the case is within the range."""
        return self.low <= self.nominal <= self.high

    def value(self, place: float) -> float:
        """The value at a ``place`` in the range, from -1 (low end) to 1 (high end), rounded to six digits.

        >>> Parameter("k", "k", "", 1.0, 1.0, 100.0, "log-uniform", "").value(0.0)
        10.0
        """
        return float(f"{self.at((place + 1) / 2):.6g}")

    def at(self, share: float) -> float:
        """The value at the fraction ``share`` of the range, from 0 to 1 or beyond; :meth:`place` is the inverse function."""
        if self.spread == "log-uniform":
            with np.errstate(over="ignore"):
                return float(np.exp(math.log(self.low) + share * math.log(self.high / self.low)))
        return float(self.low + share * (self.high - self.low))

    def place(self, value: float) -> float:
        """The fraction of the range that lies below a ``value``."""
        if self.spread == "log-uniform":
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class Failure:
    """A run without a result: its parameters (``values``) by key, and the reason (``status`` and ``message``)."""

    values: dict[str, float]
    status: str
    message: str


@dataclass(frozen=True, eq=False)
class Band:
    """The band of a ``quantity`` over frame ``numbers`` (f,), in ``unit``.

    ``low``, ``median`` and ``high`` (f,): the 5th, 50th and 95th percentiles. ``nominal`` (f,): the result of the case. All are NaN
    in frames in which the quantity is not defined. ``bar`` (f,): the numerical error bar of the result of the case, None if it has
    none. ``distance``: True if the quantity is a distance from the result of the case; then values below the band are inside too.

    ``error``: the error of the surrogate at runs that were excluded from its fit, as a fraction of the variance; NaN without a
    surrogate. ``by``: the source of the percentiles, ``"process"`` (a Gaussian process) or ``"runs"``. ``refused``: the reason why
    there is no band. ``first`` and ``total``: by the key of a parameter, the fraction of the variance over all frames that is due
    to it alone (``first``) or also together with others (``total``); empty if the surrogate is not accurate enough, with the reason
    in ``unreliable``.
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
        """The maximum width of the band over the frames, NaN without a band."""
        widths = self.high - (0.0 if self.distance else self.low)
        return float(np.nanmax(widths)) if np.isfinite(widths).any() else math.nan

    @property
    def greatest_bar(self) -> float:
        """The maximum error bar over the frames, NaN without bars."""
        known = self.bar is not None and np.isfinite(self.bar).any()
        return float(np.nanmax(self.bar)) if known else math.nan  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Placed:
    """A candidate compared with a band: in each frame its value (``values``), its verdict (``places``, empty where there is no
    band) and its distance ``beyond`` the band.
    """

    candidate: str
    quantity: str
    values: Floats
    places: tuple[Place, ...]
    beyond: Floats

    @property
    def word(self) -> str:
        """The worst verdict of :attr:`places`; empty if there is none."""
        found = set(self.places)
        return next((word for word in ("no answer", "outside", "undecided", "inside") if word in found), "")

    @property
    def share(self) -> float:
        """The fraction of the frames with a band in which the candidate is inside the band; NaN if no frame has a band."""
        counted = [one for one in self.places if one]
        return counted.count("inside") / len(counted) if counted else math.nan

    @property
    def worst(self) -> float:
        """The maximum distance beyond the band over the frames with an answer, 0 inside the band; NaN without such frames."""
        counted = [far for far, one in zip(self.beyond, self.places, strict=True) if one not in ("", "no answer")]
        return float(max(counted, default=math.nan))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """The ``bands`` of a case, from a number of ``runs`` with parameters sampled by means of a ``seed``.

    ``size`` [mm]: the size of the tetrahedra. ``fixed``: the titles of the parameters that were not varied. ``failures``: the runs
    without a result. ``placed``: the candidates compared with the bands. ``lost``: the reasons why candidates have no run.
    ``seconds``: the mean processor time of a run. ``origin``: the provenance. ``refused``: the reason why the case itself has no
    solution, otherwise empty.
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
    """Compare the ``values`` (f,) of a candidate with a band.

    A value is inside or outside the band if its distance from the nearer end of the band exceeds the error bar of the reference,
    otherwise undecided. Without a bar it is undecided too. A value that is not finite has "no answer".
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
    """The verdict on a value from its distance inside a band (``margin``), which is negative outside the band.

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
