"""The index knows every page in a folder, and writes over no file of somebody else."""

import re
from pathlib import Path

from fem_reference.report import index_page, pages
from tests.report.stamped import put


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
