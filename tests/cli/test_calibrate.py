"""The verb ``calibrate``: bad input ends with 2, a fit that does not hold with 1, and one that has no results with 3."""

from dataclasses import replace
from pathlib import Path

import pytest

from fem_reference import cli
from fem_reference.studies import calibration
from tests.report.test_calibration_texts import MU, Calibration, Estimate, found

KNOWN = found(1.0, Estimate(MU, 0.011, 0.0105, 0.0115))


@pytest.mark.parametrize(
    ("result", "status"),
    [
        (KNOWN, 0),
        (found(1.0, Estimate(MU, 0.011, 0.0105, float("inf"))), 1),
        (found(1.0, Estimate(MU, 0.011, 0.0105, 0.0115, "high")), 1),
        (replace(KNOWN, scatter=3.0), 1),
        (replace(KNOWN, scatter=float("nan")), 1),
        (replace(KNOWN, converged=False), 1),
        (replace(KNOWN, ended="a run that the fit needs has no result"), 3),
    ],
)
def test_the_status_says_whether_the_fit_holds(
    result: Calibration,
    status: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(calibration, "calibrate", lambda *_: result)
    given = ["hip_flexion", "--to", "data.csv", "--fit", "effect[0].mu", "--out", str(tmp_path)]
    assert cli.main(["calibrate", *given]) == status
    assert "neo_hooke mu: 0.011 MPa" in capsys.readouterr().out


def test_data_that_are_not_there_are_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["hip_flexion", "--to", str(tmp_path / "no.csv"), "--fit", "effect[0].mu", "--out", str(tmp_path)]
    assert cli.main(["calibrate", *given]) == 2
    assert "no.csv" in capsys.readouterr().err
