"""The error bar of a reference covers errors that are known, and says where sizes of tetrahedra tell nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference import study
from fem_reference.errors import InputError
from fem_reference.mesh import Polylines
from fem_reference.metrics import Yardstick
from fem_reference.runs import Outcome, Run
from fem_reference.study import Ladder, error_bars, observed_order, of_sizes

LENGTHS = (1.0, 1.3, 1.5)  # of no common ratio, as those of meshes
LEAST = 1e-6
REST = shapes.sphere(2, 10.0)
FIBRE = Polylines(np.array([[0.0, 0, -5], [0, 0, 5]]), np.array([0, 2]))
NUMBERS = (0, 10, 20)
TIMES = np.array([0.0, 1.0, 2.0])


def differences(error) -> tuple[np.ndarray, np.ndarray]:
    """What three meshes differ by over the frames, where ``error`` of a length is the error at time 1."""
    one, two, three = (error(length) * TIMES for length in LENGTHS)
    return two - one, three - two


@pytest.mark.parametrize("order", [0.5, 0.7, 1.0])
def test_an_error_of_known_order_is_covered_with_the_safety_of_the_index(order) -> None:
    # x(h) = x + a h^p: extrapolation gives the error a h^p itself, to the tolerance of the root that p is (1e-12).
    values, found, course = of_sizes(*differences(lambda h: -3 * h**order), LENGTHS, LEAST)
    assert found == pytest.approx(order, abs=1e-9)
    assert (values, course) == (pytest.approx(1.25 * 3 * TIMES, rel=1e-8), "converges")


@pytest.mark.parametrize("order", [2.0, 3.0])
def test_a_higher_order_is_told_and_makes_no_smaller_bar_than_order_one(order) -> None:
    near, far = differences(lambda h: 3 * h**order)
    values, found, course = of_sizes(near, far, LENGTHS, LEAST)
    assert (found, course) == (pytest.approx(order, abs=1e-9), "converges")
    # Order 1 from either pair of meshes: d h1 / (h2 - h1), and the coarser pair scaled by (h2 - h1) / (h3 - h2).
    wanted = 1.25 * np.maximum(near / 0.3, far / 0.2)
    assert values == pytest.approx(wanted, rel=1e-12)
    assert (values >= 3 * TIMES).all()


def test_where_differences_do_not_shrink_the_bar_is_that_of_the_lowest_order() -> None:
    near, far = 0.2 * TIMES, 0.1 * TIMES
    values, order, course = of_sizes(near, far, LENGTHS, LEAST)
    assert (order < 0, course) == (True, "does not converge")
    assert values == pytest.approx(1.25 * near / (1.3**0.5 - 1), rel=1e-12)


def test_an_oscillating_error_is_covered_and_told() -> None:
    signs = {1.0: 1, 1.3: -1, 1.5: 1}
    values, _, course = of_sizes(*differences(lambda h: signs[h] * h), LENGTHS, LEAST)
    assert course == "oscillates"
    assert (values >= TIMES).all()


def test_a_frame_where_two_meshes_agree_by_chance_takes_the_third_into_account() -> None:
    near, far = np.array([0.3, 0.0]), np.array([0.2, 0.2])
    values, order, _ = of_sizes(near, far, LENGTHS, LEAST)
    assert values[1] > 0.5 * values[0]
    assert order == pytest.approx(observed_order(0.4 / 0.3, LENGTHS))


def test_rounding_is_no_lack_of_convergence() -> None:
    values, order, course = of_sizes(np.array([0, 2e-9]), np.array([0, 1e-9]), LENGTHS, LEAST)
    assert np.isnan(order)
    assert course == "equal"
    assert (values < 1e-7).all()
    values, _, course = of_sizes(np.zeros(2), np.zeros(2), LENGTHS, LEAST)
    assert (values.tolist(), course) == ([0, 0], "equal")


def test_two_meshes_that_agree_where_the_third_does_not_have_a_bar() -> None:
    values, order, course = of_sizes(np.zeros(2), np.array([0.0, 0.1]), LENGTHS, LEAST)
    assert (order, course) == (20, "converges")
    assert values[1] > 0


def test_a_frame_that_a_mesh_did_not_reach_has_no_bar_and_takes_none_from_others() -> None:
    near, far = differences(lambda h: h)
    far[2] = np.nan
    values, order, course = of_sizes(near, far, LENGTHS, LEAST)
    assert (values[:2], order, course) == (pytest.approx([0, 1.25]), pytest.approx(1), "converges")
    assert np.isnan(values[2])
    values, order, course = of_sizes(near * np.nan, far, LENGTHS, LEAST)
    assert np.isnan(values).all()
    assert (np.isnan(order), course) == (True, "not known")


@pytest.mark.parametrize("order", [-3.0, -0.4, 0.0, 0.3, 2.0, 6.0])
def test_observed_order_finds_the_order_of_a_ratio(order) -> None:
    h1, h2, h3 = (np.log(h) if order == 0 else h**order for h in LENGTHS)
    assert observed_order((h3 - h2) / (h2 - h1), LENGTHS) == pytest.approx(order, abs=1e-9)


def test_observed_order_has_ends() -> None:
    assert observed_order(1e-9, LENGTHS) == -20
    assert observed_order(1e9, LENGTHS) == 20


def run(growth: float) -> Run:
    """A sphere that grows by ``growth`` at time 1, and its fibre with it."""
    factors = 1 + growth * TIMES
    positions, fibres = (np.stack([points * factor for factor in factors]) for points in (REST.points, FIBRE.points))
    return Run("reference", "test", Outcome("converged", ""), NUMBERS, REST, positions, FIBRE, fibres)


def bars(*, varied: float = 0.0) -> study.ErrorBars:
    """Of a growth of 0.1 + 0.01 h, and of a variation by ``varied``; on lengths as above."""
    runs = tuple(run(0.1 + 0.01 * length) for length in LENGTHS)
    others = {"load steps": run(0.115 + varied)} if varied else {}
    return error_bars(Ladder(runs, (4.0, 5.0, 6.0), LENGTHS, others), Yardstick.of(runs[0], FIBRE, ()))


@pytest.mark.parametrize("of", ["change", "deviation"])
def test_bars_cover_what_metrics_make_of_the_error(of) -> None:
    found = bars()
    # Every vertex is 10 mm out, so that an error of 0.01 h is 0.1 h mm: 1.25 times that of h = 1. The fibre is 10 mm long.
    for metric, statistic in (("surface_deviation", "rms"), ("surface_deviation", "max"), ("fibre_length", "mean")):
        bar = found.find(of, metric, statistic)
        assert (bar.values, bar.order) == (pytest.approx(0.125 * TIMES, abs=1e-9), pytest.approx(1, abs=1e-6))
        assert (bar.course, bar.unit) == ("converges", "mm")
        assert bar.parts == {"tetrahedra": pytest.approx(0.25)}
    # A sphere has no other shape when it grows, and the growth of volume is not linear: 3 (1 + g)^2 dg, less than 10 % off order 1.
    assert found.find(of, "dihedral_angle", "rms").course == "equal"
    assert found.find(of, "volume", "deviation").order == pytest.approx(1, abs=0.2)
    assert found.find(of, "volume", "shape") is None


def test_the_fibres_of_other_meshes_are_not_mistaken_for_those_of_the_reference() -> None:
    # Runs that all carry the yardstick's fibre, but unmoved: were it used, no length would change.
    runs = tuple(
        replace(one, fibre_positions=np.stack([FIBRE.points] * 3)) for one in (run(0.11), run(0.113), run(0.115))
    )
    found = error_bars(Ladder(runs, (4.0, 5.0, 6.0), LENGTHS, {}), Yardstick.of(runs[0], FIBRE, ()))
    assert found.find("deviation", "fibre_length", "mean").values[1] == pytest.approx(0.125, abs=1e-9)


def test_a_variation_adds_twice_what_halving_its_cause_changes() -> None:
    # An error of first order of which half is taken away: as much again is left, and the reference has both.
    bar = bars(varied=0.002).find("deviation", "surface_deviation", "rms")
    assert bar.values == pytest.approx((0.125 + 2 * 0.02) * TIMES, abs=1e-9)
    assert bar.parts["load steps"] == pytest.approx(0.08)
    assert bar.worst == 2


def test_what_asks_nothing_of_the_reference_has_no_error_of_it() -> None:
    # Penetration is of a run alone: a candidate's does not change with the reference.
    assert all(bars().find(of, "penetration", "deepest") is None for of in ("change", "deviation"))


OF = {"run": "fenicsx-1", "metrics": "abc"}


def test_what_is_stored_reads_back(tmp_path) -> None:
    kept = bars(varied=0.002)
    gap = replace(kept.bars[3], values=np.array([0, np.nan, 1.5]), order=np.nan)
    kept = replace(kept, bars=(*kept.bars[:3], gap, *kept.bars[4:]))
    study.save(kept, tmp_path, OF)
    read = study.load(tmp_path, OF)
    assert (read.numbers, read.sizes, len(read.bars)) == (kept.numbers, kept.sizes, len(kept.bars))
    for one, other in zip(read.bars, kept.bars, strict=True):
        assert (one.of, one.metric, one.statistic, one.unit, one.course) == (
            other.of,
            other.metric,
            other.statistic,
            other.unit,
            other.course,
        )
        assert np.array_equal(one.values, other.values, equal_nan=True)
        assert np.array_equal(one.order, other.order, equal_nan=True)
        assert one.parts == other.parts
    assert read.bars[3].worst == 1


def test_what_is_stored_is_of_one_run_and_its_metrics_only(tmp_path) -> None:
    assert study.load(tmp_path, OF) is None
    study.save(bars(), tmp_path, OF)
    assert study.load(tmp_path, OF | {"metrics": "others"}) is None
    assert study.load(tmp_path, OF | {"run": "fenicsx-2"}) is None


def change(key: str, value):
    return lambda table: table["bars"][0].update({key: value})


DAMAGE = {
    "values": change("values", [0.0]),
    "no list": change("values", 1.0),
    "course": change("course", "fine"),
    "parts": change("parts", [1.0]),
    "text": change("order", "one"),
    "key": lambda table: table.pop("numbers"),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_file_is_named(tmp_path, what) -> None:
    study.save(bars(), tmp_path, OF)
    table = json.loads((tmp_path / study.FILE).read_text())
    DAMAGE[what](table)
    (tmp_path / study.FILE).write_text(json.dumps(table))
    with pytest.raises(InputError, match=r"error_bar.json: got .*, want the error bar of a stored run"):
        study.load(tmp_path, OF)


def test_a_file_that_was_cut_off_is_named(tmp_path) -> None:
    (tmp_path / study.FILE).write_text('{"format": 1, "of"')
    with pytest.raises(InputError, match=r"error_bar.json: got JSONDecodeError"):
        study.load(tmp_path, OF)
