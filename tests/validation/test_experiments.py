"""Every measured number is complete, and its experiment is described."""

import csv
import math
import re
from pathlib import Path

import pytest

from fem_reference.scenes.case import HOME

FOLDER = HOME / "validation" / "experiments"
UNITS = {"1", "mm", "deg", "kPa", "N"}
HOW = {"table", "digitised", "fit", "text"}
READ_IN = {"publication", "abstract", "quotation"}


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, strict=True))


def check(row: dict[str, str], described: set[str]) -> None:
    assert None not in row, row  # a comma too many
    assert None not in row.values(), row  # a comma too few
    assert row["experiment"] in described
    assert row["quantity"]
    assert row["condition"]
    assert math.isfinite(float(row["value"]))
    assert row["unit"] in UNITS
    assert not row["sd"] or 0 < float(row["sd"]) < math.inf
    assert not row["n"] or int(row["n"]) > 0
    assert row["how"] in HOW
    assert row["read_in"] in READ_IN
    assert re.fullmatch(r"10\.\d{4,9}/\S+", row["doi"])
    assert row["doi_confirmed"] in {"yes", "no"}


def described() -> set[str]:
    return set(re.findall(r"^## (\w+)$", (FOLDER / "README.md").read_text(encoding="utf-8"), re.MULTILINE))


def test_every_measured_number_is_complete_and_its_experiment_described() -> None:
    found = [row for path in FOLDER.glob("*.csv") for row in rows(path)]
    for row in found:
        check(row, described())
    assert {row["experiment"] for row in found} == described()


@pytest.mark.parametrize(
    "wrong",
    [
        {"unit": "psi"},
        {"how": "guessed"},
        {"doi": "doi.org/x"},
        {"value": "nan"},
        {"sd": "-1"},
        {"n": "0"},
        {"experiment": "nobody"},
        {"condition": None},
        {None: ["more"]},
    ],
    ids=str,
)
def test_an_incomplete_row_is_refused(wrong: dict) -> None:
    row = rows(FOLDER / "measured.csv")[0]
    check(row, described())
    with pytest.raises(AssertionError):
        check(row | wrong, described())
