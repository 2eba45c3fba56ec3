"""Costs of the reference: medians over repeats, by phase, and what did not converge or has no data."""

import math

import numpy as np
import pytest
import small

from benchmarks import reference
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import DATA_SETTING

COST = {"seconds_set_up": 1.0, "seconds_solve": 2.0, "seconds_stability": 0.5, "unknowns": 240.0}


def test_costs_have_the_sum_of_the_parts_and_the_displacement() -> None:
    moved = np.array([[3.0, 0, 0], [0, 4.0, 0]])
    found = reference.costs(Outcome("converged", "", COST), moved)
    assert (found["seconds_wall"], found["unknowns"]) == (3.5, 240.0)
    assert found["moved_mm"] == pytest.approx(math.sqrt((9 + 16) / 2))
    with pytest.raises(RuntimeError, match="diverged: lost"):
        reference.costs(Outcome("diverged", "lost", COST), moved)


def test_the_median_is_that_of_each_cost() -> None:
    repeats = [{"a": 1.0, "b": 9.0}, {"a": 5.0, "b": 2.0}, {"a": 3.0, "b": 4.0}]
    assert reference.median(repeats) == {"a": 3.0, "b": 4.0}


def test_processor_time_counts_and_grows() -> None:
    before = reference.processor()
    sum(i * i for i in range(3_000_000))
    assert reference.processor() > before >= 0


def test_a_muscle_whose_data_is_not_here_has_no_costs(monkeypatch) -> None:
    monkeypatch.delenv(DATA_SETTING, raising=False)
    monkeypatch.setattr(reference, "MUSCLES", {"gluteus": ("gluteus_maximus", 100, None)})
    made = reference.Muscle()
    assert math.isnan(made.track_cost(made.setup_cache(), "gluteus", "seconds_wall"))


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")
def test_the_second_check_is_measured_beside_its_run(monkeypatch, tmp_path) -> None:
    case = str(small.write(tmp_path / "bar"))
    monkeypatch.setattr(reference, "CHECKED", (case, "nowhere"))
    made = reference.SecondCheck()
    found = made.setup_cache()
    seconds, share = (made.track_cost(found, case, cost) for cost in ("seconds", "share"))
    assert 0 < seconds < 1
    assert 0 < share < 10  # of a second and more: a process solves the bar
    assert math.isnan(made.track_cost(found, "nowhere", "share"))


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")  # it skips where nothing can be solved
def test_a_fusiform_body_is_measured_by_phase(monkeypatch) -> None:
    monkeypatch.setattr(reference, "BODIES", {"Q1/P0": (1, 3)})
    monkeypatch.setattr(reference, "REPEATS", 1)
    made = reference.Fusiform()
    found = made.setup_cache()
    costs = {cost: made.track_cost(found, "Q1/P0", cost) for cost in reference.COSTS}
    assert all(value >= 0 for value in costs.values())
    assert costs["seconds_solve"] > 0 < costs["seconds_assembly"]
    timed = reference.Interleaved()
    timed.setup("Q1/P0")
    before = reference.processor()
    timed.time_solve("Q1/P0")
    assert reference.processor() > before
    timed.teardown("Q1/P0")


@pytest.mark.slow
@pytest.mark.usefixtures("fem_lab")
def test_a_muscle_is_measured_to_a_frame(tmp_path) -> None:
    costs = reference.solve_muscle(str(small.write(tmp_path / "bar")), 10, 1)
    assert set(reference.COSTS) - set(costs) <= {"seconds_contact"}
    assert costs["moved_mm"] > 0
