"""TOML, JSON and XML from untrusted files, with bounds on size and depth, so that reading always ends.

A file is rejected if it cannot be parsed, is too large, is nested too deeply, or refers to files outside its folder.
"""

import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from fem_reference.foundations.errors import InputError

# The maximum size of a file in bytes. A case file has a few kB, a baseline 1.3 kB per frame. In memory a file takes up to 30 times
# its size.
MOST_TOML = 2**21
MOST_JSON = 2**25
# The maximum number of levels of nested tables and lists; case files have up to 6.
DEEPEST = 32
# A mesh file must not define entities, which can multiply a text a billion times or include other files.
_FORBIDDEN = (b"<!DOCTYPE", b"<!ENTITY")
# The parts of a TOML text that are not keys: strings of all four kinds, and comments.
_NO_KEYS = re.compile(r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*', re.DOTALL)
# The time to read a dotted key grows with the square of the number of its parts, so long keys are rejected.
_LONG_KEY = re.compile(rf"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++){{{DEEPEST},}}")


def toml(path: Path) -> dict[str, Any]:
    """The table in a TOML file."""
    want = "a TOML file"
    return parse_toml(_text(path, MOST_TOML, want), path, want)


def parse_toml(text: str, place: object, want: str = "TOML") -> dict[str, Any]:
    """The table in a TOML ``text``. An InputError names the ``place``."""
    if (long := _LONG_KEY.search(_NO_KEYS.sub("_", text))) is not None:
        raise InputError(place, f'the key "{long[0]}"', f"{want} with keys of at most {DEEPEST} parts")
    table: dict[str, Any] = _parsed(tomllib.loads, text, place, want)
    return table


def toml_text(text: str) -> str:
    r"""The ``text`` as a basic string of TOML: the escapes of JSON are valid in it, but the character DEL must be escaped too.

    >>> print(toml_text('a "b"'))
    "a \"b\""
    """
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def read_json(path: Path, want: str) -> Any:
    """The value in a JSON file. Raises InputError with ``want`` for any other file, and for a file with NaN or Infinity."""
    return _parsed(partial(json.loads, parse_constant=_no_number), _text(path, MOST_JSON, want), path, want)


def parsed_xml(path: Path) -> ElementTree.Element:
    """The root of an XML file. Raises ValueError if the file defines entities."""
    text = path.read_bytes()
    check_no_entities(text)
    return ElementTree.fromstring(text)


def check_no_entities(text: bytes) -> None:
    """Raise ValueError if an XML text declares a document type or entities."""
    if any(one in text for one in _FORBIDDEN):
        raise ValueError("a document type, which no mesh file needs")


def beside(path: Path, name: str) -> Path:
    """The file ``name`` to which the file at ``path`` refers. Raises ValueError if ``name`` is outside the folder of that file."""
    found = path.parent / name
    if not found.resolve().is_relative_to(path.parent.resolve()):
        raise ValueError(f'a reference to "{name}", outside the folder of the file')
    return found


def finite(value: float) -> float | None:
    """The ``value`` for JSON: None if it is not finite.

    >>> finite(2), finite(float("nan"))
    (2.0, None)
    """
    return float(value) if math.isfinite(value) else None


def plain(value: Any) -> Any:
    """The ``value`` as valid JSON: records become tables, arrays and tuples become lists, and numbers that are not finite become
    None.

    >>> plain({"error": float("nan"), "sizes": (2.0, 1)})
    {'error': None, 'sizes': [2.0, 1]}
    """
    if is_dataclass(value):
        value = vars(value)
    if isinstance(value, Mapping):
        return {key: plain(inside) for key, inside in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(inside) for inside in value]
    return finite(value) if isinstance(value, float) else value


def is_file(path: Path) -> bool:
    """True if the path is a file. False, without an error, if its name is too long for a file."""
    try:
        return path.is_file()
    except OSError:
        return False


def check_size(path: Path, most: int, want: str) -> None:
    """Raise InputError if a file has more than ``most`` bytes."""
    if (size := path.stat().st_size) > most:
        raise InputError(path, f"a file of {size / 2**20:.0f} MB", f"{want}, of at most {most / 2**20:.0f} MB")


def _text(path: Path, most: int, want: str) -> str:
    if not is_file(path):
        raise InputError(path, "no file", want)
    try:
        check_size(path, most, want)
        return path.read_text(encoding="utf-8-sig")  # some editors begin a file with a byte order mark
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, str(error), want) from error


def _no_number(name: str) -> float:
    raise ValueError(f"{name}, which is not a JSON number")


def _parsed(loads: Callable[[str], Any], text: str, place: object, want: str) -> Any:
    """The value that ``loads`` reads from a ``text``. Raises InputError if reading fails, or if the value is nested too deeply."""
    try:
        value = loads(text)
        level = [value]
        for _ in range(DEEPEST + 1):
            level = [inside for one in level for inside in _inside(one) if isinstance(inside, dict | list)]
            if not level:
                return value
    except RecursionError:
        pass
    except ValueError as error:
        raise InputError(place, str(error), want) from error
    raise InputError(place, f"tables or lists more than {DEEPEST} deep", want)


def _inside(value: Any) -> Any:
    return value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
