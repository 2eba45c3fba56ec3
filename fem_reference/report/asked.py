"""Pages requested by a command: their names, which follow from its options, and the index of all pages in a folder."""

import hashlib
import logging
import re
import shlex
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from fem_reference.report import pages
from fem_reference.report.pages import Page, PageHead

log = logging.getLogger(__name__)

LONGEST = 100  # the maximum number of characters in the name of a page
INDEX = "index"  # the name of the index page, and its kind
# The names of other HTML files in subfolders that the index lists as well.
_OTHERS = ("report.html", "index.html")


@dataclass(frozen=True)
class Part:
    """Some ``words`` of a command line that affect its result, and the ``name`` that they add to the default name of the page."""

    words: tuple[str, ...]
    name: str = ""


@dataclass(frozen=True)
class Asked:
    """A page requested by a command: the ``verb``, the ``base`` of the default name, and the ``parts`` of the command line. If the
    page has a folder of its own, ``page`` is the name of its file there; otherwise it is empty.
    """

    verb: str
    base: str
    parts: tuple[Part, ...] = ()
    page: str = ""

    @property
    def command(self) -> str:
        """The command line that makes the page, without options that do not affect its numbers."""
        return shlex.join(["fem-reference", self.verb, *(word for part in self.parts for word in part.words)])

    @property
    def name(self) -> str:
        """The default name of the page."""
        text = "-".join([self.base, *(_plain(part.name) for part in self.parts if part.name)])
        end = f"-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
        return text if len(text) <= LONGEST else text[: LONGEST - len(end)] + end


def _plain(text: str) -> str:
    """The ``text`` without characters that file names cannot contain.

    >>> _plain("muscle.tet_size=8 mm"), _plain("effect[0].mu=1 kPa")
    ('muscle.tet_size=8mm', 'effect0.mu=1kPa')
    """
    return re.sub(r"[^\w.=+-]+", "_", re.sub(r"[\s\[\]]+", "", text))


def written(asked: Asked, page: Page, folder: Path, name: str | None = None) -> tuple[Path, list[str]]:
    """Write a page (under ``name``, if given) and the index, without overwriting other files. Return the path of the page, and
    messages.
    """

    def where(name: str) -> Path:
        return folder / name / f"{asked.page}.html" if asked.page else folder / f"{name}.html"

    name, note = pages.free(where, name or asked.name, asked.command)
    parent, file = (folder / name, asked.page) if asked.page else (folder, name)
    path = pages.write(page, parent, file, asked.command)
    notes = [note] if note else []
    try:
        write_index(folder)
    except OSError as error:  # the page has been written, which matters more than the index
        notes.append(f"no index: {error}")
    return path, [f"page: {path}", *(f"  {line}" for line in notes)]


@dataclass(frozen=True)
class IndexEntry:
    """A page: its ``name`` in the index, its relative address, the time when it was ``made``, and its ``head``."""

    name: str
    address: str
    made: str
    head: PageHead


def write_index(folder: Path) -> None:
    """Write the index of the pages in ``folder``, unless ``index.html`` exists and is not an index of this package."""
    path = folder / f"{INDEX}.html"
    there = pages.read(path)
    if path.exists() and (there is None or there.kind != INDEX):
        log.info("no index was written: %s is not an index made by fem_reference and is kept", path)
        return
    pages.write(index(*entries_of(folder)), folder, INDEX)


def index(entries: list[IndexEntry], others: list[str]) -> Page:
    """The index page of ``entries``, with the addresses of ``others``: files that may be pages."""
    said = (("", "", f"{len(entries)} pages"),)
    return Page(INDEX, "Pages", said, "index_page.html", {"entries": entries, "others": others})


def entries_of(folder: Path) -> tuple[list[IndexEntry], list[str]]:
    """The pages in ``folder`` and its subfolders, the newest first, and the addresses of other files that may be pages."""
    entries, others = [], []
    for path in sorted({*folder.glob("*.html"), *folder.glob("*/*.html")}):
        head, address = pages.read(path), path.relative_to(folder).as_posix()
        if head is None and (path.parent == folder or path.name in _OTHERS):
            others.append(quote(address))
        elif head is not None and head.kind != INDEX:
            name = address.removesuffix(".html").removesuffix("/report")
            entries.append(IndexEntry(name, quote(address), head.made or _changed(path), head))
    entries.sort(key=lambda one: (one.made, one.name), reverse=True)
    return entries, [address for address in others if address != f"{INDEX}.html"]


def _changed(path: Path) -> str:
    """The time of a file's last change; empty if it was removed in the meantime."""
    try:
        seconds = path.stat().st_mtime
    except OSError:
        return ""
    return datetime.fromtimestamp(seconds, UTC).astimezone().strftime("%Y-%m-%d %H:%M")
