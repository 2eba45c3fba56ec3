"""The README and the pages of the documentation as text, and what stands in them."""

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGES = {
    path.relative_to(ROOT).as_posix(): path for path in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")))
}


def page(name: str) -> str:
    """The text of a page."""
    return PAGES[name].read_text(encoding="utf-8")


def snippets(language: str) -> Iterator[tuple[str, str]]:
    """Every piece of code in a ``language`` with the name of its page."""
    for name in PAGES:
        yield from (
            (name, text) for text in re.findall(rf"^```{language}\n(.*?)^```", page(name), re.DOTALL | re.MULTILINE)
        )


def snippet(name: str, word: str) -> str:
    """The one piece of Python of the page ``name`` that has a ``word`` in it."""
    (found,) = (text for where, text in snippets("python") if where == name and word in text)
    return found
