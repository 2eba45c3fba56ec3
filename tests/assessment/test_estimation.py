"""Records of estimation techniques, with made-up errors for the tests of the page."""

from fem_reference.assessment.estimation import (
    AnswerChange,
    CurveError,
    DecompositionError,
    Estimation,
    FitError,
    HeightError,
    RodError,
)
from fem_reference.geometry.curves import TECHNIQUES


def found() -> Estimation:
    """Errors of two cases, made up."""
    curves = [
        CurveError(case, name, known, rms / known, 2 * rms / known)
        for case in ("one", "other")
        for known in (4, 6)
        for rms, name in enumerate(TECHNIQUES, start=1)
    ]
    heights = [HeightError("one", "origin", choice, 9, 0.1, 1e5) for choice in ("grid", "Halton")]
    fits = [FitError("one", 900, count, 10 / count, 20 / count, 0.99) for count in (10, 30)]
    beside = DecompositionError("one", "CHMD", "file", 3.14, 12.0, 1.05, 0.02, 4)
    changes, bars = {"surface_deviation.rms": 0.123, "joint_moment.force": 4.56}, {"surface_deviation.rms": 0.0789}
    answer = AnswerChange("one", "CHMD", "Laplace field", "converged", changes, bars)
    lost = AnswerChange("one", "file", "Laplace field", "diverged", {}, bars)
    missing = {"lost": "why it was"}
    rods = RodError("one", 20, 2.93, 0.64, 0.18, 0.22)
    return Estimation(tuple(curves), tuple(heights), tuple(fits), missing, (beside,), (answer, lost), (rods,))


def test_numbers_are_counted_for_vertices_and_gaussians() -> None:
    """Three for each of 900 vertices, four for each of 30 Gaussians."""
    assert found().fits[1].fewer == 2700 / 120
