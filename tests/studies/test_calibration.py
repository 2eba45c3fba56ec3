"""Calibration end to end: the moduli of a bar from its own forces, by runs of the reference."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import stand_ins

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies.calibration import calibrate, chosen, unit_of
from fem_reference.studies.campaign import Workers, shared_bench
from fem_reference.studies.unknowns import unknowns
from tests.studies.test_uncertainty import PARALLEL, pulled

MU, C1 = "effect[0].mu", "effect[1].c1"


@pytest.fixture
def case(tmp_path: Path) -> MuscleCase:
    return pulled(tmp_path, {"uncertain": PARALLEL, "frames.every": 5})


def data(folder: Path, *rows: str) -> Path:
    (folder / "data.csv").write_text("\n".join(["frame,quantity,value,unit,sd", *rows]) + "\n")
    return folder / "data.csv"


def noisy_forces(case: MuscleCase, tmp_path: Path) -> Path:
    """Forces of the bar with a modulus of 11 kPa and 1 % of noise, in five rows."""
    truth = shared_bench(unknowns(case).at({MU: 0.011}), tmp_path / "runs").reference()
    noise = 1 + 0.01 * np.random.default_rng(4).standard_normal(5)
    forces = np.linalg.norm(truth.force("lid"), axis=1)
    frames, places = (5, 10, 15, 20, 20), (1, 2, 3, 4, 4)
    rows = [
        f"{frame},force.lid{axis},{1000 * forces[i] * one:.6g},mN,{10 * forces[i]:.4g}"
        for frame, i, one, axis in zip(frames, places, noise, ("", "", "", "", ".z"), strict=True)
    ]
    if truth.force("lid")[4, 2] < 0:
        rows[-1] = rows[-1].replace(".z,", ".z,-")
    return data(tmp_path, *rows)


@pytest.mark.slow
def test_a_modulus_comes_back_from_its_own_noisy_forces(case: MuscleCase, tmp_path: Path) -> None:
    """Five rows about the same slope know it to 1 % / sqrt(5) and a t factor of 2.8."""
    path = noisy_forces(case, tmp_path)
    found = calibrate(case, path, [MU], tmp_path / "runs", Workers())
    (mu,) = found.estimates
    assert mu.low < 0.011 < mu.high
    assert mu.high - mu.low < 0.1 * mu.value
    assert mu.is_known
    assert found.runs < 16
    lines: list[str] = []
    called = fr.calibrate(case, str(path), ["effect.0.mu"], store=tmp_path / "runs", progress=lines.append)
    assert called == found, "the call of the package is the same, from stored runs"
    assert any("solved before" in line for line in lines)


@pytest.mark.nightly  # by a law alone it is asked by day in tests/assessment/test_calibration.py
@pytest.mark.slow
def test_of_two_matrices_in_parallel_only_the_sum_is_known(case: MuscleCase, tmp_path: Path) -> None:
    """The sum is mu + 2 c1."""
    path = noisy_forces(case, tmp_path)
    found = calibrate(case, path, [MU], tmp_path / "runs", Workers())
    both = calibrate(case, path, [MU, C1], tmp_path / "runs", Workers())
    ((one, other, correlation),) = both.pairs
    assert (one, other) == ("neo_hooke mu", "mooney_rivlin c1")
    assert correlation < -0.99
    assert not any(one.is_known for one in both.estimates)
    mu, c1 = both.estimates
    assert mu.value + 2 * c1.value == pytest.approx(found.estimates[0].value + 2 * 0.003, rel=1e-3)


@pytest.mark.nightly
@pytest.mark.slow
def test_a_modulus_is_inside_its_interval_in_19_of_20_trials_by_the_reference(case: MuscleCase, tmp_path: Path) -> None:
    """Twenty seeds of 1 % of noise; the same by a law alone, and of 40 seeds, is in tests/assessment/test_calibration.py."""
    truth = shared_bench(unknowns(case).at({MU: 0.011}), tmp_path / "runs").reference()
    forces, inside = np.linalg.norm(truth.force("lid"), axis=1), 0
    for seed in range(20):
        noise = 1 + 0.01 * np.random.default_rng(seed).standard_normal(4)
        rows = [f"{5 * i},force.lid,{forces[i] * noise[i - 1]:.9g},N,{0.01 * forces[i]:.9g}" for i in range(1, 5)]
        (mu,) = calibrate(case, data(tmp_path, *rows), [MU], tmp_path / "runs", Workers()).estimates
        inside += mu.low < 0.011 < mu.high
    assert inside >= 19


def test_a_run_that_diverges_is_named_with_its_values(
    case: MuscleCase, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No exception: the command line ends with the status of a solver that failed."""

    def solve(problem: MuscleProblem, _settings: object, sink: Callable[[Frame], None]) -> Outcome:
        sink(Frame(0, problem.surface.points, problem.fibres.points, problem.mesh.points))
        return Outcome("diverged", "frame 5", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, solve)
    found = calibrate(
        case, data(tmp_path, "5,force.lid,1,N,1", "10,force.lid,1,N,1"), [MU], tmp_path / "runs", Workers()
    )
    assert found.ended
    assert [(one.status, one.message) for one in found.failures] == [("diverged", "frame 5")] * 2
    assert found.failures[0].values == {MU: pytest.approx(0.01)}


def test_quantities_have_the_units_of_the_case(case: MuscleCase) -> None:
    for quantity, unit in (
        ("force.lid", "N"),
        ("force.lid.z", "N"),
        ("position.3.x", "mm"),
        ("volume.deviation", "%"),
        ("joint_moment.moment", "N mm"),
    ):
        assert unit_of(case, quantity, "here") == unit


@pytest.mark.parametrize(
    ("quantity", "want"),
    [
        ("force.femur", "force.BONE or force.BONE.x, where BONE is one of floor, lid"),
        ("force", "force.BONE"),
        ("position.3", "METRIC.STATISTIC, force.BONE"),
        ("position.x.x", "METRIC.STATISTIC"),
        ("length", "METRIC.STATISTIC"),
        ("l2_error.relative", "METRIC.STATISTIC"),
    ],
)
def test_a_quantity_that_a_muscle_has_not_is_named(case: MuscleCase, quantity: str, want: str) -> None:
    with pytest.raises(InputError, match=f'here: got "{quantity}", want {want}'):
        unit_of(case, quantity, "here")


def test_only_a_number_with_a_range_is_fitted(case: MuscleCase, tmp_path: Path) -> None:
    assert [one.key for one in chosen(unknowns(case), [C1, "effect.0.mu", MU, C1])] == [C1, MU]
    with pytest.raises(
        InputError, match=r'--fit: got "effect\[2\]\.bulk", which has no range, want a key with a range'
    ):
        chosen(unknowns(case), ["effect[2].bulk"])
    with pytest.raises(InputError, match=r"--fit: got nothing, want one of effect\[0\]\.mu"):
        chosen(unknowns(case), [])
    with pytest.raises(InputError, match=r"row 2: frame: got 7, want a frame of the case: 0 to 20, every 5"):
        calibrate(case, data(tmp_path, "7,force.lid,1,N,1"), [MU], tmp_path / "runs", Workers())
