"""What accuracy costs on cases: points of error and cost, as pages show them and files keep them."""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from fem_reference.assessment.claims import Claim
from fem_reference.assessment.fronts import Point
from fem_reference.assessment.growth import Growth
from fem_reference.foundations.errors import InputError
from fem_reference.io import texts

FORMAT = 1


@dataclass(frozen=True, eq=False)
class CaseStudy:
    """The points of a case; ``units`` of errors by ``metric.statistic``, and ``bars``, the error bars of the truth, by the same;
    ``truth``: in words what that is; ``claims``: error bars of coarser members beside their errors; ``triangles``,
    ``travel`` [mm], the greatest displacement of the truth; ``features``, what the case is like as far as its scene says
    (:mod:`studies.features`).
    """

    case: str
    title: str
    truth: str
    points: tuple[Point, ...]
    units: dict[str, str]
    bars: dict[str, float]
    claims: tuple[Claim, ...]
    triangles: int
    travel: float
    features: dict[str, float] = field(default_factory=dict)

    @property
    def counted(self) -> tuple[Point, ...]:
        """The points with errors as they count: an error below the truth's bar is that bar, as nothing is known below it, and so
        is that of the truth itself.
        """
        names = {name for point in self.points for name in point.errors}
        own = {name: bar for name, bar in self.bars.items() if name in names}
        return tuple(
            replace(point, errors=own if point.is_truth else self._at_least_bars(point.errors)) for point in self.points
        )

    def _at_least_bars(self, errors: dict[str, float]) -> dict[str, float]:
        return {name: max(value, self.bars.get(name, 0.0)) for name, value in errors.items()}


@dataclass(frozen=True, eq=False)
class Study:
    """Studies of cases; ``missing``: by case, why it was left out; ``origin``: with what and on what it was measured; ``growth`` of
    costs with size, where that was measured too.
    """

    cases: tuple[CaseStudy, ...]
    missing: dict[str, str] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)
    growth: tuple[Growth, ...] = ()

    @property
    def points(self) -> tuple[Point, ...]:
        """All points of all cases."""
        return tuple(point for case in self.cases for point in case.points)


def facts(case: CaseStudy, origin: dict[str, str]) -> dict[str, Any]:
    """The study of a case as valid JSON."""
    return {"format": FORMAT, **asdict(case), "origin": origin}


def load(path: Path) -> CaseStudy:
    """The study of a case from the file that :func:`facts` went into; InputError where it is none."""
    try:
        found = texts.read_json(path, "a study as the verb study writes it")
        if found.pop("format") != FORMAT:
            raise InputError(f"{path}: format", "another one", str(FORMAT))
        del found["origin"]
        return TypeAdapter(CaseStudy).validate_python(found)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(path, repr(error), "a study as the verb study writes it") from error
