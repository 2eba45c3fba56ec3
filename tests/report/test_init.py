"""The door of ``report``: the page of a comparison, whatever was compared."""

import json

import pytest

from fem_reference import report
from tests.report.examples import plate


@pytest.mark.slow
def test_a_muscle_and_a_field_have_a_page_of_one_kind_with_the_same_files(comparison, tmp_path) -> None:
    for i, one in enumerate((comparison, plate(tmp_path / "plate"))):
        page = report.of_comparison(one)
        assert (page.kind, page.title) == ("comparison", one.scene.title)
        report.write(page, tmp_path / str(i), report.NAME)
        names = sorted(path.name for path in (tmp_path / str(i)).iterdir())
        assert names == ["measures.csv", "measures.json", "report.html"]
        assert json.loads((tmp_path / str(i) / "measures.json").read_text()) == json.loads(
            json.dumps(report.summary(one))
        )


@pytest.mark.parametrize("name", report.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert hasattr(report, name)
