"""A calibration as lines of text: estimates with their intervals, and parameters that the measurements do not determine."""

from fem_reference.assessment.calibration import CONFIDENCE, FOLLOWED, Calibration, Estimate
from fem_reference.report.words import number

# A scatter below this value, in standard deviations of the data, is remarked upon.
_LITTLE = 0.5


def text(found: Calibration) -> str:
    """A calibration as lines of text."""
    lines = [
        f"{found.case}: {len(found.estimates)} parameters from {len(found.rows)} measurements, {found.runs} runs requested"
    ]
    for one in found.failures:
        values = ", ".join(f"{key} = {value:g}" for key, value in one.values.items())
        lines.append(f"  no result: {one.status}: {one.message} ({values})")
    if found.ended:
        lines.append(f"  no fit: {found.ended}{'; the best point so far:' if found.estimates else ''}")
        best = [f"  {one.parameter.title}: {one.value:.5g} {one.parameter.unit}".rstrip() for one in found.estimates]
        return "\n".join([*lines, *best])
    if not found.converged:
        lines.append("  not converged: a further step could reduce the residuals")
    lines += [_line(one) for one in found.estimates]
    lines.append(
        f"  scatter of the residuals: {number(found.scatter)} standard deviations of the data{_remark(found.scatter)}"
    )
    lines += [
        f"  not determined separately: {one} and {other}, whose errors are correlated by {correlation:.3f}"
        for one, other, correlation in found.pairs
    ]
    values = ", ".join(number(one) for one in found.singular)
    return "\n".join([*lines, f"  singular values of the sensitivities: {values}"])


def _line(one: Estimate) -> str:
    """An estimate with its interval, and a remark if the parameter is not determined."""
    unit = f" {one.parameter.unit}" if one.parameter.unit else ""
    said = (
        f"  {one.parameter.title}: {one.value:.5g}{unit}, {100 * CONFIDENCE:.0f} % from {one.low:.5g} to {one.high:.5g}"
    )
    if one.at:
        end = getattr(one.parameter, one.at)
        return f"{said}: at the {one.at} end of its range, {end:.5g}{unit}, so neither value nor interval is meaningful"
    return said if one.is_known else f"{said}: not determined by these measurements"


def _remark(scatter: float) -> str:
    """The meaning of a scatter that is far from 1."""
    if scatter > FOLLOWED:
        return ": the law does not fit the data"
    return ": the data scatter less than their standard deviations" if scatter < _LITTLE else ""
