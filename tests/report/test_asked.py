"""Pages have names that hold what makes them different, and none is lost to another; the index knows every page in a folder."""

import re
from pathlib import Path

import pytest
import small
import stand_ins

from fem_reference import cli
from fem_reference.cli import demo
from fem_reference.report import asked as asking
from fem_reference.report import pages
from fem_reference.report.asked import LONGEST, Asked, Part, write_index, written
from fem_reference.report.pages import Page
from fem_reference.solvers import fenicsx, pbd
from tests.report import test_headline
from tests.report.stamped import put

EMPTY = Page("study", "A title", (), "index_page.html", {"entries": (), "others": ()})


def test_the_name_holds_what_makes_the_page_different_and_ends_somewhere() -> None:
    parts = (
        Part(("bar",)),
        Part(("--set", "muscle.tet_size=8 mm"), "muscle.tet_size=8 mm"),
        Part(("--candidate", "x"), "x"),
    )
    asked = Asked("compare", "bar", parts, "report")
    assert asked.name == "bar-muscle.tet_size=8mm-x"
    assert asked.command == "fem-reference compare bar --set 'muscle.tet_size=8 mm' --candidate x"
    long, other = (Asked("compare", "bar", (Part((), "long" * 40), Part((), last)), "report").name for last in "ab")
    assert len(long) == LONGEST
    assert long != other


def test_where_the_index_cannot_be_written_the_page_is(tmp_path: Path, monkeypatch) -> None:
    def refuse(_: Path) -> None:
        raise OSError("no room")

    monkeypatch.setattr(asking, "write_index", refuse)
    path, lines = written(Asked("study", "study"), EMPTY, tmp_path)
    assert path.is_file()
    assert lines == [f"page: {path}", "  no index: no room"]


def test_the_command_that_made_a_page_makes_it_anew(tmp_path: Path) -> None:
    asked = Asked("study", "study", ())
    assert written(asked, EMPTY, tmp_path) == (tmp_path / "study.html", [f"page: {tmp_path / 'study.html'}"])
    assert len(written(asked, EMPTY, tmp_path)[1]) == 2
    assert written(asked, EMPTY, tmp_path, "mine")[0] == tmp_path / "mine.html"


@pytest.mark.slow
@pytest.mark.usefixtures("without_pictures")
def test_runs_that_differ_leave_pages_beside_each_other(tmp_path: Path, monkeypatch, capsys) -> None:
    stand_ins.solve_by(monkeypatch, fenicsx, test_headline.still)
    stand_ins.unchecked(monkeypatch)
    stand_ins.solve_by(monkeypatch, pbd, test_headline.shift)
    case, out = small.write(tmp_path / "bar"), tmp_path / "out"
    common = [str(case), "--out", str(out), "--quiet"]

    def call(*words: str) -> list[str]:
        cli.main([words[0], *common, *words[1:]])
        return [line for line in capsys.readouterr().out.splitlines() if "page" in line]

    def page(name: str) -> str:
        return f"page: {out / name / 'report.html'}"

    assert call("compare") == [page("bar")]
    assert call("compare", "--limit", "volume.deviation=1 %")[0] == page("bar")
    assert call("run") == [page("bar-reference")]
    monkeypatch.setattr(demo, "MAIN_JOB", str(case))
    assert cli.main(["demo", "--out", str(out), "--quiet"]) == cli.DONE  # it is the same as to compare
    assert "replaces the page that the same command made" in capsys.readouterr().out
    assert call("compare", "--set", "frames.every=10") == [page("bar-frames.every=10")]
    assert call("run", "--negative-control") == [page("bar-negative_control-reference")]
    assert call("compare", "--name", "mine") == [page("mine")]
    assert call("run", "--name", "mine") == [page("mine-2")]
    text = (out / "index.html").read_text()
    names = re.findall(r'<a href="([^"]*)">', text)
    assert len(names) == 6
    assert (out / "bar" / "measures.json").is_file()
    for bad in ("runs", "a/b", "", "x" * 101):
        assert cli.main(["compare", *common, "--name", bad]) == cli.BAD_INPUT
        assert "--name" in capsys.readouterr().err


def test_the_index_has_every_page_and_no_other_folder(tmp_path: Path) -> None:
    put(tmp_path / "verify.html", "verify", kind="verification", title="Verified")
    put(tmp_path / "a b" / "report.html", "compare", headlines=(("mine", "fail", "off <b>"), ("reference", "pass", "")))
    put(tmp_path / "runs" / "deep" / "report.html", "no")
    (tmp_path / "docs").mkdir()
    for name in ("index", "api"):
        (tmp_path / "docs" / f"{name}.html").write_text("docs")
    write_index(tmp_path)
    write_index(tmp_path)  # it does not list itself
    text = (tmp_path / "index.html").read_text()
    body = text[text.index("<tbody>") :]
    assert re.findall(r'<a href="([^"]*)">', body) == ["verify.html", "a%20b/report.html", "docs/index.html"]
    assert '<span class="badge fail">fail</span> <b>mine</b>: off &lt;b&gt;' in body
    assert "2 pages" in pages.read(tmp_path / "index.html").headlines[0][2]


def test_an_index_of_somebody_else_stays(tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("my own site")
    put(tmp_path / "a.html", "a")
    write_index(tmp_path)
    assert (tmp_path / "index.html").read_text() == "my own site"
