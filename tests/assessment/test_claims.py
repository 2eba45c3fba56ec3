"""Claims of error bars beside true errors: their cover, and what they are made from."""

import numpy as np
import pytest

from fem_reference.assessment.claims import CLAIMED, Claim, Cover, claimed
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.metrics import Measure

NAN = float("nan")


def claim(bar: float, error: float, statistic: str = "rms", case: str = "bar") -> Claim:
    return Claim(case, "deviation", "surface_deviation", statistic, 10, bar, error)


def test_cover_is_a_share_and_a_median_and_leaves_out_what_does_not_differ() -> None:
    found = Cover.of([claim(2, 1), claim(3, 1), claim(0.5, 1), claim(9, 1), claim(1, 0)])
    assert (found.count, found.share, found.median) == (4, 0.75, 2.5)
    assert Cover.of([claim(NAN, 1), claim(2, 1)]).share == 0.5, "what nobody knows covers nothing"
    assert np.isnan(Cover.of([claim(1, 0)]).share)


def test_a_claim_is_a_bar_and_by_how_much_the_finer_solution_differs() -> None:
    bars = ErrorBars(
        (0, 10),
        (1.0, 2.0),
        1.5,
        tuple(ErrorBar("change", *name, "mm", np.array([0.0, 0.4]), {}) for name in CLAIMED),
    )
    one, other = (tuple(Measure(*name, "mm", np.array([0.0, value])) for name in CLAIMED) for value in (5.0, 4.7))
    found = claimed("bar", "change", bars, one, other)
    assert len(found) == 2 * len(CLAIMED)
    assert [(each.frame, each.bar) for each in found[:2]] == [(0, 0.0), (10, 0.4)]
    assert [each.error for each in found[:2]] == pytest.approx([0, 0.3])
