"""Pages have names that hold what makes them different, none is lost to another, and the index knows them all."""

import os
import re
from pathlib import Path

import pytest

from fem_reference.report import index_page, pages
from fem_reference.report.pages import About
from fem_reference.report.templates import template

TEXT = template("index_page.html").render(entries=[], others=[])


def about(asked: str = "", **more) -> About:
    return About(**{"kind": "study", "title": "A <title>", "headlines": (("", "pass", "well"),)} | more, asked=asked)


def put(path: Path, asked: str = "", **more) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(pages.stamped(TEXT, about(asked, **more)), encoding="utf-8")
    return path


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
    index_page.write(tmp_path)
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
    assert (name, note[:31]) == ("a", "written anew: the same command ")
    assert pages.free(where, "a", "other") == ("a-2", f"{where('a')} is of another command, and stays as it is")
    put(where("a-2"), "other")
    assert pages.free(where, "a", "other")[0] == "a-2"
    assert pages.free(where, "a", "third")[0] == "a-3"


def test_the_index_has_every_page_and_no_other_folder(tmp_path: Path) -> None:
    put(tmp_path / "verify.html", "verify", kind="verification", title="Verified")
    put(tmp_path / "a b" / "report.html", "compare", headlines=(("mine", "fail", "off <b>"), ("reference", "pass", "")))
    put(tmp_path / "runs" / "deep" / "report.html", "no")
    (tmp_path / "docs").mkdir()
    for name in ("index", "api"):
        (tmp_path / "docs" / f"{name}.html").write_text("docs")
    index_page.write(tmp_path)
    index_page.write(tmp_path)  # it does not list itself
    text = (tmp_path / "index.html").read_text()
    body = text[text.index("<tbody>") :]
    assert re.findall(r'<a href="([^"]*)">', body) == ["verify.html", "a%20b/report.html", "docs/index.html"]
    assert '<span class="badge fail">fail</span> <b>mine</b>: off &lt;b&gt;' in body
    assert "2 pages" in pages.read(tmp_path / "index.html").headlines[0][2]


def test_an_index_of_somebody_else_stays(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("my own site")
    put(tmp_path / "a.html", "a")
    index_page.write(tmp_path)
    assert (tmp_path / "index.html").read_text() == "my own site"


def test_a_pipe_is_no_page(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.html")
    assert pages.read(tmp_path / "a.html") is None


def test_a_picture_that_cannot_be_read_is_none(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(pages.stamped(TEXT + '<img src="data:image/webp;base64,AAAA">', about()), "utf-8")
    assert pages.read(tmp_path / "a.html").picture == ""
