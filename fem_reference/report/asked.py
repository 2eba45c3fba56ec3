"""Pages requested by a command: their names, which state what makes each different, and the index of pages."""

import hashlib
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from fem_reference.report import index_page, pages
from fem_reference.report.pages import Page

LONGEST = 100  # characters of the name of a page


@dataclass(frozen=True)
class Part:
    """Words of a command line that determine what it computes, and what they add to the default name of its page."""

    words: tuple[str, ...]
    name: str = ""


@dataclass(frozen=True)
class Asked:
    """A page as a command requests it: the ``verb``, the ``base`` of its default name, what determines it, and the name in its
    folder, empty where it has no folder of its own.
    """

    verb: str
    base: str
    parts: tuple[Part, ...] = ()
    page: str = ""

    @property
    def command(self) -> str:
        """The command line that makes it, without options that change no number on it."""
        return shlex.join(["fem-reference", self.verb, *(word for part in self.parts for word in part.words)])

    @property
    def name(self) -> str:
        """The default name."""
        text = "-".join([self.base, *(_plain(part.name) for part in self.parts if part.name)])
        end = f"-{hashlib.sha256(text.encode()).hexdigest()[:8]}"
        return text if len(text) <= LONGEST else text[: LONGEST - len(end)] + end


def _plain(text: str) -> str:
    """A text as it may stand in the name of a file.

    >>> _plain("muscle.tet_size=8 mm"), _plain("effect[0].mu=1 kPa")
    ('muscle.tet_size=8mm', 'effect0.mu=1kPa')
    """
    return re.sub(r"[^\w.=+-]+", "_", re.sub(r"[\s\[\]]+", "", text))


def written(asked: Asked, page: Page, folder: Path, name: str | None = None) -> tuple[Path, list[str]]:
    """Write a page, as ``name`` where that is given, and the index, where nothing else is lost; its path and what is printed."""

    def where(name: str) -> Path:
        return folder / name / f"{asked.page}.html" if asked.page else folder / f"{name}.html"

    name, note = pages.free(where, name or asked.name, asked.command)
    parent, file = (folder / name, asked.page) if asked.page else (folder, name)
    path = pages.write(page, parent, file, asked.command)
    notes = [note] if note else []
    try:
        index_page.write(folder)
    except OSError as error:  # the page is there, and worth more than its index
        notes.append(f"no index: {error}")
    return path, [f"page: {path}", *(f"  {line}" for line in notes)]
