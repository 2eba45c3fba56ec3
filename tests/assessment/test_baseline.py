"""The file of a baseline: its limits, what an update keeps, and what is refused."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from balls import NUMBERS, SCENE, SHIFTS, asked, bars, checked, current, edited

from fem_reference import metrics
from fem_reference.assessment import baseline
from fem_reference.assessment.baseline import limits
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import Measure

DAMAGE = {
    "half": (lambda path: path.write_text(path.read_text()[:100]), "want the baseline of a candidate"),
    "no table": (lambda path: path.write_text("[]"), "format: got no table, want 1"),
    "format": (lambda path: edited(path, lambda t: t.update(format=2)), "format: got 2, want 1"),
    "unknown key": (lambda path: edited(path, lambda t: t.update(more=2)), "baseline.more: got an unknown key"),
    "negative": (
        lambda path: edited(path, lambda t: t["positions"].update(tolerance=-1)),
        "baseline.positions.tolerance: got -1",
    ),
    "no statistic": (
        lambda path: edited(path, lambda t: t["measures"].update({"mass.sum": t["measures"]["volume.deviation"]})),
        "measures.mass.sum: got a statistic in .*want an existing statistic",
    ),
    "unit": (
        lambda path: edited(path, lambda t: t["measures"]["volume.deviation"].update(unit="mm")),
        'measures.volume.deviation: got a statistic in "mm", want an existing statistic, in %',
    ),
    "values": (
        lambda path: edited(path, lambda t: t["measures"]["volume.deviation"]["values"].pop()),
        "volume.deviation.values: got 2 values, want 3, one per frame",
    ),
    "positions": (
        lambda path: edited(path, lambda t: t["positions"]["values"][1].pop()),
        "positions.values: got a different number of positions, want 64 vertices in each of 3 frames",
    ),
    "case": (lambda path: edited(path, lambda t: t.update(case="cube")), 'case: got "cube", want "ball"'),
    "candidate": (lambda path: edited(path, lambda t: t.update(candidate="x")), 'candidate: got "x", want "mine"'),
}


@pytest.fixture
def path(tmp_path):
    """A baseline, made where the reference has an error bar of 0.5 of everything."""
    file = tmp_path / "new" / "ball.json"
    baseline.update(file, current(known=bars()))
    return file


def test_an_update_keeps_what_was_edited_so_that_accuracy_cannot_be_lost_in_small_steps(path) -> None:
    def edit(table) -> None:
        table["measures"]["surface_deviation.rms"] |= {"tolerance": 1.2, "within": 12.5}
        table["positions"]["tolerance"] = 5.0
        del table["measures"]["volume.deviation"]

    edited(path, edit)
    worse = current([*SHIFTS[:2], (13.1, 0, 10)], bars())
    assert asked(checked(path, worse), "unchanged", "surface_deviation.rms").word == "pass"
    made = baseline.update(path, worse)
    assert (made.measures["surface_deviation.rms"].tolerance, made.positions.tolerance) == (1.2, 5.0)
    check = checked(path, worse)
    assert check.answer("unchanged") == "pass"
    rms = asked(check, "within", "surface_deviation.rms")
    assert (rms.word, rms.allowed) == ("fail", 12.5)
    assert rms.why == "13.1 mm from the reference, 12.5 mm allowed"
    assert "not in the baseline and not judged: volume.deviation" in check.notes


def test_limits_of_a_new_baseline() -> None:
    one = Measure("volume", "deviation", "%", np.array([0.0, -20.0, 5.0]))
    # The bar where it is less than 2 % of 20; the greatest of value and bar.
    assert limits(one, np.array([0.0, 0.1, 0.3])) == (0.3, 20.2)
    # 2 % of 20 where it is less than the bar.
    assert limits(one, np.array([0.0, 0.1, 9.0])) == (0.4, 20.2)
    assert limits(one, np.full(3, np.nan)) == (0.4, None)
    # Ten of the last digit where nothing deviates and everything is known.
    assert limits(Measure("volume", "deviation", "%", np.zeros(3)), np.zeros(3)) == (0.001, 0.001)
    assert limits(Measure("volume", "deviation", "%", np.full(3, np.nan)), np.zeros(3)) == (0.001, None)
    itself = Measure("penetration", "volume", "mm3", np.array([0.0, 100, 200]))
    assert limits(itself, np.zeros(3)) == (4.0, 205.0)


def test_every_unit_has_its_digits() -> None:
    assert set(metrics.units({"surface", "lines"}).values()) <= set(baseline.PLACES)


def test_a_change_of_one_frame_is_a_few_lines_of_the_file(path) -> None:
    before = path.read_text().splitlines()
    assert list(json.loads(path.read_text())) == sorted(json.loads(path.read_text()))
    shifts = np.array(SHIFTS, float)
    shifts[1] += [0, 2, 0]
    baseline.update(path, current(shifts, bars()))
    after = path.read_text().splitlines()
    assert len(before) == len(after)
    changed = [line for line, other in zip(after, before, strict=True) if line != other]
    # One of positions, and one of each statistic that changed.
    assert 1 < len(changed) < 10
    assert len(max(after, key=len)) < 2000


@pytest.mark.parametrize("what", DAMAGE)
def test_a_file_that_is_damaged_or_somebody_elses_is_neither_read_nor_written_over(path, what) -> None:
    damage, message = DAMAGE[what]
    damage(path)
    text = path.read_text()
    with pytest.raises(InputError, match=message):
        baseline.read(path, SCENE, "mine")
    with pytest.raises(InputError, match=message):
        baseline.check(path, SCENE, "mine")
    with pytest.raises(InputError, match=message):
        baseline.update(path, current())
    assert path.read_text() == text


def test_other_frames_are_reported(path) -> None:
    path.write_text(path.read_text().replace("[0, 10, 20]", "[0, 10, 30]"))
    with pytest.raises(InputError, match="frames: got 3 frame numbers that differ from the scene's, want the scene's"):
        baseline.read(path, SCENE, "mine")


def test_another_scene_wants_an_update(path, tmp_path) -> None:
    other = SimpleNamespace(name="ball", key="another", place="case.toml", numbers=NUMBERS)
    with pytest.raises(InputError, match=r"scene: got 0123456789abcdef\.\.\., while case.toml is another"):
        baseline.read(path, other, "mine")
    baseline.check(path, other, "mine")
    baseline.update(path, current(scene=other))
    assert baseline.read(path, other, "mine").scene == "another"
    with pytest.raises(InputError, match="got no file, want the baseline of a candidate"):
        baseline.read(tmp_path / "none.json", SCENE, "mine")
