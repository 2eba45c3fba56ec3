"""The page ``credibility``: evidence for each quantity, in the manner of NIST's study of fire models and of ASME V&V 40."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment.credibility import Beside, Credibility, Row, count, of_arms, reached
from fem_reference.assessment.experiments import experiments
from fem_reference.assessment.moment_arms import ArmsBeside
from fem_reference.io.texts import finite, plain
from fem_reference.report.drawings import Drawing, colour_of, drawn
from fem_reference.report.pages import Page

COMMON = (0.0, 57.0)  # range of hip flexion [deg] that every case completes
GRADES = {
    "validated": "within the scatter of an experiment over several specimens, read in its publication or abstract; no part of the "
    "model is recalled",
    "indicative": "within the uncertainty of all measurements, each of which is from one specimen, quoted, fitted or recalled",
    "outside": "the model differs from a measurement of muscle by more than its uncertainty, or a measured moment arm is not "
    "within the range of the fibres in all poses",
    "verified only": "the equations are solved correctly; no measurement of muscle is compared with it",
    "not compared": "the data of its experiment are not installed",
}


def page(found: Credibility) -> Page:
    """The page of the evidence for each quantity."""
    contents = {
        "found": found,
        "by_grade": by_grade(found),
        "met": {
            (fit.law, one.name): met(fit.values, one) for fit in found.fits for row in found.rows for one in row.beside
        },
        "records": dict(sorted(experiments().items(), key=lambda item: item[0] == "scale")) if found.rows else {},
        "differences": {row.claim.name: differences(row, found.arms) for row in found.rows},
        "specimens": {row.claim.name: specimens(row) for row in found.rows},
        "source": source,
        "drawings": [_drawing(one) for one in found.arms],
    }
    return Page("credibility", "Credibility", (("", "", said(found)),), "credibility_page.html", contents, facts(found))


def by_grade(found: Credibility) -> list[tuple[str, list[str], str]]:
    """Each grade that occurs, with its quantities and its meaning. The grade "validated" is listed even without quantities."""
    names = {grade: [row.claim.name for row in found.rows if row.grade == grade] for grade in GRADES}
    return [(grade, names[grade], meaning) for grade, meaning in GRADES.items() if names[grade] or grade == "validated"]


def said(found: Credibility) -> str:
    """The number of quantities by grade, and the number of measurements and other models that agree."""
    counts = Counter(str(row.grade) for row in found.rows)
    grades = ", ".join(f"{counts[grade]} {grade}" for grade in GRADES if counts[grade])
    beside = [one for row in found.rows for one in row.beside]
    (met_by, measured), (near, models) = count(beside, "measurement"), count(beside, "model")
    within = f"{met_by} of {measured} measurements within their uncertainty"
    return f"{len(found.rows)} quantities: {grades}; {within}, {near} of {models} other models within the tolerance"


def met(values: Mapping[str, float], one: Beside) -> bool | None:
    """True if the value for a comparison is within the uncertainty of the comparison; None without a value."""
    return abs(values[one.name] - one.truth) <= one.within if one.name in values else None


def differences(row: Row, arms: Iterable[ArmsBeside]) -> str:
    """The number of values of the model that are too large and too small, and their differences from measurements, in words.

    Differences are in units of the uncertainty; for moment arms they are means over the poses of each case [mm]. Wrong rankings are
    counted separately.
    """
    own = [one for one in row.beside if one.kind == "measurement"]
    orders, numbers = ([one for one in own if one.is_order is kind] for kind in (True, False))
    missed = [(one.value - one.truth) / one.within for one in numbers if not one.met]
    unit = "uncertainties"
    if row.claim.arms:
        missed, unit = [one.bias for one in arms if one.kind == "measurement" and not of_arms(one).met], "mm"
    great, small = ([side * far for far in missed if side * far > 0] for side in (1, -1))
    said = [
        f"{len(far)} too {word}, by {_span(far)} {unit}" for word, far in (("large", great), ("small", small)) if far
    ]
    if lost := sum(map(math.isnan, missed)):
        said.append(f"{lost} without a number")
    if orders:
        said.append(f"{sum(not one.met for one in orders)} of {len(orders)} stiffness rankings wrong")
    return "; ".join(said)


def _span(values: list[float]) -> str:
    low, high = (f"{end:.2g}" for end in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def specimens(row: Row) -> str:
    """The number of specimens in each source of measurements."""
    known = {one.experiment: one.n for one in row.beside if one.kind == "measurement"}
    return ", ".join(f"{source(name)}: {n or 'not known'}" for name, n in known.items())


def source(experiment: str) -> str:
    """The author and the year of an experiment.

    >>> source("van_loocke_2006")
    'Van Loocke 2006'
    """
    return experiment.replace("_", " ").title()


def facts(found: Credibility) -> dict[str, Any]:
    """The contents of the page as valid JSON."""
    rows = [
        {
            "quantity": row.claim.name,
            "grade": row.grade,
            "kinds": dict(row.kinds),
            "orders": list(row.orders),
            "other_codes": row.claim.other_codes,
            "bar": row.claim.bar,
            "band": [f"{one.value:g} {one.unit}" for one in row.band],
            "differences": differences(row, found.arms),
            "specimens": specimens(row),
            **{name: finite(getattr(row, name)) for name in ("bias", "scatter")},
            **{
                kind: dict(zip(("met", "of"), count(row.beside, kind), strict=True))
                for kind in ("measurement", "model")
            },
            "beside": [plain(one) for one in row.beside],
        }
        for row in found.rows
    ]
    arms = [
        {
            **{name: getattr(one, name) for name in ("case", "muscle", "sense", "experiment", "kind", "setting")},
            **{name: finite(getattr(one, name)) for name in ("share", "bias", "scatter", "coarser")},
            "poses": one.known,
            "angles": [float(angle) for angle in one.found.angles[[0, -1]]],
            "reached": reached(one),
            "common": finite(one.between(*COMMON).share),
        }
        for one in found.arms
    ]
    fits = [plain(one) | {"inside": one.inside} for one in found.fits]
    return {"rows": rows, "arms": arms, "fits": fits, "missing": dict(found.missing)}


def _drawing(arms: ArmsBeside) -> Drawing:
    """A drawing of the range of the fibres' moment arms over the angle, with the published curve or range."""

    def draw(_: Figure, axes: Axes) -> None:
        at, own, known = arms.found.angles, arms.found, arms.published
        axes.fill_between(
            at, own.low, own.high, color=colour_of(1), alpha=0.35, linewidth=0, label="fibres of the reference"
        )
        axes.plot(at, arms.middle, color=colour_of(1), label="mean of these fibres")
        if arms.is_curve:
            axes.plot(at, known.low, "--", color="#1d1d1f", label="published")
        else:
            axes.plot(at, known.low, "--", color="#1d1d1f", label="published range")
            axes.plot(at, known.high, "--", color="#1d1d1f")
        axes.set(xlabel="hip flexion, degrees", ylabel=f"{arms.sense} moment arm, mm")
        axes.legend(fontsize="x-small")

    share = "unknown" if math.isnan(arms.share) else f"{100 * arms.share:.0f} %"
    what = "of poses inside" if arms.is_curve else "of the range covered"
    title = f"{arms.muscle.replace('_', ' ').capitalize()} and {arms.experiment}: {share} {what}"
    return drawn(f"arms-{arms.case}-{arms.experiment}", title, (4.6, 3.6), draw)
