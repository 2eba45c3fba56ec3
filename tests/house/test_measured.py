"""Tables of measurements on the pages: they are those of the files that are kept, and each file says where it is from."""

import re

import measured
import measurements
import pages
import pytest


def test_the_pages_have_the_tables_that_are_kept() -> None:
    assert measured.write_pages(check=True) == []


def test_every_table_has_its_place() -> None:
    places = re.findall(r"<!-- measured: (\w+) -->", "".join(pages.page(name) for name in pages.PAGES))
    assert set(places) == set(measurements.TABLES)


@pytest.mark.parametrize("name", measurements.MEASUREMENTS)
def test_a_measurement_says_its_command_commit_date_and_machine(name) -> None:
    file = measurements.kept(name)
    assert file["command"] == measurements.MEASUREMENTS[name].command
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", file["date"])
    assert re.fullmatch(r"[0-9a-f]{7,}", file["commit"])
    assert file["machine"]


def test_what_is_kept_of_the_catalogue_passes() -> None:
    for entry in measurements.kept("verify")["measured"]:
        assert entry["verdict"] == "pass"
        assert entry["error"] <= entry["within"], entry["name"]
