"""Estimates before a case is solved: closed forms of beams and bars, and their limits."""

from dataclasses import replace

import pytest

from fem_reference.foundations.indicators import Estimates

# A slender bar: 100 mm long, 10 mm thick, shear modulus 10 kPa, both ends on bones.
BAR = Estimates(
    length=100.0,
    thickness=10.0,
    shear=0.01,
    tension=0.0,
    fixed=2,
    sag=5.0,
    lean=0.0,
    travel=50.0,
    stretch=(0.9, 1.1),
    interval=0.02,
    speed=1.0,
    sideways=0.5,
    jump=0.0,
    acceleration=0.0,
    frames=(0.0, 5.0, 10.0),
    tolerance=0.1,
    stress_tolerance=0.001,
)


def test_a_bar_under_its_weight_has_the_middle_of_the_closed_form() -> None:
    # f L^2 / (2 E) at the middle's half way, E = 3 mu: f (L/2)^2 / (2 E), two thirds of it root mean square by the parabola's mean.
    force = 1e-6
    assert BAR.draw(force) == pytest.approx(2 / 3 * force * 50.0**2 / (2 * 3 * 0.01))


def test_a_clamped_beam_bends_by_the_closed_form_and_less_where_fibres_pull() -> None:
    # Middle of a clamped beam of a square section h: f h^2 L^4 / (384 E h^4 / 12), and shear f L^2 / (8 k mu), k = 5/6.
    force, E = 1e-7, 0.03
    middle = force * 100.0**4 / (384 * E * 10.0**2 / 12) + force * 100.0**2 / (8 * 5 / 6 * 0.01)
    assert BAR.bend(force) == pytest.approx(0.3 * middle)
    pulled = replace(BAR, tension=0.03)
    assert pulled.bend(force) == pytest.approx(BAR.bend(force) / (1 + BAR.taut(0.03)))
    assert replace(BAR, fixed=0).bend(force) == replace(BAR, fixed=0).draw(force) == 100.0


def test_nothing_lags_more_than_it_travels() -> None:
    assert BAR.lag(1e-6) == pytest.approx(1e-6)
    assert BAR.lag(1e12) == pytest.approx(50.0)
    assert replace(BAR, travel=0.0).lag(3.0) == 0.0


def test_strong_fibres_take_out_most_of_the_sag_or_shorten_what_is_free() -> None:
    assert BAR.straighten(1e9) == pytest.approx(0.6 * 5.0)
    assert BAR.straighten(0.0) == 0.0
    assert replace(BAR, fixed=1).straighten(1e9) == pytest.approx(0.3 * 100.0)
    assert BAR.shorten(0.03, 0.5) == pytest.approx(0.5 * 100.0 / 2)  # as strong as Young's modulus


def test_rates_are_by_second_where_the_case_says_how_long_a_frame_takes() -> None:
    assert BAR.in_time(3.0) == pytest.approx(150.0)
    assert replace(BAR, interval=None).in_time(3.0) == 0.0


def test_the_greatest_amount_is_that_over_all_frames() -> None:
    class Ramp:
        def amount(self, frame: float) -> float:
            return -frame / 10

    assert BAR.greatest(Ramp()) == 1.0
