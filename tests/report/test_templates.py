"""Templates: what fills them is escaped, and a name that they lack is an error."""

import jinja2
import pytest

from fem_reference.report.templates import template

CONTENTS = {"title": "A <title>", "entries": (), "others": ("a&b.html",)}


def test_contents_are_escaped() -> None:
    text = template("index_page.html").render(CONTENTS)
    assert "<title>A &lt;title&gt;</title>" in text
    assert '<a href="a&amp;b.html">' in text


def test_a_missing_name_and_a_missing_template_are_errors() -> None:
    with pytest.raises(jinja2.UndefinedError, match="others"):
        template("index_page.html").render({name: CONTENTS[name] for name in ("title", "entries")})
    with pytest.raises(jinja2.TemplateNotFound):
        template("nowhere.html")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (float("nan"), "mm", '<span class="bad">not a number</span>'),
        (None, "", "\N{EN DASH}"),
        (2.5, "mm3", '2.50&#8239;<span class="unit">mm³</span>'),
        (2.5, "1", "2.50"),
    ],
)
def test_a_number_stands_with_its_unit(value, unit, text) -> None:
    assert str(template("measured.html").module.figure_of(value, unit)).strip() == text
    known = str(template("measured.html").module.if_known(value, unit)).strip()
    assert known == ("\N{EN DASH}" if value is None or value != value else text)
