"""The index of all pages in a folder, read from the head of each."""

import logging
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from fem_reference.report import pages
from fem_reference.report.pages import Page, PageHead

log = logging.getLogger(__name__)

NAME, KIND = "index", "index"
# Files below a folder here that are no pages of ours and yet may be looked for.
_OTHERS = ("report.html", "index.html")


@dataclass(frozen=True)
class IndexEntry:
    """A page: its ``name`` here, its address from here, when it was ``made``, and its ``head``."""

    name: str
    address: str
    made: str
    head: PageHead


def write(folder: Path) -> None:
    """Write ``index.html`` of the pages in ``folder``, unless a file of that name exists that is not such an index."""
    path = folder / f"{NAME}.html"
    there = pages.read(path)
    if path.exists() and (there is None or there.kind != KIND):
        log.info("no index: %s is no index of fem_reference, and stays as it is", path)
        return
    pages.write(page(*entries_of(folder)), folder, NAME)


def page(entries: list[IndexEntry], others: list[str]) -> Page:
    """The page of ``entries``, and of the addresses of ``others`` that may be pages."""
    said = (("", "", f"{len(entries)} pages"),)
    return Page(KIND, "Pages", said, "index_page.html", {"entries": entries, "others": others})


def entries_of(folder: Path) -> tuple[list[IndexEntry], list[str]]:
    """The pages in ``folder`` and the folders in it, the newest first, and the addresses of other files that may be pages."""
    entries, others = [], []
    for path in sorted({*folder.glob("*.html"), *folder.glob("*/*.html")}):
        head, address = pages.read(path), path.relative_to(folder).as_posix()
        if head is None and (path.parent == folder or path.name in _OTHERS):
            others.append(quote(address))
        elif head is not None and head.kind != KIND:
            name = address.removesuffix(".html").removesuffix("/report")
            entries.append(IndexEntry(name, quote(address), head.made or _changed(path), head))
    entries.sort(key=lambda one: (one.made, one.name), reverse=True)
    return entries, [address for address in others if address != f"{NAME}.html"]


def _changed(path: Path) -> str:
    """The time when a file was changed last; empty where it was removed since it was listed."""
    try:
        seconds = path.stat().st_mtime
    except OSError:
        return ""
    return datetime.fromtimestamp(seconds, UTC).astimezone().strftime("%Y-%m-%d %H:%M")
