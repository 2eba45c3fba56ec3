"""Solvers are ranked as far as error bars separate them."""

import json

import numpy as np
import pytest

from fem_reference.assessment.ranking import Deviation, facts, ranked, rankings
from fem_reference.metrics import Measure

NAN = float("nan")


def test_bars_that_reach_each_other_share_ranks() -> None:
    # a to b and b to c reach each other, a to c do not.
    places = ranked([Deviation("c", 3.0, 0.6), Deviation("a", 1.0, 0.6), Deviation("b", 2.0, 0.6)])
    assert [(place.deviation.name, place.rank, place.alike) for place in places] == [
        ("a", "1 to 2", ("b",)),
        ("b", "1 to 3", ("a", "c")),
        ("c", "2 to 3", ("b",)),
    ]
    alone = ranked([Deviation("c", 3.0, 0.4), Deviation("a", 1.0, 0.4), Deviation("b", 2.0, 0.4)])
    assert [place.rank for place in alone] == ["1", "2", "3"]


def test_who_is_lost_comes_last_and_who_has_no_bar_is_reported_from_nobody() -> None:
    places = ranked([Deviation("lost", NAN, NAN), Deviation("a", 1.0, 0.1), Deviation("b", 2.0, 0.1)])
    assert [place.rank for place in places] == ["1", "2", "3"]
    unknown = ranked([Deviation("a", 1.0, NAN), Deviation("b", 9.0, 0.1)])
    assert [place.rank for place in unknown] == ["1 to 2", "1 to 2"]


def measures(**values) -> tuple[Measure, ...]:
    return tuple(Measure("surface_deviation", name, "mm", np.array(value)) for name, value in values.items())


def test_the_worst_frame_counts_with_the_bar_of_that_frame() -> None:
    measured = {"one": measures(rms=[0.0, -5.0, 1.0]), "other": measures(rms=[0.0, 1.0, 4.0]), "lines": ()}
    (found,) = rankings(measured, measures(rms=[0.0, 0.9, 0.2]))
    assert [(place.deviation.name, place.deviation.value, place.deviation.bar) for place in found.places] == [
        ("other", 4.0, 0.2),
        ("one", 5.0, 0.9),
    ]
    assert (found.pairs, [place.rank for place in found.places]) == ((0, 1), ["1 to 2", "1 to 2"])
    assert json.loads(json.dumps(facts([found]), allow_nan=False))[0]["not_distinguishable_from"] == ["one"]


@pytest.mark.parametrize("bars", [(), measures(max=[0.0, 0.1, 0.1])])
def test_without_bars_nobody_is_ranked(bars) -> None:
    assert rankings({"one": measures(rms=[0.0, 5.0]), "other": measures(rms=[0.0, 1.0])}, bars) == ()
