"""Pages: their record, their templates and their files. The head of each file describes the page for the index.

A page is overwritten only by the command that made it.
"""

import base64
import io
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from datetime import datetime
from functools import cache
from html import escape
from itertools import count
from pathlib import Path
from typing import Any

import jinja2
from PIL import Image
from pydantic import TypeAdapter

from fem_reference.foundations.markup import exact
from fem_reference.io import files
from fem_reference.metrics import find
from fem_reference.report import gallery
from fem_reference.report.embedded import webp
from fem_reference.report.words import duration, listed, number, ratio, title_of, words

# Placeholders in the template of all pages (base.html) for the facts and for the command that made the page.
_FACTS, _ASKED = "<!-- facts of the page -->", "<!-- what was asked -->"
_BEGIN, _END = '<script type="application/json" id="page-facts">', "</script>"
_HEAD = 2**17  # the number of bytes at the beginning of a file that are searched for the facts
_SIDE = 160  # the maximum width and height of the thumbnail [pixels]
_PICTURE = re.compile(r'src="data:image/webp;base64,([A-Za-z0-9+/=]+)"')
Headlines = tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, eq=False)
class Page:
    """The ``kind`` of a page, its ``title``, and its ``headlines``, each with a name, a verdict (may be empty) and a sentence.

    ``contents`` fill the ``template`` of the page. ``numbers`` are written next to the page as JSON, and ``rows`` as CSV, if they
    are given. The name of these files is ``numbers_name``, by default the name of the page.
    """

    kind: str
    title: str
    headlines: Headlines
    template: str
    contents: dict[str, Any]
    numbers: Any = None
    rows: str = ""
    numbers_name: str = ""

    def html(self) -> str:
        """The page as HTML, without the facts in its head."""
        return template(self.template).render(self.contents | {"title": self.title})


@dataclass(frozen=True)
class PageHead:
    """The facts in the head of a page: kind, title and headlines of its ``Page``; the command that ``asked`` for the page, empty if
    a program wrote it; the time when the page was ``made``; and the source of its thumbnail (``picture``), empty without one.
    """

    kind: str
    title: str
    headlines: Headlines
    asked: str = ""
    made: str = ""
    picture: str = ""


def write(page: Page, folder: Path, name: str, asked: str = "") -> Path:
    """Write the page ``name`` and its numbers into ``folder``; return its path.

    All contents are made before the first file is written, and each file is written completely or not at all.
    """
    beside = page.numbers_name or name
    texts = {} if page.numbers is None else {f"{beside}.json": json.dumps(page.numbers, indent=1, allow_nan=False)}
    texts |= {f"{beside}.csv": page.rows} if page.rows else {}
    texts[f"{name}.html"] = stamped(page, asked)
    files.make_folder(folder)
    for file, text in texts.items():
        files.write_text(folder / file, text)
    return folder / f"{name}.html"


def stamped(page: Page, asked: str = "") -> str:
    """The page as HTML, with the facts in its head and, above the title, the command that made it."""
    text = page.html()
    made = datetime.now().astimezone().strftime("%Y-%m-%d %H:%M") if asked else ""
    head = PageHead(page.kind, page.title, page.headlines, asked, made, small_picture(text))
    facts = json.dumps(asdict(head)).replace("<", "\\u003c")
    command = f'<p class="note"><code>{escape(asked)}</code>, {made}</p>' if asked else ""
    return text.replace(_FACTS, _BEGIN + facts + _END, 1).replace(_ASKED, command, 1)


def read(path: Path) -> PageHead | None:
    """The head of the page at ``path``; None if the file is not a page of this package or is damaged."""
    if not path.is_file():  # reading a pipe would block
        return None
    try:
        with path.open("rb") as file:
            text = file.read(_HEAD).decode("utf-8", "ignore")
        return TypeAdapter(PageHead).validate_json(text.partition(_BEGIN)[2].partition(_END)[0])
    except (OSError, ValueError):
        return None


def free(where: Callable[[str], Path], name: str, asked: str) -> tuple[str, str]:
    """A name for a page, and a line that reports an existing page (empty if there is none). The name is the first of ``name``,
    ``name-2``, ... for which the path ``where(name)`` is free or has a page that the same command made.
    """
    for i in count(1):
        numbered = name if i == 1 else f"{name}-{i}"
        path = where(numbered)
        if not path.exists():
            return numbered, "" if i == 1 else f"{where(name)} was made by another command and is kept"
        head = read(path)
        if head is not None and head.asked == asked:
            return numbered, f"replaces the page that the same command made on {head.made}"
    raise AssertionError("numbers do not end")


def small_picture(text: str) -> str:
    """The source of a thumbnail of the first picture of a page; empty if no picture can be read."""
    found = _PICTURE.search(text)
    if found is None:
        return ""
    try:
        with Image.open(io.BytesIO(base64.b64decode(found[1]))) as picture:
            small = picture.convert("RGBA")
            small.thumbnail((_SIDE, _SIDE))
            return webp(small, 75)
    except (OSError, ValueError):
        return ""


def by_name(*functions: Callable[..., Any]) -> dict[str, Callable[..., Any]]:
    """The ``functions`` by their own names, for a template."""
    return {one.__name__: one for one in functions}


def template(name: str) -> jinja2.Template:
    """The template in the file ``name`` next to this module. Its contents are escaped, and an undefined name is an error."""
    return _environment().get_template(name)


@cache
def _environment() -> jinja2.Environment:
    """The environment of the templates, which compiles each template at its first use."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals |= by_name(find, gallery.ramp, gallery.ticks, ratio, title_of, zip)
    environment.globals["greatest_distance"] = gallery.top
    environment.filters |= by_name(number, duration, exact, words, listed)
    return environment
