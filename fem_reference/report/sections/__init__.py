"""Sections of the page of a comparison: a template each, found by their folder.

A template begins with a comment that holds its ``Section`` as TOML, and ends in a ``<section>`` of HTML. A module beside it with
the same name, where it needs one, has the ``facts`` of a comparison that fill it besides those that all templates share
(``comparison_page``). Contract (tests/report/test_sections.py): it is shown where its numbers exist and absent where they do not,
and repeats no id.
"""

import importlib
import re
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, parse

FOLDER = Path(__file__).parent
_HEAD = re.compile(r"\{# (.*?) #\}\n")


class Section(Record):
    """A section of the page, the smaller its ``order`` the higher it stands.

    ``needs``: those of the comparison's attributes without which it has nothing to show. ``of_reference``: it shows numbers of the
    reference or against it, which are none where that reached no frame.
    """

    order: int
    needs: tuple[str, ...] = ()
    of_reference: bool = True

    def has_numbers(self, comparison: Comparison) -> bool:
        """True where there is something to show."""
        return all(getattr(comparison, name) for name in self.needs)


def sections(folder: Path = FOLDER) -> dict[str, Section]:
    """The sections in a ``folder`` by their names, from top to bottom; InputError where a template does not say what it is."""
    found = {path.stem: _section(path) for path in folder.glob("*.html")}
    return dict(sorted(found.items(), key=lambda item: (item[1].order, item[0])))


def facts_of(name: str, comparison: Comparison) -> dict[str, Any]:
    """The contents of a section's template that its own module has, where there is one."""
    module = f"{__name__}.{name}"
    return dict(importlib.import_module(module).facts(comparison)) if find_spec(module) else {}


def _section(path: Path) -> Section:
    head = _HEAD.match(path.read_text(encoding="utf-8"))
    try:
        return parse(Section, tomllib.loads(f"section = {{ {head[1]} }}")["section"] if head else {}, str(path))
    except tomllib.TOMLDecodeError as error:
        raise InputError(
            str(path), str(error), "a section's order, needs and of_reference in its first line"
        ) from error
