"""The squeezed box: plates press with the force of the homogeneous state, and the run says that this state is unstable."""

import importlib.util

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_reference.geometry import skins
from fem_reference.scenes import casefile
from fem_reference.studies import judging
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow

MU, BULK, AREA = 0.01, 10.0, 1e4  # [MPa], [mm2]


def homogeneous(height: float) -> tuple[float, float]:
    """The stretch l across and the force [N] of the plates: nothing pulls across, K (J - 1) + mu J^(-5/3) (l^2 - h^2) / 3 = 0."""

    def across(stretch: float) -> float:
        J = height * stretch**2
        return BULK * (J - 1) + MU * J ** (-5 / 3) * (stretch**2 - height**2) / 3

    stretch = brentq(across, 0.9 * height**-0.5, 1.1 * height**-0.5, xtol=1e-14)
    J = height * stretch**2
    return stretch, MU * J ** (-5 / 3) * (stretch**2 - height**2) * stretch**2 * AREA


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    scene = casefile.read("box_squeeze", changes={"frames.every": 50})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(skins, "_ACROSS", 20)  # a quarter of the points of contact: its state is homogeneous
        yield Bench(scene, tmp_path_factory.mktemp("box"))


@pytest.fixture(scope="module")
def run(bench):
    return bench.obtain("reference", bench.scene.reference, "reference")


def test_its_expectations_are_met(bench, run) -> None:
    result = judging.compare(bench, run, [])
    assert result.word == "doubtful pass", "its equilibrium is unstable"
    assert len([verdict for verdict in result.verdicts if verdict.word == "pass"]) >= len(bench.scene.expect)


def test_it_is_squeezed_homogeneously(run) -> None:
    assert run.outcome.status == "converged"
    at = run.positions[run.numbers.index(100)]
    height = np.ptp(at[:, 1])
    # Springs pull with a 100 000th of the shear modulus; an unstable mode would show as millimetres. The gap is 10 mm, where
    # the plates press with 0.64 MPa a contact of 80 MPa/mm yields by 0.01 mm on either side.
    assert 10 < height < 10.1
    stretch, force = homogeneous(height / 80)
    assert np.ptp(at[:, 0]) / 100 == pytest.approx(stretch, rel=1e-3)  # contact yields evenly
    assert np.ptp(at[:, 2]) / 100 == pytest.approx(stretch, rel=1e-3)
    rest = run.surface.points
    assert at[:, 0] == pytest.approx(stretch * rest[:, 0], abs=0.05)
    for name in ("force_top", "force_bottom"):
        assert run.scalars[name][run.numbers.index(100)] == pytest.approx(force, rel=1e-3)
    assert homogeneous(0.125)[0] == pytest.approx(np.sqrt(0.99733 * 8), rel=1e-5)


def test_it_returns_to_rest(run) -> None:
    for frame in (200, 250, 300):
        assert np.abs(run.positions[run.numbers.index(frame)] - run.surface.points).max() < 1e-6


def test_the_run_says_that_it_is_unstable_below_half_the_height(run) -> None:
    modes = dict(zip(run.numbers, run.scalars["negative_modes"], strict=True))
    assert [modes[frame] for frame in (0, 50, 200, 300)] == [0, 0, 0, 0]  # 55 mm high at 50
    assert modes[100] >= 2
    assert "unstable" in run.outcome.message
