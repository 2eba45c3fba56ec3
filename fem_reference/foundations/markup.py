"""HTML tables that show records in a notebook, and text for values."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape


def fact_table(title: str, facts: Mapping[str, object]) -> str:
    """Format an HTML table of names and values below a ``title``; all of them are plain text.

    >>> fact_table("bar", {"status": "a < b"})
    '<b>bar</b><table><tr><th style="text-align:left">status</th><td style="text-align:left">a &lt; b</td></tr></table>'
    """
    left = ' style="text-align:left"'
    texts = ((escape(name), escape(str(value))) for name, value in facts.items())
    rows = (f"<tr><th{left}>{name}</th><td{left}>{value}</td></tr>" for name, value in texts)
    return f"<b>{escape(title)}</b><table>{''.join(rows)}</table>"


def table(title: str, heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Format an HTML table with column headings ``heads`` and ``rows`` below a ``title``; all of them are plain text."""
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    return f"<b>{escape(title)}</b><table><tr>{head}</tr>{body}</table>"


def exact(value: object) -> str:
    """Format a value as text, with up to 12 significant digits.

    >>> exact(0.123456), exact(True), exact("0.11.0"), exact(None), exact((0.0, -9810.0))
    ('0.123456', 'yes', '0.11.0', 'not set', '(0, -9810)')
    """
    if value is None:
        return "not set"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, tuple):
        return f"({', '.join(exact(entry) for entry in value)})"
    return f"{value:.12g}" if isinstance(value, float) else str(value)
