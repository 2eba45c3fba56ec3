"""The evidence for each quantity of a muscle, and a grade. The evidence consists of closed forms, other codes, experiments, the
numerical error bar, and the band of published models.
"""

import math
import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from fem_reference.assessment import experiments
from fem_reference.assessment.catalogue import Entry, Result
from fem_reference.assessment.experiments import Fact, Kind
from fem_reference.assessment.moment_arms import ArmsBeside
from fem_reference.foundations.records import Record, parse

FILE = Path(__file__).with_suffix(".toml")
_ROUNDED = 0.5  # the rounding error of a percentage published without decimals
_WHOLE = 100.0  # [%], all poses
_READ = ("publication", "abstract", "quotation", "memory")  # kinds of text in which numbers were read, best first
# "outside": the model differs from at least one measurement by more than its uncertainty, even if it agrees with others.
Grade = Literal["validated", "indicative", "outside", "verified only", "not compared"]


class Evidence(Record):
    """The stated evidence for a quantity.

    ``verified``: the groups of the catalogue that verify it. ``closed_forms``, ``other_codes`` and ``bar``: closed forms,
    comparisons with other codes and the numerical error bar, in words. ``band``: the name of the facts on differences between
    models and real muscles; ``band_of``: a description of these differences. ``experiments``: the experiments with which the
    quantity is compared; ``compared``: a description of these comparisons. ``arms``: True if moment arms are compared with
    published moment arms.
    """

    name: str
    unit: str
    verified: tuple[str, ...]
    closed_forms: str
    other_codes: str
    bar: str
    band: str = ""
    band_of: str = ""
    compared: str = ""
    experiments: tuple[str, ...] = ()
    arms: bool = False


class _File(Record):
    quantity: tuple[Evidence, ...]


def claims() -> tuple[Evidence, ...]:
    """The stated evidence for all quantities."""
    return parse(_File, tomllib.loads(FILE.read_text(encoding="utf-8")), FILE.name).quantity


@dataclass(frozen=True)
class Beside:
    """A ``value`` of the model compared with a known value (``truth``), both in ``unit``.

    ``within``: the uncertainty of the known value. ``n``: the number of specimens, None if unknown. ``met``: True if the values
    agree. ``validates``: True if agreement counts as validation. ``rests_on``: the kind of text in which the known value was read,
    with notes on a tolerance that was chosen and on a recalled model. ``kind``: measurement, or model if the known value is that of
    another model. ``is_order``: True for a ranking of stiffnesses: the value is 1 if the ranking is reproduced and 0 if it is not,
    and the tolerance is 0.5.
    """

    name: str
    title: str
    unit: str
    value: float
    truth: float
    within: float
    n: int | None
    met: bool
    validates: bool
    experiment: str
    rests_on: str
    remark: str = ""
    kind: Kind = "measurement"
    is_order: bool = False


def count(several: Iterable[Beside], kind: Kind) -> tuple[int, int]:
    """The number of comparisons of a ``kind`` that agree, and the number of all comparisons of this kind."""
    met = [one.met for one in several if one.kind == kind]
    return sum(met), len(met)


@dataclass(frozen=True, eq=False)
class Row:
    """A quantity (``claim``) with its evidence.

    ``kinds``: the number of catalogue entries of each kind that verify the quantity. ``orders``: the orders of convergence that
    these entries must show. ``band``: the facts with the minimum and the maximum difference between models and real
    muscles. ``beside``: the comparisons with experiments.
    """

    claim: Evidence
    kinds: Mapping[str, int]
    orders: tuple[float, ...]
    band: tuple[Fact, ...]
    beside: tuple[Beside, ...]

    @property
    def measured(self) -> tuple[int, int]:
        """The number of measurements with which the model agrees within their uncertainty, and the number of all measurements."""
        return count(self.beside, "measurement")

    @property
    def models(self) -> tuple[int, int]:
        """The number of other models with which the model agrees to within a tolerance, and the number of all other models.
        Agreement with another model is not evidence about muscles.
        """
        return count(self.beside, "model")

    @property
    def misses(self) -> tuple[float, ...]:
        """The deviations from measured values, divided by the uncertainties of these values. Rankings are left out."""
        measured = [one for one in self.beside if one.kind == "measurement" and not one.is_order]
        return tuple((one.value - one.truth) / one.within for one in measured)

    @property
    def bias(self) -> float:
        """The mean of :attr:`misses`; NaN without misses."""
        return float(np.mean(self.misses)) if self.misses else math.nan

    @property
    def scatter(self) -> float:
        """The standard deviation of :attr:`misses`; NaN without misses."""
        return float(np.std(self.misses)) if self.misses else math.nan

    @property
    def grade(self) -> Grade:
        """The grade: "outside" if the model disagrees with at least one measurement, otherwise "validated" if at least one
        comparison validates, otherwise "indicative". Without measurements it is "not compared" if experiments are known but have no
        results, and "verified only" if none are known. Comparisons with models do not count.
        """
        met, of = self.measured
        if of == 0:
            return "not compared" if self.claim.arms or self.claim.experiments else "verified only"
        if met < of:
            return "outside"
        return "validated" if any(one.validates for one in self.beside) else "indicative"


def verifying(claim: Evidence, entries: Iterable[Entry]) -> list[Entry]:
    """The ``entries`` of the catalogue that verify a ``claim``. Raises LookupError if one of its groups does not exist."""
    behind = [one for one in entries if one.group in claim.verified]
    if missing := set(claim.verified) - {one.group for one in behind}:
        raise LookupError(f"{claim.name}: no group {sorted(missing)} in the catalogue")
    return behind


def row(claim: Evidence, entries: Iterable[Entry], results: Mapping[str, Result], arms: Iterable[ArmsBeside]) -> Row:
    """The row of a ``claim``. ``entries``: all entries of the catalogue. ``results``: the results of experiments, by name.
    ``arms``: moment arms compared with published ones.

    Raises KeyError if an experiment has no result, and LookupError if a group of the catalogue does not exist.
    """
    behind = verifying(claim, entries)
    orders = {one.refinement.order for one in behind if one.refinement and one.refinement.order is not None}
    beside = [of_result(results[name]) for name in claim.experiments]
    beside += [of_arms(one) for one in arms] if claim.arms else []
    kinds, band = Counter(str(one.kind) for one in behind), experiments.model_band(claim.band)
    return Row(claim, kinds, tuple(sorted(orders)), band, tuple(beside))


def of_result(found: Result) -> Beside:
    """The comparison stated by the result of a catalogue entry of the kind "experiment". It validates only if all facts of the
    entry validate and no part of its model is recalled.
    """
    entry = found.entry
    facts = entry.facts
    counted = not entry.from_memory and bool(facts) and all(one.validates for one in facts)
    n = experiments.least_specimens(facts)
    met = found.word == "within"
    coarser = [f"Cells of {size:.3g} mm give {value:.4g}." for size, value in found.finding.ladder[:-1]]
    return Beside(
        *(entry.name, entry.title, entry.unit, found.finding.value, found.truth, found.within, n, met, counted),
        experiment=facts[0].experiment if facts else "",
        rests_on=_rests_on(facts, is_order=entry.is_order, from_memory=entry.from_memory),
        remark=" ".join([*coarser, *filter(None, [found.finding.note]), f"Compared with: {entry.source}."]),
        is_order=entry.is_order,
    )


def _rests_on(facts: tuple[Fact, ...], *, is_order: bool, from_memory: bool) -> str:
    """The least reliable kind of text in which ``facts`` were read, with notes on a chosen tolerance and a recalled model."""
    read = max((one.read_in for one in facts), key=_READ.index, default="not known")
    chosen = not is_order and not (facts and all(one.sd for one in facts))
    remembered = from_memory and all(one.doi_confirmed == "yes" for one in facts)
    return f"{read}{'; ± chosen by us' if chosen else ''}{'; part of the model recalled' if remembered else ''}"


def of_arms(arms: ArmsBeside) -> Beside:
    """The comparison of moment arms with a published curve or range.

    A measured curve should lie within the range of the fibres in all poses. The fibres should cover at
    least the same percentage of the range of another model as the moment arms of Modenese and Kohout 2020 cover.
    """
    others_reach = reached(arms)
    inside = "poses with the measured moment arm inside the fibres' range"
    words = inside if arms.is_curve else "overlap with a model's range"
    title = f"{arms.muscle.replace('_', ' ').capitalize()}, {arms.sense}: {words} ({arms.case} and {arms.experiment})"
    share, truth = 100 * arms.share, _WHOLE if arms.kind == "measurement" else others_reach
    others = f"; fibres of another model of this body reach {others_reach:g} %" if arms.kind == "measurement" else ""
    return Beside(
        *(f"{arms.case}-{arms.experiment}", title, "%", share, truth, _ROUNDED, None),
        *(share >= truth - _ROUNDED, False),
        experiment=arms.experiment,
        rests_on="quotation, digitised; no ± known",
        remark=f"bias {arms.bias:.1f} mm, scatter {arms.scatter:.1f} mm over {arms.known} of {len(arms.found.angles)} poses with "
        f"a published moment arm; {arms.setting}; on larger tetrahedra the mean changes by {arms.coarser:.1f} mm{others}",
        kind=arms.kind,
    )


def reached(arms: ArmsBeside) -> float:
    """The percentage that corresponds to ``arms.share``, for the fibres of Modenese and Kohout 2020 on the same body."""
    quantity = "share_inside" if arms.is_curve else "overlap"
    return experiments.find("modenese_kohout_2020", quantity, arms.muscle.replace("_", " ")).value


@dataclass(frozen=True)
class Fitted:
    """The best fit of a ``law`` to the quantities of cubes that are named in ``to``.

    ``parameters``: by name, the fitted value of a parameter and its published range, None if no range is known. ``values``: the
    values of all quantities, by name. ``converged``: True if the fit ended at a minimum of the sum of squares, False if it used up
    its ``evaluations`` first.
    """

    law: str
    parameters: Mapping[str, tuple[float, tuple[float, float] | None]]
    values: Mapping[str, float]
    to: tuple[str, ...]
    converged: bool
    evaluations: int

    @property
    def inside(self) -> bool | None:
        """True if every parameter with a published range lies inside it; None if no parameter has a published range."""
        known = [low <= value <= high for value, found in self.parameters.values() if found for low, high in [found]]
        return all(known) if known else None


@dataclass(frozen=True, eq=False)
class Credibility:
    """The evidence for all quantities: ``rows``, moment ``arms`` (``missing``: why a case has none), and ``fits`` of laws."""

    rows: tuple[Row, ...]
    arms: tuple[ArmsBeside, ...]
    missing: Mapping[str, str]
    fits: tuple[Fitted, ...]
