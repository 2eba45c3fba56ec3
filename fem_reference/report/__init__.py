"""Self-contained pages, with their numbers also as JSON and CSV. The results are computed in other packages.

Each kind of page has a module, whose function ``page`` makes the record that :func:`write` writes.
"""

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.pages import Page, write
from fem_reference.report.tables import summary

NAME = "report"  # the name of the page of a comparison, which has its own folder
__all__ = ["NAME", "Page", "of_comparison", "summary", "write"]


def of_comparison(comparison: Comparison) -> Page:
    """The page of a comparison of any kind; its numbers are written to ``measures.json`` and ``measures.csv``."""
    from fem_reference.report import comparison_page, field_page  # both load matplotlib, which most verbs do not need

    of_field = "field" in comparison.reference.carries
    return field_page.comparison_page(comparison) if of_field else comparison_page.page(comparison)
