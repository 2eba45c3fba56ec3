"""Stresses as a metric: units, differences, runs without any, and a reference whose mean stress is its force times its length."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose

from fem_reference.io import files
from fem_reference.metrics import at_rest, change, context_of, find, measure
from fem_reference.metrics.stress import STATISTICS
from fem_reference.problems.of_case import setup
from fem_reference.runs import results
from fem_reference.runs.store import Run
from fem_reference.runs.stress_statistics import STATISTICS as KEPT
from fem_reference.runs.stress_statistics import stress_scalars
from fem_reference.studies import workflow
from tests.metrics.test_joint_moment import context, pulled


def stressed(*values: float, names: tuple[str, ...] = tuple(STATISTICS)) -> Run:
    return replace(pulled(), scalars={f"stress_{name}": np.array(values) for name in names})


def test_every_statistic_is_kept_by_a_run() -> None:
    assert set(STATISTICS) == {f"{kind}_{one}" for kind, some in KEPT.items() for one in some}


def test_stresses_are_in_kpa_and_differences_from_the_reference() -> None:
    run, other = stressed(0, 0.01, 0.02), stressed(0, 0.002, np.nan)
    given = context(run)
    for one in measure(run, at_rest(run), given, ["stress"]):
        assert_allclose(one.values, [0, 10, 20])
        assert one.unit == "kPa"
    assert len(measure(run, other, given, ["stress"])) == len(STATISTICS)
    for one in measure(run, other, given, ["stress"]):
        assert_allclose(one.values, [0, 8, np.nan])


def test_a_run_without_stresses_has_none_and_no_deviation_either() -> None:
    run, bare = stressed(0, 0.01, 0.02), pulled()
    given = context(run)
    assert measure(bare, run, given, ["stress"]) == measure(run, bare, given, ["stress"]) == ()
    part = stressed(0, 0.01, 0.02, names=("von_mises_mean",))
    assert [one.statistic for one in measure(part, run, given, ["stress"])] == ["von_mises_mean"]


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A straight bar with fibres along it, 40 mm long, that is drawn out by 2 mm."""
    folder = small.write(tmp_path_factory.mktemp("work") / "block")
    box = shapes.skin(shapes.box((4, 4, 12), (10, 10, 40)))
    files.write_surface(folder / "bar.vtp", box, box.points)
    scene = (folder / "case.toml").read_text()
    turn = scene[scene.index("axis = ") : scene.index("[[attachment]]")]
    drawn = (
        'direction = [0, 0, 1]\nkeyframes = [{ frame = 0, distance = "0 mm" }, { frame = 10, distance = "2 mm" }]\n\n'
    )
    law = small.FIBRES.format(slack=1.0).replace("0.05", "0.5") + "\n[fibres]"
    scene = scene.replace(turn, drawn).replace("\n[fibres]", law).replace("tet_size", 'mesher = "block"\ntet_size')
    (folder / "case.toml").write_text(scene)
    return folder


@pytest.mark.slow
def test_the_mean_stress_along_a_bar_is_its_force_times_its_length(block: Path, tmp_path: Path) -> None:
    """The mean of the stress over a body is that of its tractions times their places (Gurtin 1981, the mean stress theorem): along
    a bar of 42 mm between two planes, the force times 42 mm over the volume. 1 %: fibres lean where the bar gets narrower, by
    less than 5 degrees, and the middles of tetrahedra stand for them.

    What a run keeps does not depend on whether it keeps its unknowns, and is what follows from them.
    """
    case = workflow.load_case(block, {"frames.last": 10, "reference.store_state": True})
    run = workflow.solve(case, store=tmp_path / "store")
    assert run.outcome.status == "converged", run.outcome.message
    assert run.folder is not None
    given = context_of(setup(case), run)
    mean = find(change(run, given, ["stress"]), "stress", "along_fibres_mean")
    assert mean is not None
    force = np.abs(run.force("lid")[-1, 2])
    assert force > 1  # [N]: 10 kPa on 100 mm2
    assert_allclose(mean.values[[0, -1]], [0, 1000 * force * 42 / 4000], rtol=0.01, atol=1e-6)

    for number in (5, 10):
        for name, value in stress_scalars(results.of_run(run.folder, case), number).items():
            assert run.scalars[name][run.numbers.index(number)] == pytest.approx(value, rel=1e-9, abs=1e-12)
    bare = workflow.load_case(block, {"frames.last": 10, "reference.store_state": False})
    again = workflow.solve(bare, store=tmp_path / "bare")
    assert again.folder is not None
    assert not (again.folder / "state").exists()
    for name in (f"stress_{one}" for one in STATISTICS):
        assert_allclose(again.scalars[name], run.scalars[name], rtol=1e-9, atol=1e-12)
