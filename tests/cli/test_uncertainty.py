"""The verb ``uncertainty``: which case is varied, and the exit status where a band is missing."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from fem_reference import cli
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import uncertainty
from tests.assessment.test_uncertainty import band, study


@pytest.mark.parametrize(
    ("given", "refinements"), [([], 0), (["--set", "muscle.refinements=1"], 1), (["--set", "frames.last=100"], 0)]
)
def test_the_quick_size_is_varied_except_for_what_is_set(
    given: list[str],
    refinements: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = list[Any]()
    monkeypatch.setattr(uncertainty, "study", lambda *all: asked.append(all) or study(band()))
    assert cli.main(["uncertainty", "hip_flexion", "--runs", "12", *given, "--out", str(tmp_path)]) == 0
    ((case, _, workers, runs, seed),) = asked
    assert isinstance(case, MuscleCase)
    assert (case.muscle.refinements, workers.count, runs, seed) == (refinements, 1, 12, 1)
    assert "band up to 1 mm wide" in capsys.readouterr().out
    assert len([*tmp_path.glob("hip_flexion*/uncertainty.html")]) == 1


def test_a_band_that_is_missing_is_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refused = study(replace(band(), refused="12 of 64 runs have no result"))
    monkeypatch.setattr(uncertainty, "study", lambda *_: refused)
    assert cli.main(["uncertainty", "hip_flexion", "--out", str(tmp_path)]) == 3


def test_a_case_without_a_solution_is_a_failure_with_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    none = replace(study(), refused="the reference diverged: frame 40", runs=0)
    monkeypatch.setattr(uncertainty, "study", lambda *_: none)
    assert cli.main(["uncertainty", "hip_flexion", "--out", str(tmp_path)]) == 3
    assert "No band: the reference diverged: frame 40." in capsys.readouterr().out


def test_no_runs_at_all_are_bad_input(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match=r"^2$"):
        cli.main(["uncertainty", "hip_flexion", "--runs", "0", "--out", str(tmp_path)])
