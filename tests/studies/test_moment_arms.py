"""Arms of a run beside published ones, on a made case; of the report's anatomy where its data is."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import small

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.studies import moment_arms
from fem_reference.studies.execution import Bench
from fem_reference.studies.moment_arms import BLEMKER, NEMETH, coarse, published

CURVE = "hip_flexion_deg,extension_moment_arm_mm\n0,76.8\n30,66.3\n"
ENVELOPE = """muscle,coordinate,bound,angle_deg,moment_arm_cm
iliacus,hip_flexion,upper,10,3.0
iliacus,hip_flexion,upper,-10,2.0
iliacus,hip_flexion,lower,0,1.0
iliacus,hip_flexion,lower,20,2.0
other,hip_flexion,lower,0,9.0
"""


@pytest.fixture
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A data folder with a curve and a range."""
    folder = tmp_path / "hip" / "moment_arms"
    folder.mkdir(parents=True)
    (folder / "gluteus_maximus_nemeth_1985.csv").write_text(CURVE)
    (folder / "envelopes_blemker_delp_2005.csv").write_text(ENVELOPE)
    monkeypatch.setenv("FEM_REFERENCE_DATA", str(tmp_path))
    return folder


@pytest.mark.usefixtures("data")
def test_published_arms_are_read_in_mm(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    curve = published(scene, NEMETH, "gluteus_maximus")
    assert curve.low.tolist() == curve.high.tolist() == [76.8, 66.3]
    found = published(scene, BLEMKER, "iliacus")
    # From 0 to 10 degrees, where both sides are known: 10 to 15 below, 25 to 30 above.
    assert found.angles.tolist() == [0, 10]
    assert (found.low.tolist(), found.high.tolist()) == ([10, 15], [25, 30])


@pytest.mark.parametrize("text", ["hip_flexion_deg\n0\n", CURVE.replace("76.8", "much"), ""])
def test_a_damaged_file_is_refused_by_name(data: Path, tmp_path: Path, text: str) -> None:
    (data / "gluteus_maximus_nemeth_1985.csv").write_text(text)
    (data / "envelopes_blemker_delp_2005.csv").write_text("muscle\n")
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    for experiment in (NEMETH, BLEMKER):
        with pytest.raises(InputError, match=r"moment_arms.*\.csv"):
            published(scene, experiment, "iliacus")


def test_what_has_no_data_is_left_out_with_the_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FEM_REFERENCE_DATA", raising=False)
    found, missing = moment_arms.beside(tmp_path / "runs")
    assert found == ()
    assert set(missing) == {one.case for one in moment_arms.STUDIES}
    assert all("FEM_REFERENCE_DATA" in why for why in missing.values())


def test_a_coarse_case_has_its_size_and_its_frames_and_nobody_beside() -> None:
    scene = coarse(casefile.read_muscle("hip_flexion"), 20.0, (0.0, 0.5))
    assert (scene.muscle.tet_size, scene.muscle.refinements) == (20.0, 0)
    assert scene.numbers[-1] == 50
    assert (scene.candidate, scene.expect) == ((), ())


@pytest.mark.parametrize(("flexion", "extremes"), [((-0.2, 1.6), (0.2, -1.6)), ((0.0, 1.0), (0.0, -1.0))])
def test_the_hip_goes_from_rest_back_and_on_by_a_hundredth_of_a_radian_a_frame(flexion, extremes) -> None:
    """A negative angle about the axis to the left is flexion; every frame is at another angle, but for rest."""
    scene = coarse(casefile.read_muscle("hip_flexion"), 20.0, flexion)
    (motion,) = [bone.motion.poses() for bone in scene.bone if bone.motion]
    angles = np.interp(scene.numbers, motion.frames, motion.amounts)
    assert angles[0] == 0
    assert (angles.max(), angles.min()) == pytest.approx(extremes)
    assert np.abs(np.diff(angles)) == pytest.approx(0.1)
    assert scene.numbers[1] == 10


def test_a_denied_run_is_no_evidence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though it went as far as was wanted."""
    run = SimpleNamespace(numbers=(0, 100), outcome=SimpleNamespace(status="denied", message="a bone was crossed"))
    monkeypatch.setattr(Bench, "reference", lambda _: run)
    study = moment_arms.ArmStudy("hip_flexion", 25.0, (0.0, 1.0), "gluteus_medius", "extension", ())
    with pytest.raises(InputError, match="hip_flexion: got a bone was crossed"):
        list(moment_arms.of_case(study, tmp_path / "runs"))


@pytest.mark.slow
def test_a_run_that_ends_before_1_rad_is_no_evidence(tmp_path: Path) -> None:
    short = moment_arms.ArmStudy("hip_flexion", 25.0, (0.0, 0.2), "gluteus_medius", "extension", ())
    with pytest.raises(
        InputError, match="hip_flexion: got all 3 frames reached, want a reference that reaches a flexion of 1"
    ):
        list(moment_arms.of_case(short, tmp_path / "runs"))


@pytest.mark.slow
def test_arms_of_a_solved_case_are_those_of_the_metric(tmp_path: Path) -> None:
    """At the middle frames, where the metric's parabola through three and the polynomial through six agree to some per cent."""
    from fem_reference.metrics import context_of
    from fem_reference.metrics.fibre_length import both_lengths
    from fem_reference.metrics.moment_arm import excursion_arms
    from fem_reference.studies.execution import Bench

    bench = Bench(coarse(casefile.read_muscle("hip_flexion"), 25.0, (0.0, 1.0)), tmp_path / "runs")
    run = bench.reference()
    assert run.outcome.status == "converged"
    context = context_of(bench.setup(), run)
    known = -excursion_arms(both_lengths(run, run, context)[0], context, run.numbers)
    at, arms = moment_arms.flexion_arms(run, bench)
    flexion = -np.degrees(context.joints[0].angles(run.numbers))
    for frame in (4, 5):
        own = np.array([np.interp(flexion[frame], at, arm) for arm in arms.T])
        assert own == pytest.approx(known[frame], rel=0.1, abs=1.0)
