"""The README is short, and what it and the pages link to is there; their tables and snippets are those of test_docs.py."""

import re
from pathlib import Path

import pages

LINES, COLUMNS = 130, 120
README = pages.page("README.md")


def test_it_is_short() -> None:
    lines = README.splitlines()
    assert len(lines) <= LINES
    assert not [line for line in lines if len(line) > COLUMNS]


def test_nothing_is_left_to_fill_in() -> None:
    assert "@@" not in README


def test_every_file_that_is_linked_is_there() -> None:
    home = Path(__file__).parents[2]
    for page in (home / "README.md", *(home / "docs").glob("*.md")):
        links = re.findall(r"\]\((?!https?:|#)([^)#]+)", page.read_text(encoding="utf-8"))
        assert not [link for link in links if not (page.parent / link).exists()], page
