"""What a page says of itself in its head: the index shows it, and a page is written over only by the command that made it."""

import base64
import io
import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from datetime import datetime
from html import escape
from itertools import count
from pathlib import Path

from PIL import Image

# Where the facts stand in the frame of all pages (base.html), and where the command that made it.
_FACTS, _ASKED = "<!-- facts of the page -->", "<!-- what was asked -->"
_BEGIN, _END = '<script type="application/json" id="page-facts">', "</script>"
_HEAD = 2**17  # bytes of a file within which they are looked for
_SIDE = 160  # of the small picture
_PICTURE = re.compile(r'src="data:image/webp;base64,([A-Za-z0-9+/=]+)"')


@dataclass(frozen=True)
class About:
    """The ``kind`` of a page, its ``title``, and what comes of it: by name a verdict (or none) and a sentence. ``asked``: the
    command that made it, empty for a page that a program wrote; ``made``: when; ``picture``: the source of a small one, if any.
    """

    kind: str
    title: str
    headlines: tuple[tuple[str, str, str], ...]
    asked: str = ""
    made: str = ""
    picture: str = ""


def stamped(text: str, about: About) -> str:
    """A page with its facts in its head, and above its title the command that made it."""
    about = replace(about, picture=_small(text))
    if about.asked:
        about = replace(about, made=datetime.now().astimezone().strftime("%Y-%m-%d %H:%M"))
    facts = json.dumps(asdict(about)).replace("<", "\\u003c")
    asked = f'<p class="note"><code>{escape(about.asked)}</code>, {about.made}</p>' if about.asked else ""
    return text.replace(_FACTS, _BEGIN + facts + _END, 1).replace(_ASKED, asked, 1)


def read(path: Path) -> About | None:
    """What the page at ``path`` says of itself; None where there is none of ours, or a damaged one."""
    if not path.is_file():  # a pipe would be waited for
        return None
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD).decode("utf-8", "ignore")
        facts = json.loads(head.partition(_BEGIN)[2].partition(_END)[0])
        found = About(**facts | {"headlines": tuple((name, word, said) for name, word, said in facts["headlines"])})
    except (OSError, ValueError, TypeError, KeyError, RecursionError):
        return None
    plain = (found.kind, found.title, found.asked, found.made, found.picture, *sum(found.headlines, ()))
    return found if all(isinstance(one, str) for one in plain) else None


def free(where: Callable[[str], Path], name: str, asked: str) -> tuple[str, str]:
    """The ``name``, or with a number the first of it whose page, ``where(name)``, is not there or was made by the same command;
    and a line that says so, empty where nothing was there.
    """
    for i in count(1):
        numbered = name if i == 1 else f"{name}-{i}"
        path = where(numbered)
        if not path.exists():
            return numbered, "" if i == 1 else f"{where(name)} is of another command, and stays as it is"
        about = read(path)
        if about is not None and about.asked == asked:
            return numbered, f"written anew: the same command made this page on {about.made}"
    raise AssertionError("numbers do not end")


def _small(text: str) -> str:
    """The first picture of a page in small, none where it has none that can be read."""
    found = _PICTURE.search(text)
    if found is None:
        return ""
    try:
        with Image.open(io.BytesIO(base64.b64decode(found[1]))) as picture:
            small, stored = picture.convert("RGB"), io.BytesIO()
            small.thumbnail((_SIDE, _SIDE))
            small.save(stored, "WEBP", quality=75, method=4)
    except (OSError, ValueError):
        return ""
    return f"data:image/webp;base64,{base64.b64encode(stored.getvalue()).decode()}"
