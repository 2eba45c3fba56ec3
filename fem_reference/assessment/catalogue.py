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
# The allowed relative difference between the value of an experiment and its pinned value, caused by root finding and processors.
PINNED = 1e-5


class Lab(Protocol):
    """The solvers that measure entries."""

    def solve(self, body: Body, element: str, **settings: float) -> Run:
        """The states of ``body`` computed by the reference, FEniCSx, with an element of ``body.ELEMENTS``; settings as in
        ``BodySettings`` (first_step, smallest_step, newton_iterations, residual [N, mm3]).
        """

    def second(self, body: Body, element: str, **settings: float) -> Run:
        """The states of the same problem computed by the second solver, scikit-fem."""


@dataclass(frozen=True, eq=False)
class Finding:
    """A measurement: the ``value``; on a ladder of meshes also the ``order`` of its error, and the ``ladder`` of (mesh size [mm],
    value) from coarse to fine; ``note``: further facts for readers.
    """

    value: float
    order: float | None = None
    ladder: tuple[tuple[float, float], ...] = ()
    note: str = ""


@dataclass(frozen=True, eq=False)
class Refinement:
    """Meshes or time steps, from coarse to fine.

    ``counts``: numbers of cells or steps, each of ``size / count`` [mm] or [s]. The theoretical ``order`` of the error must be met
    to within 0.5; None: no order is measured. If ``extrapolated``, the value is extrapolated from the last two counts, for an
    error of first order. ``note``: further facts for readers.
    """

    counts: tuple[int, ...]
    size: float
    order: float | None
    extrapolated: bool = False
    note: str = ""

    @property
    def needed(self) -> tuple[int, ...]:
        """The counts needed for the value."""
        return self.counts[-2 if self.extrapolated else -1 :]

    def value(self, found: Sequence[float]) -> float:
        """The judged value, from the values ``found``, in order from coarse to fine."""
        return 2 * found[-1] - found[-2] if self.extrapolated else found[-1]


@dataclass(frozen=True, eq=False)
class Entry:
    """A problem with a known answer.

    ``measure`` computes the number to compare with ``truth``, both in ``unit``. Its arguments are a lab, each count of a
    ``refinement`` if there is one, and the values ``given`` by name. The number must equal the truth to ``within`` (in ``unit``, or
    relative to the truth if ``relative``), for the reason ``because``. ``source``: the source of the truth; ``kind``: its type.
    ``negative_control`` names a deliberate mistake; with the values ``wrong`` instead of ``given`` the entry must fail. ``slow``: a
    measurement takes more than 4 s, or resembles another; ``slow_negative_control``: the same for the control. Only ``verify``
    makes slow measurements.

    An entry of the kind "experiment" compares a model with a muscle: its verdict is "within" or "outside" the uncertainty of the
    experiment, and neither is a failure. It fails if the value no longer equals ``pinned``. ``facts``: the measured numbers from
    which its truth is computed; ``is_order``: True for a stiffness ranking: the value is 1 if it is reproduced, else 0,
    and the tolerance 0.5; ``from_memory``: True if a part of its model or source is recalled, not checked in the publication.
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
        """The finding; the negative control is measured only on the counts that the value needs."""
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
        return Finding(math.nan, note="it measured no value")
    return found if isinstance(found, Finding) else Finding(found)


@dataclass(frozen=True, eq=False)
class Result:
    """The result of an entry. ``word``: the verdict: pass or fail, inconclusive without a truth, and for an experiment within or
    outside; ``error``: the absolute error, and ``within``: its bound, both in the unit of the entry. Without a measurement or a
    truth they are NaN, and the note of the finding gives the reason.
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
        """Pass, fail or inconclusive; for an experiment within or outside its uncertainty, or fail if the value has changed."""
        judged, pinned = judge(self.finding.value, self.truth, self.within), self.entry.pinned
        if pinned is None:
            return judged
        if judge(self.finding.value, pinned, PINNED * abs(pinned)) != "pass":
            return "fail"
        return {"pass": "within", "fail": "outside"}.get(judged, judged)


def result(entry: Entry, finding: Finding, seconds: float, *, with_negative_control: bool) -> Result:
    """The result of an entry: its finding, compared with its truth."""
    truth = entry.known()
    within = entry.within * (abs(truth) if entry.relative else 1.0)
    return Result(entry, finding, truth, within, seconds, with_negative_control)


def order(ladder: tuple[tuple[float, float], ...], truth: float) -> float | None:
    """The order of the error over the last two meshes of a ``ladder`` of (size, value), None if either is exact.

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
    """The ``results`` of entries in the order of the catalogue, the wall time in ``seconds``, and the ``versions`` of packages."""

    results: tuple[Result, ...]
    seconds: float
    versions: dict[str, str]

    @property
    def failed(self) -> tuple[Result, ...]:
        """The results that do not pass; experiments within or outside their uncertainty pass."""
        return tuple(one for one in self.results if one.word not in ("pass", "within", "outside"))

    @property
    def judged(self) -> tuple[Result, ...]:
        """The results with a verdict of pass, fail or inconclusive: of all entries except experiments."""
        return tuple(one for one in self.results if one.entry.kind != "experiment")

    @property
    def passed(self) -> str:
        """The number of judged results that pass, in words; empty if there are none."""
        failed = sum(one in self.failed for one in self.judged)
        return f"{len(self.judged) - failed} of {len(self.judged)} pass" if self.judged else ""

    @property
    def beside(self) -> str:
        """The number of experiments, and the number that agree within their uncertainty, in words; empty without experiments."""
        words = [one.word for one in self.results if one.entry.kind == "experiment"]
        return f"{words.count('within')} of {len(words)} experiments agree within their uncertainty" if words else ""

    @property
    def word(self) -> str:
        """Pass or fail."""
        return "fail" if self.failed else "pass"

    @property
    def summary(self) -> str:
        """The verdict in one line."""
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
