"""The verb ``calibrate``: bad input ends with 2, and a parameter that is not determined with 1."""

from pathlib import Path

import pytest

from fem_reference import cli
from fem_reference.studies import calibration
from tests.report.test_calibration_texts import MU, Estimate, found


@pytest.mark.parametrize(("high", "at", "status"), [(0.0115, "", 0), (float("inf"), "", 1), (0.0115, "high", 1)])
def test_the_status_says_whether_all_is_determined(
    high: float,
    at: str,
    status: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    result = found(1.0, Estimate(MU, 0.011, 0.0105, high, at))
    monkeypatch.setattr(calibration, "calibrate", lambda *_: result)
    given = ["hip_flexion", "--to", "data.csv", "--fit", "effect[0].mu", "--out", str(tmp_path)]
    assert cli.main(["calibrate", *given]) == status
    assert "neo_hooke mu: 0.011 MPa" in capsys.readouterr().out


def test_data_that_are_not_there_are_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["hip_flexion", "--to", str(tmp_path / "no.csv"), "--fit", "effect[0].mu", "--out", str(tmp_path)]
    assert cli.main(["calibrate", *given]) == 2
    assert "no.csv" in capsys.readouterr().err
