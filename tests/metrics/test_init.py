"""Measures, their worst frames, and what metrics state of themselves."""

import numpy as np
import pytest

from fem_reference import metrics
from fem_reference.metrics import Measure, described, find, in_tables, measures
from fem_reference.report import ranking_page, tables

NAN = float("nan")


def test_the_worst_is_a_value_at_a_frame_with_its_bar_and_unit() -> None:
    values, bars = np.array([0, -3.0, 2.0]), np.array([0.1, 0.2, 0.3])
    worst = Measure("volume", "deviation", "%", values, tuple("abc"), (0, 10, 20), bars).worst
    assert (worst.value, worst.frame, worst.error_bar, worst.unit) == (-3.0, 10, 0.2, "%")
    assert (worst.where, worst.index) == ("b", 1)
    bare = Measure("volume", "deviation", "%", values).worst
    assert (bare.frame, bare.error_bar, bare.where) == (1, None, "")


def test_a_frame_that_is_not_a_number_is_worst_of_all() -> None:
    torn = Measure("volume", "deviation", "%", np.array([0, -3.0, 2, NAN, 1]), tuple("abcde"), (0, 10, 20, 30, 40))
    assert np.isnan(torn.worst.value)
    assert (torn.worst.frame, torn.worst.where) == (30, "d")
    assert torn.worst_number is not None
    assert (torn.worst_number.value, torn.worst_number.frame) == (-3.0, 10)
    assert Measure("volume", "deviation", "%", np.array([NAN, np.inf])).worst_number is None


@pytest.mark.parametrize("name", metrics.names())
def test_a_metric_describes_what_it_shows(name: str) -> None:
    """Every place has the words that it needs; positions are not shared."""
    for one in metrics.metric(name).STATISTICS.values():
        assert one.unit
        assert bool(one.headline) == ("headline" in one.shown)
        assert bool(one.curve) == ("curve" in one.shown)
        assert one.headline.count("{}") == ("headline" in one.shown)
        assert one.title or not {"table", "solvers", "scenes", "rank"} & {*one.shown}


@pytest.mark.parametrize("name", metrics.names())
def test_a_metric_stands_in_the_tables_that_it_names(name: str) -> None:
    for statistic, one in metrics.metric(name).STATISTICS.items():
        key = (name, statistic)
        assert ((*key, one.title, one.part, one.unit) in tables.DEVIATIONS) == ("table" in one.shown)
        assert ((*key, one.label, one.full_unit) in ranking_page.COLUMNS) == ("solvers" in one.shown)


@pytest.mark.parametrize("where", ["main", "table", "headline", "curve", "solvers", "scenes", "rank", "claim"])
def test_statistics_stand_in_the_order_of_their_positions(where: metrics.Shown) -> None:
    places = [one.shown[where] for one in described(where).values()]
    assert places == sorted(set(places))
    assert places


def test_tables_begin_with_the_volume_and_rankings_with_the_surface() -> None:
    assert in_tables() == ("volume", "fibre_length", "moment_arm", "surface_deviation", "penetration")
    assert next(iter(described("rank"))) == ("surface_deviation", "rms")
    assert described()["surface_deviation", "rms_percent"].full_unit == "% of maximum displacement"
    assert described()["fibre_length", "max"].label == "Fibre length, worst fibre"


def test_measures_have_the_units_that_their_metric_states() -> None:
    made = measures("volume", {"deviation": np.zeros(2), "deviation_volume": np.ones(2)})
    assert [(one.statistic, one.unit, one.where) for one in made] == [
        ("deviation", "%", ("", "")),
        ("deviation_volume", "mm3", ("", "")),
    ]
    assert find(made, "volume", "deviation_volume") is made[1]
    assert find(made, "volume", "depth") is None
