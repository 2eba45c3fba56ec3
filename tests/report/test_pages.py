"""Pages have names that hold what makes them different, and none is lost to another."""

import json
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from jinja2 import TemplateNotFound, UndefinedError

from fem_reference.report import pages
from fem_reference.report.asked import write_index
from fem_reference.report.pages import template
from tests.report.stamped import put

CONTENTS = {"title": "A <title>", "entries": (), "others": ("a&b.html",)}


def test_a_page_says_of_itself_what_it_was_given(tmp_path: Path) -> None:
    found = pages.read(put(tmp_path / "a.html", "fem-reference study </script>"))
    assert found is not None
    assert (found.title, found.headlines, found.asked) == (
        "A <title>",
        (("", "pass", "well"),),
        "fem-reference study </script>",
    )
    assert re.fullmatch(r"\d{4}-\d\d-\d\d \d\d:\d\d", found.made)
    text = (tmp_path / "a.html").read_text()
    assert "<code>fem-reference study &lt;/script&gt;</code>" in text
    assert "<!--" not in text
    # What a program wrote has no command and no time.
    assert pages.read(put(tmp_path / "b.html")).made == ""


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"\xff\x00",
        b"<h1>mine</h1>",
        b'<script type="application/json" id="page-facts">{"kind": 1}</script>',
        b'<script type="application/json" id="page-facts">[[[',
        b'<script type="application/json" id="page-facts">{"kind": "a", "title": "b", "headlines": [[1, 2, 3]]}</script>',
        b'<script type="application/json" id="page-facts">{"kind": "a", "title": "b", "headlines": "abc"}</script>',
        b'<script type="application/json" id="page-facts">' + b"[" * 100_000 + b"</script>",
    ],
    ids=range(8),
)
def test_what_is_no_page_of_ours_is_none_and_breaks_no_index(tmp_path: Path, text: bytes) -> None:
    (tmp_path / "mine.html").write_bytes(text)
    assert pages.read(tmp_path / "mine.html") is None
    write_index(tmp_path)
    found = (tmp_path / "index.html").read_text()
    assert '<li><a href="mine.html">mine.html</a></li>' in found
    # Nor is it written over.
    assert pages.free(lambda name: tmp_path / f"{name}.html", "mine", "")[0] == "mine-2"


def test_a_page_is_written_over_by_the_same_command_alone(tmp_path: Path) -> None:
    def where(name: str) -> Path:
        return tmp_path / f"{name}.html"

    assert pages.free(where, "a", "one") == ("a", "")
    put(where("a"), "one")
    name, note = pages.free(where, "a", "one")
    assert (name, note[:39]) == ("a", "replaces the page that the same command")
    assert pages.free(where, "a", "other") == ("a-2", f"{where('a')} was made by another command and is kept")
    put(where("a-2"), "other")
    assert pages.free(where, "a", "other")[0] == "a-2"
    assert pages.free(where, "a", "third")[0] == "a-3"


def test_a_pipe_is_no_page(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.html")
    assert pages.read(tmp_path / "a.html") is None


def test_the_small_picture_is_the_first_that_can_be_read() -> None:
    assert pages.small_picture('<img src="data:image/webp;base64,AAAA">') == ""


def test_nothing_is_written_when_the_page_cannot_be_made(tmp_path: Path) -> None:
    empty = pages.Page("index", "Pages", (), "index_page.html", {}, numbers=[1], rows="a,b")
    with pytest.raises(UndefinedError):
        pages.write(empty, tmp_path / "out", "page")
    with pytest.raises(ValueError, match="JSON"):
        pages.write(
            replace(empty, contents={"entries": (), "others": ()}, numbers=float("nan")), tmp_path / "out", "page"
        )
    assert not (tmp_path / "out").exists()


def test_numbers_stand_beside_the_page_under_its_name_or_their_own(tmp_path: Path) -> None:
    made = pages.Page("index", "Pages", (), "index_page.html", {"entries": (), "others": ()}, numbers=[1], rows="a,b")
    assert pages.write(made, tmp_path / "one", "page") == tmp_path / "one" / "page.html"
    pages.write(replace(made, numbers_name="measures"), tmp_path / "two", "page")
    names = [sorted(path.name for path in (tmp_path / name).iterdir()) for name in ("one", "two")]
    assert names == [["page.csv", "page.html", "page.json"], ["measures.csv", "measures.json", "page.html"]]
    assert json.loads((tmp_path / "two" / "measures.json").read_text()) == [1]


def test_contents_are_escaped() -> None:
    text = template("index_page.html").render(CONTENTS)
    assert "<title>A &lt;title&gt;</title>" in text
    assert '<a href="a&amp;b.html">' in text


def test_a_missing_name_and_a_missing_template_are_errors() -> None:
    with pytest.raises(UndefinedError, match="others"):
        template("index_page.html").render({name: CONTENTS[name] for name in ("title", "entries")})
    with pytest.raises(TemplateNotFound):
        template("nowhere.html")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (float("nan"), "mm", '<span class="bad">not a number</span>'),
        (None, "", "\N{EN DASH}"),
        (2.5, "mm3", '2.50&#8239;<span class="unit">mm³</span>'),
        (2.5, "1", "2.50"),
    ],
)
def test_a_number_stands_with_its_unit(value, unit, text) -> None:
    assert str(template("measured.html").module.figure_of(value, unit)).strip() == text
    known = str(template("measured.html").module.if_known(value, unit)).strip()
    assert known == ("\N{EN DASH}" if value is None or value != value else text)
