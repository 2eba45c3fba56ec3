"""The index of all pages in a folder, read from what each says of itself."""

import logging
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from fem_reference.io import files
from fem_reference.report import pages
from fem_reference.report.pages import About
from fem_reference.report.templates import template

log = logging.getLogger(__name__)

NAME, KIND = "index", "index"
# Files below a folder here that are no pages of ours and yet may be looked for.
_OTHERS = ("report.html", "index.html")


@dataclass(frozen=True)
class Entry:
    """A page: its ``name`` here, its address from here, when it was ``made``, and what it says of itself."""

    name: str
    address: str
    made: str
    about: About


def write(folder: Path) -> None:
    """Write ``index.html`` of the pages in ``folder``, unless a file of that name is there that is no index of ours."""
    files.make_folder(folder)
    path = folder / f"{NAME}.html"
    there = pages.read(path)
    if path.exists() and (there is None or there.kind != KIND):
        log.info("no index: %s is no index of fem_reference, and stays as it is", path)
        return
    entries, others = entries_of(folder)
    text = template("index_page.html").render(entries=entries, others=others)
    files.write_text(path, pages.stamped(text, About(KIND, "Pages", (("", "", f"{len(entries)} pages"),))))


def entries_of(folder: Path) -> tuple[list[Entry], list[str]]:
    """The pages in ``folder`` and the folders in it, the newest first, and the addresses of other files that may be pages."""
    entries, others = [], []
    for path in sorted({*folder.glob("*.html"), *folder.glob("*/*.html")}):
        about, address = pages.read(path), path.relative_to(folder).as_posix()
        if about is None and (path.parent == folder or path.name in _OTHERS):
            others.append(quote(address))
        elif about is not None and about.kind != KIND:
            name = address.removesuffix(".html").removesuffix("/report")
            entries.append(Entry(name, quote(address), about.made or _changed(path), about))
    return sorted(entries, key=lambda one: (one.made, one.name), reverse=True), [
        address for address in others if address != f"{NAME}.html"
    ]


def _changed(path: Path) -> str:
    """When a file was changed last."""
    try:
        seconds = path.stat().st_mtime
    except OSError:  # removed since it was listed
        return ""
    return datetime.fromtimestamp(seconds, UTC).astimezone().strftime("%Y-%m-%d %H:%M")
