"""Every kind of page in a browser: in light and dark colours, on a phone, printed, without a message and without a request."""

import base64
import re
from pathlib import Path
from typing import Any

import every_page
import numpy as np
import pytest
from browser import PROGRAM, Browser

from tests.report import comparisons

pytestmark = pytest.mark.slow

PHONE, DESK, SHEET = 390, 1280, 1032  # widths in pixels, the last of A4 on its side within margins

CHECKS = (Path(__file__).parents[1] / "page_checks.js").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if PROGRAM is None:
        pytest.skip("chromium is not installed: apt-get install chromium")
    with Browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> dict[str, Path]:
    """The path of a page of each kind."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("pages")
        found = comparisons.small_comparison(folder, patch)
        return every_page.write(folder / "reports", found, comparisons.alone(found))


@pytest.fixture(scope="module", params=every_page.KINDS)
def page(request, browser, written) -> Path:
    """The page of a kind, opened once for all tests that only look at it: pytest runs these together."""
    load(browser, written[request.param])
    return written[request.param]


def load(browser: Browser, path: Path) -> None:
    browser.open(path)
    browser.wait("document.readyState === 'complete'")
    browser.ask(CHECKS)
    browser.ask("checks.open()")


def show(browser: Browser, path: Path, width: int, **media: Any) -> None:
    browser.screen(width, **media)
    load(browser, path)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_it_is_legible_and_silent_at_a_desk_and_on_a_phone(browser, page, scheme) -> None:
    for width in (PHONE, DESK):
        browser.screen(width, scheme=scheme)
        assert browser.ask("document.documentElement.scrollWidth") <= width, browser.ask("checks.wide()")
        assert browser.ask("checks.pale()") == []
        browser.wait("!checks.unsaid().length")
        assert browser.complaints() == []
        assert [address for address in browser.requests() if not address.startswith(("data:", "blob:"))] == [
            page.resolve().as_uri()
        ]
    ground = [int(one) for one in re.findall(r"\d+", browser.ask("getComputedStyle(document.body).backgroundColor"))]
    assert (min(ground) > 200) == (scheme == "light")


@pytest.mark.usefixtures("page")
def test_printed_it_is_light_whole_and_without_controls(browser) -> None:
    browser.screen(SHEET, scheme="dark", media="print")
    assert browser.ask("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.ask("document.documentElement.scrollWidth") <= SHEET, browser.ask("checks.wide()")
    assert browser.ask("checks.cut()") == []
    assert browser.ask("checks.controls()") == []
    printed = base64.b64decode(browser.call("Page.printToPDF", printBackground=False, preferCSSPageSize=True)["data"])
    assert printed.startswith(b"%PDF-")
    assert browser.complaints() == []


def lightness(colour: str) -> float:
    """The relative luminance of ``#rrggbb`` by WCAG 2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


@pytest.mark.parametrize("kind", every_page.KINDS)
def test_what_a_drawing_draws_is_seen_on_dark_paper(written, kind) -> None:
    """A colour has another on dark paper, or stands out from it by 3 to 1."""
    text = written[kind].read_text(encoding="utf-8")
    root = re.findall(r":root \{(.*?)\}", text, re.DOTALL)[1]
    dark = dict(re.findall(r"--([\w-]+): (#\w{6})\b", root))
    for name, colour in set(re.findall(r"var\(--([\w-]+), (#\w{6})\)", text)):
        assert name in dark or (lightness(colour) + 0.05) / (lightness(dark["paper"]) + 0.05) > 3, (name, colour)


def shade(browser: Browser, element: str) -> float:
    """The mean difference of the right edge of an element from the paper beside its middle [of 255]."""
    strip = browser.picture(element)[:, -4:]
    return float(np.abs(strip - browser.picture(element)[:4, 200:204].mean(axis=(0, 1))).mean())


@pytest.mark.parametrize("kind", ["study", "verify", "effects", "ranking"])
def test_a_table_that_is_cut_shows_it(browser, written, kind) -> None:
    """A shadow at the edge where more is, and a line above it; neither where all is seen."""
    show(browser, written[kind], PHONE)
    browser.ask("[...document.querySelectorAll('.wide')].find(it => it.scrollWidth > it.clientWidth + 40).id = 'cut'")
    browser.wait("document.querySelector('#cut[tabindex]')")
    assert "scroll for more" in browser.ask("getComputedStyle(document.querySelector('#cut'), '::before').content")
    for scheme in ("light", "dark"):
        browser.screen(PHONE, scheme=scheme)
        browser.ask("document.querySelector('#cut').scrollLeft = 0")
        before = shade(browser, "#cut")
        browser.ask("document.querySelector('#cut').scrollLeft = 1e6")
        assert before > shade(browser, "#cut") + 10
    browser.screen(2600)
    browser.wait(
        "[...document.querySelectorAll('.wide')].every(it => it.hasAttribute('tabindex') === it.scrollWidth > it.clientWidth)"
    )
    # The widest tables of the study are cut on any screen, as the page is not as wide as this one.
    assert browser.ask("document.querySelector('.wide[tabindex]') !== null") == (kind == "study")


# Pairs of words of one drawing whose boxes share more than 2 pixels in both directions.
OVERPRINTED = """[...document.querySelectorAll('svg')].flatMap(svg => {
  const words = [...svg.querySelectorAll('text')].filter(it => it.textContent.trim());
  const boxes = words.map(it => it.getBoundingClientRect());
  return boxes.flatMap((a, i) => boxes.slice(i + 1).flatMap((b, j) =>
    Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2 && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2
      ? [words[i].textContent + ' | ' + words[i + 1 + j].textContent] : []));
})"""


@pytest.mark.usefixtures("page")
def test_words_of_a_drawing_do_not_lie_on_each_other(browser) -> None:
    browser.screen(DESK, scheme="light")
    assert browser.ask(OVERPRINTED) == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_names_in_three_dimensions_are_seen(browser, written, scheme) -> None:
    show(browser, written["comparison"], DESK, scheme=scheme)
    browser.ask("document.querySelector('.viewer-stage').scrollIntoView()")
    browser.wait("document.querySelector('.viewer-label b')?.textContent")
    colours = browser.ask("[...document.querySelectorAll('.viewer-label b')].map(it => getComputedStyle(it).color)")
    for colour in colours:
        ink = [int(one) for one in re.findall(r"\d+", colour)]
        assert (min(ink) > 150) if scheme == "dark" else (max(ink) < 100)


def rows(browser: Browser, table: str) -> list[str]:
    return browser.ask(
        f"[...document.querySelector('{table}').tBodies[0].rows].map(row => row.cells[0].innerText.trim())"
    )


def test_a_table_sorts_by_the_keyboard_as_by_a_click(browser, written) -> None:
    show(browser, written["comparison"], DESK)
    assert rows(browser, ".first") == ["quick\npbd", "torn\nrecorded"]
    head = "document.querySelector('.first thead tr:last-child th:nth-child(6)')"
    assert browser.ask(f"{head}.getAttribute('aria-sort')") is None
    browser.ask(f"{head}.querySelector('button').focus()")
    browser.press("Enter")
    assert browser.ask(f"{head}.getAttribute('aria-sort')") == "ascending"
    assert rows(browser, ".first") == ["quick\npbd", "torn\nrecorded"]  # what is not a number comes last, whichever way
    browser.press("Enter")
    assert browser.ask(f"{head}.getAttribute('aria-sort')") == "descending"
    assert rows(browser, ".first") == ["quick\npbd", "torn\nrecorded"]
    browser.ask("document.querySelector('.first thead tr:last-child button').click()")
    browser.ask("document.querySelector('.first thead tr:last-child button').click()")
    assert rows(browser, ".first") == ["torn\nrecorded", "quick\npbd"]
    assert browser.ask("document.querySelectorAll('.first [aria-sort]').length") == 1


def test_rows_that_belong_together_stay_together(browser, written) -> None:
    show(browser, written["verify"], DESK)
    error = "[...document.querySelectorAll('table thead button')].find(it => it.innerText.startsWith('Error')).click()"
    for _ in range(2):
        browser.ask(error)
    names = "[...document.querySelectorAll('tr.first')].map(row => row.id)"
    assert browser.ask(names) == ["a_name_that_is_long_enough_to_wrap", "rod", "bar"]
    assert browser.ask(
        "[...document.querySelectorAll('tr.first')].every(row => row.nextElementSibling.className === 'more')"
    )


@pytest.mark.parametrize(
    ("cells", "sorted_cells"),
    [
        ("2 s|300 ms|\N{EN DASH}|1 min", "300 ms|2 s|1 min|\N{EN DASH}"),
        (
            "\N{MINUS SIGN}3|1.2 \N{MULTIPLICATION SIGN} 10⁻⁵|12\N{NARROW NO-BREAK SPACE}034|not a number|0.5 mm",
            "\N{MINUS SIGN}3|1.2 \N{MULTIPLICATION SIGN} 10⁻⁵|0.5 mm|12\N{NARROW NO-BREAK SPACE}034|not a number",
        ),
        ("b||a", "a|b|"),
    ],
)
def test_numbers_sort_as_numbers_with_their_units(browser, written, tmp_path, cells, sorted_cells) -> None:
    text = written["verify"].read_text(encoding="utf-8")
    body = "".join(f"<tr><td>{one}</td></tr>" for one in cells.split("|"))
    table = f"<table id='t'><thead><tr><th>x</th></tr></thead><tbody>{body}</tbody></table>"
    (tmp_path / "t.html").write_text(text.replace("<header>", f"{table}<header>", 1), encoding="utf-8")
    show(browser, tmp_path / "t.html", DESK)
    browser.ask("document.querySelector('#t button').click()")
    assert rows(browser, "#t") == sorted_cells.split("|")
