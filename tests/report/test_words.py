"""Numbers that pages show: which frame of an energy gap speaks, from when on a time is in minutes."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.report import comparison_page, words
from fem_reference.report.words import duration, number
from fem_reference.runs.store import Outcome, Run

RUN = Run("reference", "fenicsx", Outcome("converged", "", {}), (0, 1, 2, 3))


@pytest.mark.parametrize(
    ("values", "wanted"),
    [([np.nan, 0.02, -0.135, 0.1], -13.5), ([0.0, 0.02, 0.1, -0.05], 10.0), ([np.nan] * 4, np.nan)],
)
def test_the_energy_gap_is_that_which_is_farthest_from_0_in_per_cent(values: list[float], wanted: float) -> None:
    assert comparison_page.gap(replace(RUN, scalars={"energy_gap": np.array(values)})) == pytest.approx(
        wanted, nan_ok=True
    )


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (0.25, "250 ms"),
        (1.0, "1 s"),
        (61.0, "61 s"),
        (599.0, "599 s"),
        (600.0, "10 min"),
        (None, "\N{EN DASH}"),
    ],
)
def test_a_time_reads_as_people_say_it(seconds: float | None, text: str) -> None:
    assert words.duration(seconds) == text


def test_numbers_as_people_read_them():
    minus, times, dash, thin = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}", "\N{NARROW NO-BREAK SPACE}"
    assert number(-12.3456) == f"{minus}12.3"
    assert number(65021) == f"65{thin}021"
    assert number(-1.5e-14) == f"{minus}1.50 {times} 10\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}\N{SUPERSCRIPT FOUR}"
    assert [number(float("-inf")), number(None), duration(None)] == [f"{minus}infinite", dash, dash]


# Values on both sides of each power of ten, and of each value that rounds to it, and many between them.
SIZES = sorted(
    {step * 10.0**n for n in range(-4, 7) for step in (1, 1.234, 9.5, 9.94, 9.95, 9.99499, 9.995, 9.99999, 9.9999999)}
)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_number_is_right_to_three_digits_and_has_no_exponent(sign: int) -> None:
    """Half a unit of the third digit is at most half a per cent. 999.7 was "1.00e+03"."""
    for size in SIZES:
        text = number(sign * size).replace("\N{NARROW NO-BREAK SPACE}", "").replace("\N{MINUS SIGN}", "-")
        assert "e" not in text
        assert float(text) == pytest.approx(sign * size, rel=0.00501)


def test_a_time_is_right_to_three_digits_and_never_a_thousand_milliseconds() -> None:
    """0.99999 s was "1.00e+03 ms"."""
    for seconds in SIZES:
        text, unit = duration(seconds).rsplit(" ", 1)
        assert "e" not in text
        found = float(text.replace("\N{NARROW NO-BREAK SPACE}", ""))
        assert found * {"ms": 1e-3, "s": 1.0, "min": 60.0}[unit] == pytest.approx(seconds, rel=0.00501)
        assert found < 1000 or unit == "min"
