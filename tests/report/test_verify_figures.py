"""Drawings of the catalogue: shares of tolerances, and errors over mesh sizes."""

import math

import pytest

from fem_reference.report import verify_figures
from tests.report.entries import LADDER, NAN, made


@pytest.mark.parametrize(
    ("value", "within", "expected"),
    [(2.01, 0.02, 0.25), (2.0, 0.02, 0.0), (2.16, 0.02, 4.0), (2.0, 0.0, 0.0), (2.1, 0.0, math.inf), (NAN, 0.02, NAN)],
)
def test_share_is_the_error_over_its_bound(value, within, expected) -> None:
    # A difference of numbers near 2 is exact to 4e-16, 1e-14 of the smallest bound.
    found = verify_figures.share(made(value=value, within=within))
    assert found == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_the_overview_names_every_result_whatever_its_value() -> None:
    values = [2.0, 2.01, 2.0 + 1e-14, 3.0, 1e9, math.inf, NAN]
    odd = [made(f"bar_{i}", value, with_negative_control=i % 2 == 1) for i, value in enumerate(values)]
    svg = verify_figures.overview({"long_blocks": odd, "beams": [made("rod", 2.0)]}).markup
    assert all(name in svg for name in ("rod", "long blocks", "beams", *(one.entry.name for one in odd)))
    assert "nan" not in svg.lower()


@pytest.mark.parametrize("value", [2.0, 1e9, NAN])
def test_the_overview_has_axes_for_one_result_without_a_share_to_show(value) -> None:
    assert "10" in verify_figures.overview({"beams": [made(value=value)]}).markup


def test_convergence_shows_the_order_beside_a_whole_slope() -> None:
    svg = verify_figures.convergence(made(order=1.96, ladder=LADDER)).markup
    assert "order 1.96" in svg
    assert "slope 2" in svg
    assert "error [N mm]" in svg
    assert all(f">{size}<" in svg for size in ("1", "0.500", "0.250"))


@pytest.mark.parametrize("order", [None, NAN, -0.7])
def test_convergence_without_a_positive_order_has_no_slope(order) -> None:
    svg = verify_figures.convergence(made(order=order, ladder=LADDER)).markup
    assert "slope" not in svg


@pytest.mark.parametrize(
    ("ladder", "drawn"),
    [
        ((), False),
        (LADDER, True),
        (LADDER[:1], False),
        (((1.0, 2.0), (0.5, 2.1)), False),
        (((1.0, NAN), (0.5, 2.1)), False),
    ],
)
def test_a_ladder_needs_two_positive_errors(ladder, drawn) -> None:
    assert verify_figures.drawable(made(ladder=ladder)) == drawn
