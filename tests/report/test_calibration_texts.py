"""A calibration in words: what is determined, what is not, and what is at its bound."""

from dataclasses import replace

from fem_reference.assessment.calibration import Calibration, Estimate, Measurement
from fem_reference.assessment.uncertainty import Failure, Parameter
from fem_reference.report.calibration_texts import text

MU = Parameter("effect[0].mu", "neo_hooke mu", "MPa", 0.01, 0.004, 0.02, "uniform", "")
ROW = Measurement(10, "force.lid", 2.0, "N", 0.1, "row 2")


def found(scatter: float, *estimates: Estimate) -> Calibration:
    return Calibration(
        "bar", estimates, (ROW,), (2.0,), scatter, (12.0, 0.5), (("mu", "c1", -0.98),), 7, converged=True
    )


def test_an_estimate_has_its_interval() -> None:
    known = Estimate(MU, 0.011, 0.0105, 0.0115)
    lines = text(found(1.1, known)).splitlines()
    assert lines[0] == "bar: 1 parameters from 1 measurements, 7 runs requested"
    assert lines[1] == "  neo_hooke mu: 0.011 MPa, 95 % from 0.0105 to 0.0115"
    assert lines[2].endswith("1.10 standard deviations of the data")
    assert lines[3] == "  not determined separately: mu and c1, whose errors are correlated by -0.980"
    assert lines[4] == "  singular values of the sensitivities: 12, 0.500"


def test_what_does_not_count_is_said() -> None:
    wide = Estimate(MU, 0.011, float("-inf"), float("inf"))
    assert "from -inf to inf: not determined by these measurements" in text(found(1.0, wide))
    bound = replace(wide, value=0.02, low=0.019, high=0.021, at="high")
    assert "at the high end of its range, 0.02 MPa, so neither value nor interval is meaningful" in text(
        found(1.0, bound)
    )
    assert ": the law does not fit the data" in text(found(3.0, wide))
    assert ": the data scatter less than their standard deviations" in text(found(0.1, wide))


def test_a_fit_that_could_not_go_on_says_where_and_has_no_intervals() -> None:
    lost = Failure({"effect[0].mu": 0.019}, "diverged", "frame 40")
    best = Estimate(MU, 0.011, float("-inf"), float("inf"))
    ended = replace(found(1.0, best), failures=(lost,), ended="a run that the fit needs has no result")
    assert text(ended).splitlines()[1:] == [
        "  no result: diverged: frame 40 (effect[0].mu = 0.019)",
        "  no fit: a run that the fit needs has no result; the best point so far:",
        "  neo_hooke mu: 0.011 MPa",
    ]
    assert "best point" not in text(replace(ended, estimates=()))


def test_a_fit_that_has_not_converged_says_so() -> None:
    whole = found(1.0, Estimate(MU, 0.011, 0.0105, 0.0115))
    assert "not converged" not in text(whole)
    assert "  not converged: a further step could reduce" in text(replace(whole, converged=False))
