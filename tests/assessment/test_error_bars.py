"""The error bar of a reference covers errors that are known, and says nothing where nothing is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_array_equal

from fem_reference import metrics
from fem_reference.assessment import error_bars
from fem_reference.assessment.differences import carried, typical, typical_changes
from fem_reference.assessment.error_bars import Pair
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, enclosed_volume
from fem_reference.foundations.motion import RigidMotion
from fem_reference.metrics import MeasurementContext
from fem_reference.problems.setup import Bone, Joint
from fem_reference.runs.store import Outcome, Run

REST = shapes.sphere(2, 10.0)
FIBRE = Polylines(np.array([[0.0, 0, -5], [0, 0, 5]]), np.array([0, 2]))
NUMBERS = (0, 10, 20)
TIMES = np.array([0.0, 1.0, 2.0])
# What sizes h and 2 h differ by, over the error of h, of order 1.5.
LEFT = 2**1.5 - 1


def test_a_difference_that_crosses_zero_is_as_large_as_the_distance_of_the_surfaces_makes_it() -> None:
    apart = np.array([0.0, 1.0, 2.0, 1.0, 0.0])
    crossing = np.array([0.0, 0.5, 0.0, -0.5, 0.0])
    # Root mean squares over the frames: 0.5^2 2 / (1 + 4 + 1) of each square of a distance.
    assert typical(crossing, apart) == pytest.approx([0, 0.5, 2 * np.sqrt(0.5 / 6), 0.5, 0], abs=1e-12)
    assert typical(0.3 * apart, apart) == pytest.approx(0.3 * apart, rel=1e-12)
    assert typical(np.zeros(2), np.zeros(2)).tolist() == [0, 0]


def test_a_frame_that_a_run_did_not_reach_is_not_known_and_takes_nothing_from_others() -> None:
    found = typical(np.array([0.0, 0.5, np.nan]), np.array([0.0, 1.0, np.nan]))
    assert np.isnan(found[2])
    assert found[:2] == pytest.approx([0, 0.5])


def run(growth: float) -> Run:
    """A sphere that grows by ``growth`` at time 1, and its fibre with it."""
    factors = 1 + growth * TIMES
    positions, fibres = (np.stack([points * factor for factor in factors]) for points in (REST.points, FIBRE.points))
    return Run("reference", "test", Outcome("converged", ""), NUMBERS, REST, positions, FIBRE, fibres)


def pair(coarse: float, *, varied: float = 0.0, exact: float | None = None) -> Pair:
    """A growth of 0.1, and of ``coarse`` on tetrahedra of twice the size; there one more by ``varied``, and one ``exact``."""
    others = {"contact stiffness": run(coarse + varied)} if varied else {}
    return Pair(run(0.1), run(coarse), (4.0, 8.0), others, None if exact is None else run(exact))


def bars(**given: float) -> error_bars.ErrorBars:
    """Of a growth that is 0.01 more on the larger tetrahedra."""
    found = pair(0.11, **given)
    return error_bars.error_bars(found, MeasurementContext.of(found.fine, FIBRE, ()))


@pytest.mark.parametrize("of", ["change", "deviation"])
def test_bars_cover_an_error_of_their_order_with_the_safety_of_the_index(of) -> None:
    found = bars()
    for metric, statistic, left in (("surface_deviation", "rms", LEFT), ("fibre_length", "mean", 1)):
        # Every vertex is 10 mm out, so that sizes h and 2 h differ by 0.1 mm: of an error a h^1.5 that is 1.83 a h^1.5.
        bar = found.find(of, metric, statistic)
        assert (bar.values, bar.unit) == (pytest.approx(1.25 * 0.1 / left * TIMES, abs=1e-9), "mm")
        assert bar.parts == {"tetrahedra": pytest.approx(2.5 * 0.1 / left)}
        assert (bar.model, bar.widest) == (None, 2)
    # At the worst place alone it is of first order, as of fibres, which are few and end at rims.
    worst = found.find(of, "surface_deviation", "max")
    assert worst.values == pytest.approx(1.25 * 0.1 * TIMES, abs=1e-9)
    # A sphere has no other shape when it grows.
    assert found.find(of, "dihedral_angle", "rms").values == pytest.approx([0, 0, 0], abs=1e-6)
    assert found.find(of, "volume", "shape") is None


@pytest.mark.parametrize(
    ("metric", "statistic", "order", "safety"),
    [
        ("surface_deviation", "rms", 1.5, 1.25),
        ("surface_deviation", "p95", 1.5, 1.25),
        ("fibre_length", "rms_percent", 1, 1.25),
        ("fibre_length", "max", 1, 1.5),
        ("surface_deviation", "hausdorff", 1, 1.25),
        ("volume", "deviation", 1, 1.25),
    ],
)
def test_what_is_next_to_rims_converges_more_slowly_and_one_fibre_is_known_least(
    metric, statistic, order, safety
) -> None:
    pair = Pair(None, None, (2.0, 4.0), {})  # no run is looked at
    assert pair.share(metric, statistic) == pytest.approx(safety / (2**order - 1))


def test_meshes_that_agree_in_some_poses_by_chance_are_known_no_better_there() -> None:
    """Surfaces that are 1, 0.1 and 1 % of what they have moved apart count as 1 % apart in each frame; at rest, as they are."""
    moved = np.array([0.0, 10.0, 20.0, 40.0, 0.1])
    apart = np.array([0.0, 0.1, 0.02, 0.4, 0.05])
    assert typical(apart, apart, moved) == pytest.approx([0, 0.1, 0.2, 0.4, 0.05])
    assert typical(apart, apart) == pytest.approx(apart)
    # A statistic of half the distance everywhere: half of what that counts as.
    assert typical(-apart / 2, apart, moved) == pytest.approx([0, 0.05, 0.1, 0.2, 0.025])
    unknown = typical(np.array([0.0, np.nan]), np.array([0.0, np.nan]), np.array([0.0, 1.0]))
    assert unknown == pytest.approx([0, np.nan], nan_ok=True)


def test_a_change_is_known_no_better_than_its_metric_on_average() -> None:
    """What differs little by chance has no short bar: averages at least half the distance of the runs. Other metrics have nothing
    to do with it.
    """
    deviations = [np.array([0.0, 1.0, 2.0]), np.array([0.0, 4.0, 4.0]), np.array([0.0, 5.0, np.nan])]
    changes = [0.8 * deviations[0], np.zeros(3), -0.1 * deviations[2]]
    names = [("a", "rms"), ("a", "mean"), ("b", "rms")]
    one, other, alone = typical_changes(changes, deviations, names)
    assert one == pytest.approx(0.8 * deviations[0])
    assert other == pytest.approx(0.8 / np.sqrt(2) * deviations[1])
    assert alone[:2] == pytest.approx([0, 2.5])
    assert np.isnan(alone[2])
    (nothing,) = typical_changes([np.zeros(2)], [np.zeros(2)], [("a", "rms")])
    assert nothing.tolist() == [0, 0]


def test_a_value_of_one_place_is_known_no_better_than_places_are_on_average() -> None:
    names = [("a", "rms_percent"), ("a", "max_percent"), ("a", "p95_percent"), ("b", "max")]
    deviations = [np.array([0.0, 1.0, 2.0]), *[np.array([0.0, 3.0, 0.5])] * 3]
    still = [np.zeros(3)] * 4
    # On its own (b) there is no average to go by.
    rms, greatest, quantile, alone = typical_changes(still, deviations, names)
    assert [one.tolist() for one in (rms, greatest, quantile, alone)] == [[0, 0.5, 1], [0, 1, 2], [0, 1, 2], [0, 0, 0]]


@pytest.mark.slow
def test_a_quantile_is_that_of_one_place_whose_difference_no_other_cancels() -> None:
    """Differences that are independent from place to place cancel in means, and in the 95 % quantile of a change do not."""
    covered = []
    for seed in range(20):
        noise = 0.1 * np.random.default_rng(seed).normal(size=(2, *REST.points.shape))
        # Of order 3/2, in other directions: what is left of the error of the finer run is 1 / LEFT of what the two differ by.
        runs = [moving_away(each) for each in (0 * noise[0], noise[0], noise[1] / LEFT)]
        context = MeasurementContext.of(runs[0], FIBRE, ())
        found = error_bars.error_bars(replace(pair(0.1), fine=runs[0], coarse=runs[1]), context)
        truths = [metrics.change(one, context, ["surface_deviation"]) for one in (runs[0], runs[2])]
        errors = [abs(a.values - b.values)[1:] for a, b in zip(*truths, strict=True) if a.statistic == "p95"]
        covered += (errors[0] <= found.find("change", "surface_deviation", "p95").values[1:]).tolist()
    assert np.mean(covered) >= 0.95


def moving_away(noise: np.ndarray) -> Run:
    """A sphere whose places move the farther the higher they are, each by ``noise`` (n, 3) otherwise."""
    moved = 0.1 * (REST.points + 10.0) * [0, 0, 1] + noise
    return replace(run(0.0), positions=np.stack([REST.points + time * moved for time in TIMES]))


def test_the_volume_is_known_no_better_than_tetrahedra_carry_its_surface() -> None:
    """Tetrahedra keep their volume, that of the surface grows by 0.1 and 0.4 %: so far is it carried wrongly."""
    grown = np.stack([REST.points * factor ** (1 / 3) for factor in (1, 1.001, 1.004)])
    still = replace(pair(0.1).fine, positions=grown, scalars={"volume_ratio": np.ones(3)})
    found = error_bars.error_bars(replace(pair(0.1), fine=still, coarse=still), MeasurementContext.of(still, FIBRE, ()))
    for of in ("change", "deviation"):
        bar = found.find(of, "volume", "deviation")
        assert bar.values == pytest.approx([0, 0.125, 0.5], rel=1e-3)  # with the safety of a quarter
        assert bar.parts["surface in tetrahedra"] == bar.values.max()
    sizes = carried(still, np.array([0.0, 1.0, 2.0]))
    # The mean squares of 0.1 and 0.4 % over those of 1 and 2 mm: 0.184 % of each mm.
    assert sizes["deviation"] == pytest.approx([0, 0.1844, 0.4], rel=1e-3)
    assert sizes["deviation_volume"] == pytest.approx(
        sizes["deviation"] / 100 * enclosed_volume(REST.points, REST.triangles)
    )
    assert carried(replace(still, scalars={}), TIMES) == {}, "of a run without tetrahedra nobody knows"


def test_the_fibres_of_other_meshes_are_not_mistaken_for_those_of_the_reference() -> None:
    # Runs that all carry the measured fibre, but unmoved: were it used, no length would change.
    given = pair(0.11)
    still = [replace(one, fibre_positions=np.stack([FIBRE.points] * 3)) for one in (given.fine, given.coarse)]
    found = error_bars.error_bars(
        replace(given, fine=still[0], coarse=still[1]), MeasurementContext.of(still[0], FIBRE, ())
    )
    assert found.find("deviation", "fibre_length", "mean").values[1] == pytest.approx(0.125, abs=1e-9)


def test_a_variation_adds_twice_what_halving_its_cause_changes() -> None:
    # An error of first order of which half is taken away: as much again is left, and the reference has both.
    bar = bars(varied=0.002).find("deviation", "surface_deviation", "rms")
    # Independent causes: their shares are added as squares.
    assert bar.values == pytest.approx(np.hypot(0.125 / LEFT, 2 * 0.02) * TIMES, abs=1e-9)
    assert bar.parts["contact stiffness"] == pytest.approx(0.08)


def test_another_model_is_no_part_of_the_bar() -> None:
    bar = bars(exact=0.16).find("deviation", "surface_deviation", "rms")
    assert bar.values == pytest.approx(0.125 / LEFT * TIMES, abs=1e-9)
    assert bar.model == pytest.approx(0.5 * TIMES, abs=1e-9)


def test_the_worst_place_is_known_no_better_because_it_is_the_same() -> None:
    # Half a sphere grows, in both runs alike, the other half less, and in one run not at all: the greatest change is the same.
    def half(growth: float) -> Run:
        outwards = np.where(REST.points[:, :1] > 0, 0.1, growth) * REST.points
        return replace(run(0.0), positions=np.stack([REST.points + time * outwards for time in TIMES]))

    given = replace(pair(0.1), fine=half(0.0), coarse=half(0.05))
    found = error_bars.error_bars(given, MeasurementContext.of(given.fine, FIBRE, ()))
    bar, bound = (found.find(of, "surface_deviation", "max").values for of in ("change", "deviation"))
    assert bound == pytest.approx(1.25 * 0.5 * TIMES, abs=1e-6)
    assert (bar[1:] > 0.1 * bound[1:]).all()
    assert (bar <= bound).all()


def test_what_asks_nothing_of_the_reference_has_no_error_of_it() -> None:
    # Penetration is of a run alone: a candidate's does not change with the reference.
    assert all(bars().find(of, "penetration", "deepest") is None for of in ("change", "deviation"))


OF = {"run": "fenicsx-1", "metrics": "abc"}


def test_what_is_stored_reads_back(tmp_path) -> None:
    kept = bars(varied=0.002, exact=0.12)
    gap = replace(kept.bars[3], values=np.array([0, np.nan, 1.5]), model=None)
    kept = replace(kept, bars=(*kept.bars[:3], gap, *kept.bars[4:]))
    error_bars.save(kept, tmp_path, OF)
    read = error_bars.load(tmp_path, OF)
    assert (read.numbers, read.sizes, read.order) == (kept.numbers, kept.sizes, kept.order)
    for one, other in zip(read.bars, kept.bars, strict=True):
        assert (one.of, one.metric, one.statistic, one.unit) == (other.of, other.metric, other.statistic, other.unit)
        assert np.array_equal(one.values, other.values, equal_nan=True)
        assert (one.model is None) == (other.model is None)
        assert one.model is None or np.array_equal(one.model, other.model)
        assert one.parts == other.parts
    assert read.bars[3].widest == 1


def test_what_is_stored_is_of_one_run_and_its_metrics_only(tmp_path) -> None:
    assert error_bars.load(tmp_path, OF) is None
    error_bars.save(bars(), tmp_path, OF)
    assert error_bars.load(tmp_path, OF | {"metrics": "others"}) is None
    assert error_bars.load(tmp_path, OF | {"run": "fenicsx-2"}) is None


def change(key: str, value):
    return lambda table: table["bars"][0].update({key: value})


DAMAGE = {
    "values": change("values", [0.0]),
    "no list": change("values", 1.0),
    "of": change("of", "all"),
    "model": change("model", [0.0]),
    "parts": change("parts", [1.0]),
    "text": lambda table: table.update(order="one"),
    "key": lambda table: table.pop("numbers"),
}


@pytest.mark.parametrize("what", DAMAGE)
def test_a_damaged_file_is_named(tmp_path, what) -> None:
    error_bars.save(bars(), tmp_path, OF)
    table = json.loads((tmp_path / error_bars.FILE).read_text())
    DAMAGE[what](table)
    (tmp_path / error_bars.FILE).write_text(json.dumps(table))
    with pytest.raises(InputError, match=r"error_bar.json: got .*, want the error bar of a stored run"):
        error_bars.load(tmp_path, OF)


def test_a_file_that_was_cut_off_is_named(tmp_path) -> None:
    (tmp_path / error_bars.FILE).write_text('{"format": 2, "of"')
    with pytest.raises(InputError, match=r"error_bar.json: got Expecting .*, want the error bar"):
        error_bars.load(tmp_path, OF)


def test_a_stress_whose_difference_is_small_by_chance_is_known_as_well_as_the_others() -> None:
    """1 and 7 kPa a frame of difference, and none by chance: of first order, 5 kPa, their root mean square, counts at least."""

    def stressed(coarse: float) -> Run:
        apart = {"von_mises_mean": 1.0, "von_mises_p95": 7.0, "pressure_mean": 0.0}
        found = {f"stress_{name}": 0.001 * (20 + coarse * size) * TIMES for name, size in apart.items()}
        return replace(run(0.1 + 0.01 * coarse), scalars=found)

    runs = Pair(stressed(0.0), stressed(1.0), (4.0, 8.0), {})
    found = error_bars.error_bars(runs, MeasurementContext.of(runs.fine, FIBRE, (), None))
    pooled = np.sqrt(50 / 3)
    for of in ("change", "deviation"):
        for statistic, wanted in (("von_mises_mean", pooled), ("von_mises_p95", 7.0), ("pressure_mean", pooled)):
            bar = found.find(of, "stress", statistic)
            assert bar is not None
            assert (bar.unit, bar.values) == ("kPa", pytest.approx(1.25 * wanted * TIMES, rel=1e-9))


def test_a_mean_over_fibres_that_cancels_by_chance_is_known_no_better_than_a_fibre() -> None:
    """On larger tetrahedra one of two fibres is 0.2 % a frame longer and the other shorter: 0 in the mean, 0.2 % rms. The order is
    1, so that all of it is left, and the safety 1.25.
    """
    lines = Polylines(np.array([[2.0, 0, -5], [2, 0, 5], [-2, 0, -5], [-2, 0, 5]]), np.array([0, 2, 4]))

    def sheared(by: float) -> Run:
        def moved(points: np.ndarray) -> np.ndarray:
            return np.stack([points + by * t * np.outer(points[:, 0] * points[:, 2], [0, 0, 1]) for t in TIMES])

        return replace(run(0.0), positions=moved(REST.points), fibres=lines, fibre_positions=moved(lines.points))

    runs = Pair(sheared(0.0), sheared(1e-3), (4.0, 8.0), {})
    found = error_bars.error_bars(runs, MeasurementContext.of(runs.fine, lines, (), None))
    rms = {of: found.find(of, "fibre_length", "rms_percent").values for of in ("change", "deviation")}
    assert rms["change"] == pytest.approx(1.25 * 0.2 * TIMES, abs=1e-9)
    assert rms["deviation"][1:].min() > 0.1
    for of in rms:
        assert found.find(of, "fibre_length", "mean_percent").values == pytest.approx(rms["deviation"], abs=1e-9)
    # Edges are not fibres, and by symmetry those of the sphere are as long in the mean.
    edges = found.find("deviation", "edge_extension", "mean").values
    assert edges.max() < 0.1 * found.find("deviation", "edge_extension", "rms").values.max()


def pulled(growth: float, size: float) -> Run:
    """``size`` [N] a frame along y at 30 mm along z from an axis along x."""
    force = np.outer(size * TIMES, [0.0, -1, 0])
    both = {"force": force, "moment": np.cross([0.0, 0, 30], force)}
    named = {f"{kind}_on_femur_{axis}": both[kind][:, i] for kind in both for i, axis in enumerate("xyz")}
    return replace(run(growth), scalars=named)


def jointed(given: Run) -> MeasurementContext:
    """A joint that turns the bone about the axis along x."""
    bone = Bone("femur", REST, RigidMotion((1, 0, 0), (0, 0, 0), tuple(map(float, NUMBERS)), (0.0, 0.1, 0.2)))
    joint = Joint("hip", bone, np.array([1.0, 0, 0]), np.zeros(3), lambda frame: 0.01 * frame)
    return MeasurementContext.of(given, FIBRE, (bone,), None, (joint,))


@pytest.mark.parametrize(("exact", "force", "moment"), [(None, 9.0, 270.0), (105.0, 9.0, 270.0), (140.0, 30.0, 900.0)])
def test_another_model_of_springs_is_how_they_are_spread_or_exact_attachments(exact, force, moment) -> None:
    """Of 100 N a frame 9 %, or what exact attachments change the 110 N of larger tetrahedra by, where that is more. Of nothing
    else it is known, and the bar stays as it is.
    """
    given = Pair(pulled(0.1, 100.0), pulled(0.11, 110.0), (4.0, 8.0), {}, exact and pulled(0.11, exact))
    known, springs = (error_bars.error_bars(one, jointed(one.fine)) for one in (given, replace(given, springs=True)))
    for of in ("change", "deviation"):
        for statistic, wanted in (("force", force), ("moment", moment)):
            assert springs.find(of, "joint_moment", statistic).model == pytest.approx(wanted * TIMES)
        for before, bar in zip(known.bars, springs.bars, strict=True):
            assert_array_equal(bar.values, before.values)
            if bar.metric != "joint_moment" or bar.statistic == "arm":
                assert (bar.model is None) == (exact is None)


def test_forces_and_moments_have_bars_in_their_own_units() -> None:
    """100 N a frame along y at 30 mm along z from an axis along x, 10 % more on tetrahedra of twice the size: of an error a h^1.5
    the sizes differ by 1.83 a h^1.5; the force, one number at one place, is taken to be of first order, and a fifth less certain.
    The arm is 30 mm on both, and unknown at rest. Without forces there is no bar.
    """
    runs = Pair(pulled(0.1, 100.0), pulled(0.11, 110.0), (4.0, 8.0), {})
    found = error_bars.error_bars(runs, jointed(runs.fine))
    for of in ("change", "deviation"):
        for statistic, unit, wanted in (("force", "N", 1.2 * 10.0), ("moment", "N mm", 300.0 / LEFT)):
            bar = found.find(of, "joint_moment", statistic)
            assert bar is not None
            assert (bar.unit, bar.values) == (unit, pytest.approx(1.25 * wanted * TIMES, abs=1e-9))
        arm = found.find(of, "joint_moment", "arm")
        assert arm is not None
        assert arm.values == pytest.approx([np.nan, 0, 0], abs=1e-12, nan_ok=True)
        assert arm.parts == {"tetrahedra": pytest.approx(0, abs=1e-12)}  # of the frames that have an arm
    assert found.find("change", "moment_arm", "mean") is not None
    assert bars().find("change", "joint_moment", "force") is None
