"""Sections of the page of a comparison: one file each, found by their folder, with its template beside it.

A file has one ``SECTION``, and the template of its name ends in a ``<section>`` of HTML. Contract (tests/report/test_page.py): it
is shown where its numbers exist and absent where they do not, and repeats no id.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fem_reference.assessment.comparison import Comparison


@dataclass(frozen=True)
class Section:
    """A section of the page, the smaller its ``order`` the higher it stands.

    ``facts`` of a comparison are what its template is filled with, beside what all templates are filled with (``page``).
    ``needs``: those of the comparison's attributes without which it has nothing to show. ``of_reference``: whether it shows numbers
    of the reference or against it, which are none where that reached no frame.
    """

    order: int
    facts: Callable[[Comparison], dict[str, Any]]
    needs: tuple[str, ...] = ()
    of_reference: bool = True

    def has_numbers(self, comparison: Comparison) -> bool:
        """Whether there is something to show."""
        return all(getattr(comparison, name) for name in self.needs)


def sections() -> dict[str, Section]:
    """The sections there are by their names, from top to bottom; TypeError where a file has none."""
    found = dict[str, Section]()
    for name in (module.name for module in pkgutil.iter_modules(__path__)):
        section = vars(importlib.import_module(f"{__name__}.{name}")).get("SECTION")
        if not isinstance(section, Section):
            raise TypeError(f"report/sections/{name}: SECTION is {section!r}, want a Section")
        found[name] = section
    return dict(sorted(found.items(), key=lambda item: (item[1].order, item[0])))
