"""Small pages that tests of their heads share."""

from pathlib import Path

from fem_reference.report import pages
from fem_reference.report.pages import Headlines, Page

SAID = (("", "pass", "well"),)
NOTHING = {"entries": (), "others": ()}


def put(
    path: Path, asked: str = "", kind: str = "study", title: str = "A <title>", headlines: Headlines = SAID
) -> Path:
    """Write a page without contents to ``path``, as one that was ``asked`` for."""
    return pages.write(Page(kind, title, headlines, "index_page.html", NOTHING), path.parent, path.stem, asked)
