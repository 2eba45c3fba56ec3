"""Candidates beside bands: inside, outside and undecided, and never inside without a number."""

import json

import numpy as np
import pytest

from fem_reference.assessment.uncertainty import Band, Failure, Parameter, Uncertainty, facts, place

NAN = float("nan")


def band(bar: float | None = 0.1, *, distance: bool = False, quantity: str = "fibre_length.mean") -> Band:
    """From 1 to 2 in three frames around 1.5, not defined in the fourth."""
    low, middle, high = (np.array([value, value, value, NAN]) for value in (1.0, 1.5, 2.0))
    bars = None if bar is None else np.full(4, bar)
    nominal = np.zeros(4) if distance else middle
    shares = {"effect[0].mu": 0.25, "effect[1].c1": 0.7}
    return Band(
        *(quantity, "Fibre length", "mm", (0, 10, 20, 30), nominal, low, middle, high, bars, distance),
        error=0.01,
        by="process",
        first=shares,
        total=shares | {"effect[0].mu": 0.3},
    )


def study(*bands: Band, failures: tuple[Failure, ...] = ()) -> Uncertainty:
    mu = Parameter("effect[0].mu", "neo_hooke mu", "MPa", 0.01, 0.004, 0.02, "log-uniform", "Someone 2006")
    c1 = Parameter("effect[1].c1", "mooney_rivlin c1", "MPa", 0.001, 0.002, 0.005, "uniform", "Somebody else 2010")
    values = {"fast": np.full(4, 1.5), "near": np.full(4, 2.05), "far": np.full(4, 4.0)}
    placed = tuple(place(name, one, found) for name, found in values.items() for one in bands if not one.refused)
    own = (mu, c1), ("incompressible bulk",), 64, 1, failures, bands, placed, {"lost": "diverged: frame 3"}, 12.5
    return Uncertainty("bar", "A bar", 6.0, *own, {"machine": "here"})


def test_a_value_is_inside_by_the_bar_or_outside_by_it() -> None:
    found = place("c", band(), np.array([1.5, 1.95, 2.3, 7.0]))
    assert found.places == ("inside", "undecided", "outside", "")
    assert (found.word, found.share, found.worst) == ("outside", pytest.approx(1 / 3), pytest.approx(0.3, abs=1e-5))
    assert place("c", band(), np.array([0.95, 1.5, 1.5, 0])).word == "undecided"


def test_nearer_than_most_runs_is_inside_a_band_of_distances() -> None:
    assert place("c", band(distance=True), np.zeros(4)).word == "inside"
    assert place("c", band(distance=True), np.full(4, 2.2)).word == "outside"


def test_what_is_not_a_number_is_never_inside() -> None:
    found = place("c", band(), np.array([1.5, NAN, 2.3, 1.5]))
    assert found.places == ("inside", "no answer", "outside", "")
    assert (found.word, found.share, found.worst) == ("no answer", pytest.approx(1 / 3), pytest.approx(0.3, abs=1e-5))
    none = place("c", band(distance=True), np.array([NAN, np.inf, -np.inf, NAN]))
    assert none.places == ("no answer", "no answer", "no answer", "")
    assert (none.share, np.isnan(none.worst)) == (0.0, True)
    assert place("c", band(bar=None), np.full(4, NAN)).word == "no answer"
    assert {*place("c", band(bar=NAN), np.full(4, 1.5)).places} == {"undecided", ""}
    assert {*place("c", band(bar=None), np.full(4, 1.5)).places} == {"undecided", ""}


def test_rest_where_a_band_has_no_width_is_inside() -> None:
    still = Band("q", "Q", "mm", (0,), *(np.zeros(1) for _ in range(5)))
    assert place("c", still, np.zeros(1)).places == ("inside",)
    assert place("c", still, np.full(1, 0.1)).places == ("outside",)


def test_widths_and_bars_are_the_greatest() -> None:
    assert (band().width, band().greatest_bar) == (1.0, pytest.approx(0.1))
    assert band(distance=True).width == 2.0
    assert np.isnan(band(bar=None).greatest_bar)


def test_values_of_a_parameter_end_where_its_range_does() -> None:
    mu, c1 = study().parameters
    assert [mu.value(-1.0), mu.value(1.0), c1.value(-1.0), c1.value(0.0)] == [0.004, 0.02, 0.002, 0.0035]
    assert mu.value(0.0) == pytest.approx(np.sqrt(0.004 * 0.02), rel=1e-5)
    assert (mu.contains, c1.contains) == (True, False)


def test_facts_are_json_with_the_words_on_candidates() -> None:
    table = json.loads(json.dumps(facts(study(band())), allow_nan=False))
    assert [one["word"] for one in table["placed"]] == ["inside", "undecided", "outside"]
    assert table["bands"][0]["high"] == [2.0, 2.0, 2.0, None]
