"""The verb ``recommend`` against the files of studies: errors and times that are asked for, and what is nearest."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
import small

from fem_reference import cli
from fem_reference.assessment.cost_study import CaseStudy, facts
from fem_reference.problems import muscle
from fem_reference.report import study_page
from fem_reference.scenes import casefile
from fem_reference.studies.features import features as features_of
from tests.assessment.test_recommendation import PERCENT, own_study, study


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, float]]:
    """The small scene, and what it is like."""
    folder = small.write(tmp_path_factory.mktemp("scenes") / "bar")
    scene = casefile.read_muscle(folder)
    return folder, features_of(scene, muscle.setup(scene))


def saved(folder: Path, *studies: CaseStudy) -> Path:
    for one in studies:
        (folder / one.case).mkdir(parents=True, exist_ok=True)
        (folder / one.case / "study.json").write_text(json.dumps(facts(one, {"machine": "here"})))
    return folder


def said(
    bar: tuple[Path, dict[str, float]], out: Path, capsys: pytest.CaptureFixture[str], *words: str
) -> tuple[int, str]:
    """Exit status and what the verb says of the small scene."""
    status = cli.main(["recommend", str(bar[0]), "--out", str(out), "--quiet", *words])
    captured = capsys.readouterr()
    return status, captured.out + captured.err


def test_a_metric_of_one_study_only_is_asked_of_that(bar, tmp_path: Path, capsys) -> None:
    more = study("other", 80)
    points = tuple(replace(one, errors=one.errors | {PERCENT: 4.0 / i}) for i, one in enumerate(more.points, 1))
    more = replace(more, points=points, units=more.units | {PERCENT: "%"})
    for studies in ((own_study(bar[1]), more), (replace(more, case="aaa"), own_study(bar[1]))):
        out = saved(tmp_path / studies[0].case, *studies)
        status, text = said(bar, out, capsys, "--metric", PERCENT, "--error", "5 %")
        assert status == cli.DONE, text
        # A share is as it is on another case, 2 % in 3 ms; twice for want of others that a margin would be found on.
        assert "fibre length, rms percent at most 4 %" in text
        assert "expected from" in text


@pytest.mark.parametrize("text", ["-1 mm", "0 mm", "-1", "1", "1 %", "inf mm", "nan mm", ""])
def test_an_error_that_is_none_is_refused(text: str, bar, tmp_path: Path, capsys) -> None:
    status, printed = said(bar, saved(tmp_path, own_study(bar[1])), capsys, f"--error={text}")
    assert status == cli.BAD_INPUT
    assert f'--error: got "{text}", want ' in printed


@pytest.mark.parametrize(
    ("text", "sweeps"),
    [
        ("60 fps", 10),
        ("60fps", 10),
        ("60 Hz", 10),
        ("200 fps", 3),
        ("200 frames/s", 3),
        ("4 ms", 3),
        ("4 ms/frame", 3),
        ("0.004 s / frame", 3),
    ],
)
def test_a_time_is_that_of_a_frame_or_frames_a_second(text: str, sweeps: int, bar, tmp_path: Path, capsys) -> None:
    # Frames of 1, 3 and 10 ms: 60 of these a second leave 16.7 ms for each, 200 leave 5 ms.
    status, printed = said(bar, saved(tmp_path, own_study(bar[1])), capsys, "--time", text)
    assert status == cli.DONE
    assert f"pbd: sweeps = {sweeps}" in printed


@pytest.mark.parametrize("text", ["0 fps", "-60 fps", "fps", "60 fpm", "60", "60 mm", "fast fps", "1e-400 fps"])
def test_a_time_that_is_none_is_refused(text: str, bar, tmp_path: Path, capsys) -> None:
    status, printed = said(bar, saved(tmp_path, own_study(bar[1])), capsys, f"--time={text}")
    assert status == cli.BAD_INPUT
    assert f'--time: got "{text}", want ' in printed


def test_where_none_is_good_enough_the_nearest_and_the_reason_are_named(bar, tmp_path: Path, capsys) -> None:
    out = saved(tmp_path, own_study(bar[1], bar=2.0))
    status, text = said(
        bar, out, capsys, "--error", "2.5 mm", "--time", "10 ms", "--json", str(tmp_path / "found.json")
    )
    assert status == cli.VERDICT_FAIL
    assert "none of 4 settings meets the request on bar" in text
    # 0.02 of 50 mm and the bar of 2 mm: what was measured is below what is asked, and what is known is not.
    assert "the nearest: pbd: sweeps = 10" in text
    assert "at most 3 mm (1 mm measured, and 2 mm, the error bar of the truth), 10 ms a frame" in text
    assert "without the bar, the error would" in text
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["recommended"] is None
    assert found["nearest"]["choice"]["sweeps"] == 10
    assert (found["nearest"]["error"], found["nearest"]["bar"]) == (3.0, 2.0)
    status, text = said(bar, out, capsys, "--error", "1 mm")
    assert (status, "error bar of the truth is 2 mm" in text) == (cli.VERDICT_FAIL, True)
    status, text = said(bar, out, capsys, "--time", "0.5 ms")
    assert "the nearest: pbd: sweeps = 1" in text


def test_all_studies_of_a_page_of_several_cases_are_read(bar, tmp_path: Path, capsys) -> None:
    (tmp_path / "study").mkdir()
    several = [facts(one, {}) for one in (own_study(bar[1]), study("b", 80))]
    (tmp_path / "study" / "study.json").write_text(json.dumps(several))
    assert said(bar, tmp_path, capsys, "--error", "6 mm")[0] == cli.DONE


def test_without_a_request_it_says_what_the_page_of_the_study_says(bar, tmp_path: Path, capsys) -> None:
    case = own_study(bar[1])
    status, text = said(bar, saved(tmp_path, case), capsys, "--json", str(tmp_path / "facts.json"))
    lines = study_page.answer_texts(study_page.answered(case), "mm")
    assert text.splitlines() == lines
    found = json.loads((tmp_path / "facts.json").read_text())["answers"]
    assert [one["limits"] for one in found] == [{"error": 1.0}, {"error": 5.0}, {"time": pytest.approx(1 / 60)}, {}]
    assert status == (cli.VERDICT_FAIL if any("no setting" in line for line in lines[:-1]) else cli.DONE)
    status, text = said(bar, tmp_path, capsys, "--error", "5 mm")
    one = found[1]
    assert f"{one['seconds_per_frame'] * 1000:.3g} ms a frame" in text
