"""Entries of the verification catalogue (problems with known answers) and their results."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from fem_reference.assessment.experiments import Fact
from fem_reference.assessment.judge import judge
from fem_reference.problems.body import Body
from fem_reference.runs.store import Run

Kind = Literal["closed form", "published", "second solver", "property", "experiment"]
# The allowed relative difference between the value of an experiment and its pinned value. Such differences come from root finding
# and from different processors.
PINNED = 1e-5


class Lab(Protocol):
    """The two solvers with which entries are measured."""

    def solve(self, body: Body, element: str, **settings: float) -> Run:
        """Solve ``body`` with the reference solver, FEniCSx, using an ``element`` of ``body.ELEMENTS``. The ``settings`` are keys
        of ``BodySettings`` (first_step, smallest_step, newton_iterations, residual [N, mm3]).
        """

    def second(self, body: Body, element: str, **settings: float) -> Run:
        """Solve the same problem with the second solver, scikit-fem."""


@dataclass(frozen=True, eq=False)
class Finding:
    """The result of a measurement: the measured ``value``. ``ladder``: for each of several meshes or time steps, its size ([mm]
    or [s]) and the value, from coarse to fine. ``order``: the order of convergence of the error on the ladder. ``note``: further
    facts for readers.
    """

    value: float
    order: float | None = None
    ladder: tuple[tuple[float, float], ...] = ()
    note: str = ""


@dataclass(frozen=True, eq=False)
class Refinement:
    """A sequence of meshes or time steps, from coarse to fine.

    ``counts``: the numbers of cells or steps, each of ``size / count`` [mm] or [s]. ``order``: the theoretical order of
    convergence, from which the measured order may differ by at most 0.5; None if no order is measured. ``extrapolated``: True if
    the value is extrapolated from the last two counts, for an error of first order. ``note``: further facts for readers.
    """

    counts: tuple[int, ...]
    size: float
    order: float | None
    extrapolated: bool = False
    note: str = ""

    @property
    def needed(self) -> tuple[int, ...]:
        """The counts that are needed for the value."""
        return self.counts[-2 if self.extrapolated else -1 :]

    def value(self, found: Sequence[float]) -> float:
        """The value that is judged. ``found``: the measured values, from coarse to fine."""
        return 2 * found[-1] - found[-2] if self.extrapolated else found[-1]


@dataclass(frozen=True, eq=False)
class Entry:
    """A problem with a known answer.

    ``measure`` computes the number that is compared with ``truth``, both in ``unit``. Its arguments are a lab, a count if there is
    a ``refinement`` (it is called for each count), and the values ``given`` by name. The number must equal the truth to within
    ``within`` (in ``unit``, or relative to the truth if ``relative``), for the reason in ``because``. ``source`` and ``kind``: the
    source of the truth and its type. ``negative_control``: a deliberate mistake, in words: with the values ``wrong`` instead of
    ``given`` the entry must fail. ``slow``: True if a measurement takes more than 4 s, or resembles another measurement;
    ``slow_negative_control``: the same for the negative control. Only the verb ``verify`` makes slow measurements.

    An entry of the kind "experiment" compares a model with a real muscle. Its verdict is "within" or "outside" the uncertainty of
    the experiment, and neither is a failure; the entry fails if the value no longer equals ``pinned``. ``facts``: the measured
    numbers from which the truth is computed. ``is_order``: True for a ranking of stiffnesses: the value is 1 if the ranking is
    reproduced and 0 if it is not, and the tolerance is 0.5. ``from_memory``: True if a part of the model or of its source is
    recalled and was not checked against the publication.
    """

    name: str
    group: str
    title: str
    unit: str
    measure: Callable[..., "float | Finding"]
    given: Mapping[str, object]
    negative_control: str
    wrong: Mapping[str, object]
    truth: float | Callable[[], float]
    within: float
    because: str
    kind: Kind
    source: str
    relative: bool = False
    refinement: Refinement | None = None
    slow: bool = False
    slow_negative_control: bool = False
    pinned: float | None = None
    facts: tuple[Fact, ...] = ()
    is_order: bool = False
    from_memory: bool = False

    def known(self) -> float:
        """The truth, in the unit of the entry."""
        return float(self.truth() if callable(self.truth) else self.truth)

    def find(self, lab: Lab, *, with_negative_control: bool = False) -> Finding:
        """Measure the entry with a ``lab``. The negative control is measured only for the counts that the value needs."""
        given = {**self.given, **(self.wrong if with_negative_control else {})}
        if self.refinement is None:
            return _finding(self.measure(lab, **given))
        needed = self.refinement.needed if with_negative_control else self.refinement.counts
        steps = tuple((self.refinement.size / n, _finding(self.measure(lab, n, **given)).value) for n in needed)
        value = self.refinement.value([found for _, found in steps])
        if with_negative_control:
            return Finding(value)
        fall = None if self.refinement.order is None else order(steps, self.known())
        return Finding(value, fall, steps, self.refinement.note)


def _finding(found: float | Finding | None) -> Finding:
    if found is None:
        return Finding(math.nan, note="no value was measured")
    return found if isinstance(found, Finding) else Finding(found)


@dataclass(frozen=True, eq=False)
class Result:
    """The result of an entry: its ``finding`` compared with the ``truth``.

    ``within``: the allowed absolute error, in the unit of the entry. Without a measurement or a truth the error is NaN, and the
    note of the finding gives the reason. ``seconds``: the duration of the measurement.
    """

    entry: Entry
    finding: Finding
    truth: float
    within: float
    seconds: float
    with_negative_control: bool = False

    @property
    def error(self) -> float:
        """The absolute error, in the unit of the entry."""
        return abs(self.finding.value - self.truth)

    @property
    def word(self) -> str:
        """The verdict: pass, fail or inconclusive. For an experiment it is "within" or "outside" the uncertainty of the
        experiment, or fail if the value has changed.
        """
        judged, pinned = judge(self.finding.value, self.truth, self.within), self.entry.pinned
        if pinned is None:
            return judged
        if judge(self.finding.value, pinned, PINNED * abs(pinned)) != "pass":
            return "fail"
        return {"pass": "within", "fail": "outside"}.get(judged, judged)


def result(entry: Entry, finding: Finding, seconds: float, *, with_negative_control: bool) -> Result:
    """The result of an entry: its ``finding``, compared with the truth."""
    truth = entry.known()
    within = entry.within * (abs(truth) if entry.relative else 1.0)
    return Result(entry, finding, truth, within, seconds, with_negative_control)


def order(ladder: tuple[tuple[float, float], ...], truth: float) -> float | None:
    """The order of convergence on the last two meshes of a ``ladder`` of (size, value); None if one of these two values is exact.

    >>> round(order(((2.0, 1.04), (1.0, 1.01)), 1.0), 6)
    2.0
    """
    (coarse, first), (fine, last) = ladder[-2:]
    errors = abs(first - truth), abs(last - truth)
    if min(errors) == 0:
        return None
    return math.log(errors[0] / errors[1]) / math.log(coarse / fine)


@dataclass(frozen=True, eq=False)
class Verification:
    """The ``results`` in the order of the catalogue, the wall-clock time in ``seconds``, and the ``versions`` of packages."""

    results: tuple[Result, ...]
    seconds: float
    versions: dict[str, str]

    @property
    def failed(self) -> tuple[Result, ...]:
        """The results that do not pass. The verdicts "within" and "outside" on experiments both count as passes."""
        return tuple(one for one in self.results if one.word not in ("pass", "within", "outside"))

    @property
    def judged(self) -> tuple[Result, ...]:
        """The results of all entries except experiments; their verdicts are pass, fail or inconclusive."""
        return tuple(one for one in self.results if one.entry.kind != "experiment")

    @property
    def passed(self) -> str:
        """The number of judged results that pass, in words; empty if there are no judged results."""
        failed = sum(one in self.failed for one in self.judged)
        return f"{len(self.judged) - failed} of {len(self.judged)} pass" if self.judged else ""

    @property
    def beside(self) -> str:
        """The number of experiments that agree within their uncertainty, out of all, in words; empty without experiments."""
        words = [one.word for one in self.results if one.entry.kind == "experiment"]
        return f"{words.count('within')} of {len(words)} experiments agree within their uncertainty" if words else ""

    @property
    def word(self) -> str:
        """The overall verdict, pass or fail."""
        return "fail" if self.failed else "pass"

    @property
    def summary(self) -> str:
        """The overall verdict in one line."""
        controls = sum(one.with_negative_control for one in self.results)
        note = f"{controls} measured with their negative control" if controls else ""
        said = filter(None, (self.word, self.passed, note, self.beside, f"{self.seconds:.0f} s"))
        return f"verdict: {', '.join(said)}"

    @property
    def groups(self) -> dict[str, list[Result]]:
        """The results by group, in the order of the catalogue."""
        found: dict[str, list[Result]] = {}
        for one in self.results:
            found.setdefault(one.entry.group, []).append(one)
        return found
