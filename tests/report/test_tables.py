"""Numbers of a comparison as JSON and CSV: all of them, and what is not finite is null."""

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from fem_reference import report
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.report.tables import COLUMNS


def test_forces_are_rows_of_the_run_that_recorded_them(comparison):
    scalars = {
        f"{kind}_on_plate_{axis}": np.full(5, i + 0.5) for kind in ("force", "moment") for i, axis in enumerate("xyz")
    }
    quick = replace(comparison.candidates[0], scalars=scalars)
    reference = replace(comparison.reference, scalars={**comparison.reference.scalars, **scalars})
    printed = report.summary(replace(comparison, reference=reference, candidates=(quick, comparison.candidates[1])))
    found = [row for row in printed["from_rest"] if row["metric"].endswith("_on_bone") and row["frame"] == 20]
    assert {row["candidate"] for row in found} == {"reference", "quick"}
    wanted = {("force_on_bone", "plate_y", 1.5, "N"), ("moment_on_bone", "plate_z", 2.5, "N mm")}
    wanted.add(("force_on_bone", "plate", np.sqrt(0.5**2 + 1.5**2 + 2.5**2), "N"))
    assert wanted <= {(row["metric"], row["statistic"], row["value"], row["unit"]) for row in found}
    assert len([row for row in printed["measures"] if row["metric"] == "force_on_bone"]) == 4 * 5


def test_summary_has_the_documented_keys_and_survives_json(comparison):
    printed = report.summary(comparison)
    assert json.loads(json.dumps(printed, allow_nan=False)) == printed
    keys = [
        "case",
        "solver",
        "status",
        "message",
        "verdict",
        "doubts",
        "second_check",
        "mesh",
        "cost",
        "measures",
        "from_rest",
        "verdicts",
        "error_bars",
        "rankings",
        "unsound",
    ]
    assert list(printed) == keys
    assert printed["error_bars"] == []
    assert (printed["case"], printed["solver"], printed["status"], printed["verdict"]) == (
        "press",
        "fenicsx",
        "converged",
        "pass",
    )
    assert printed["cost"]["quick"] == {"seconds": 12.0, "seconds_solve": 8.0, "iterations": 40.0}
    assert {row["candidate"] for row in printed["from_rest"]} == {"reference", "quick", "torn"}
    assert printed["verdicts"][0]["because"] == "It is <nearly> incompressible & closed."


def value(rows, candidate, metric, statistic, frame):
    (found,) = (
        row["value"]
        for row in rows
        if (row["candidate"], row["metric"], row["statistic"], row["frame"]) == (candidate, metric, statistic, frame)
    )
    return found


def test_summary_values_are_the_measures(comparison):
    printed = report.summary(comparison)
    # quick is 1 mm a step from the reference, and sqrt(1 + 2^2) mm a step from rest; rounding is 1e-15.
    assert value(printed["measures"], "quick", "surface_deviation", "max", 30) == pytest.approx(3, abs=1e-12)
    assert value(printed["from_rest"], "quick", "surface_deviation", "max", 30) == pytest.approx(3 * 5**0.5, abs=1e-12)
    assert value(printed["measures"], "reference", "surface_deviation", "max", 30) == pytest.approx(6, abs=1e-12)
    assert value(printed["measures"], "reference", "inversion", "min_det_F_points", 40) == 0.5


def test_what_is_not_finite_is_null(comparison):
    printed = report.summary(comparison)
    assert value(printed["measures"], "torn", "surface_deviation", "rms", 40) is None
    assert value(printed["measures"], "torn", "surface_deviation", "rms", 30) == pytest.approx(1.5, abs=1e-12)
    damaged = replace(comparison.verdicts[0], word="fail", value=float("inf"))
    assert report.summary(replace(comparison, verdicts=(damaged,)))["verdicts"][0]["value"] is None


def test_bars_are_those_of_their_frames_and_attachments_apart(comparison):
    numbers = comparison.reference.numbers
    values, model = np.arange(1.0, 6.0), np.array([np.nan, 0.25, 0.5, 0.75, 1.0])
    found = tuple(
        ErrorBar("deviation", "surface_deviation", name, "mm", values, {"mesh": 1.0}, model=change)
        for name, change in (("rms", model), ("max", None))
    )
    known = replace(comparison, error_bars=ErrorBars(numbers, (4.0, 8.0), 1.5, found))
    rows = report.summary(known)["error_bars"]
    wanted = dict(zip(numbers, zip(values.tolist(), [None, *model[1:].tolist()], strict=True), strict=True))
    assert {row["frame"]: (row["value"], row["model"]) for row in rows if row["statistic"] == "rms"} == wanted
    assert {row["frame"]: (row["value"], row["model"]) for row in rows if row["statistic"] == "max"} == {
        number: (value, None) for number, (value, _) in wanted.items()
    }


@pytest.mark.slow
def test_csv_has_the_same_numbers(comparison, tmp_path):
    report.write(report.of_comparison(comparison), tmp_path / "out", report.NAME)
    rows = list(csv.DictReader(io.StringIO((tmp_path / "out" / "measures.csv").read_text())))
    printed = json.loads((tmp_path / "out" / "measures.json").read_text())["measures"]
    assert tuple(rows[0]) == COLUMNS
    read = [row | {"frame": int(row["frame"]), "value": float(row["value"]) if row["value"] else None} for row in rows]
    assert read == printed
