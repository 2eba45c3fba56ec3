"""Bytes, numbers, trees of tables and lists, damaged at random."""

import copy
import json
import math
import re
import tomllib
from typing import Any

from hypothesis import strategies as st

# What no sensible file has.
NASTY: list[Any] = [0, -1, 1, 2**31, 2**63, 2**64, -(2**63) - 1, 10**400, "9" * 5000]
NASTY += [0.0, -0.0, 1e-320, 1e300, -1e300, math.inf, math.nan, True, None, "", " ", ".", ".."]
NASTY += ["x" * 5000, "\0", "\x1b[31m", "a\nb", "<script>alert(1)</script>", "&amp;", "\u202e", "\ud800"]
NASTY += ["../../../../etc/passwd", "/etc/passwd", "data:../x", "mesh:../../x", "nan", "1e999", "1 mm"]
NASTY += ["1 mm^9^9^9", "-1 kPa", "1e300 kPa", "1e-300 mm", "9**9**9", "1 " + "(" * 90, "2 kPa kPa"]
NASTY += ["1 mm" * 30, "0, 0, 0 mm", "nan, 0, 0 mm", "1e9 mm", "x**x**x", "1/0", "(" * 300, "%", "1 %"]
NASTY += [[], {}, [[]], [0] * 1000, {"a": {"b": {"c": 1}}}, [None], ["x"], [[0, 1], [2]], "fenicsx", "pbd"]
NUMBERS_IN_TEXT = [b"0", b"-1", b"3", b"1e300", b"nan", b"inf", b"1e-320", b"", b"1e9", b"0x10", b"1_0", b"x"]
NUMBERS_IN_TEXT += [b"4294967295", b"18446744073709551615", b"99999999999999999999", b"9" * 5000, b"-4294967296"]
NUMBERS_IN_TEXT += [b"2147483648", b"1000000"]
# What no sensible text has.
PIECES = [b"", b"\xff" * 8, b"[" * 5000, b"a." * 3000 + b"a=1\n"]


def damage(data: bytes) -> st.SearchStrategy[bytes]:
    """The bytes of a file, damaged: as bytes, or, where it is one, as a text of numbers, or as a tree of tables and lists."""
    kinds = [_bytes(data), _bytes(data)]
    if re.search(rb"\d", data):
        kinds += [_numbers(data), _numbers(data)]
    for read, write in ((json.loads, _as_json), (tomllib.loads, _as_toml)):
        try:
            tree = read(data.decode())
        except ValueError:
            continue
        if isinstance(tree, dict):
            kinds += [tree_of(tree).map(write)] * 6
    return st.one_of(*kinds)


@st.composite
def _bytes(draw: Any, data: bytes) -> bytes:
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, len(data)))
        stop = min(len(data), start + draw(st.sampled_from([0, 1, 2, 8, 64, 10**6])))
        piece = draw(
            st.sampled_from(
                [b"", data[start:stop] * 2, b"\0" * (stop - start), b"\xff" * 8, b"[" * 5000, b"a." * 3000 + b"a=1\n"]
            )
        )
        data = data[:start] + draw(st.one_of(st.just(piece), st.binary(max_size=12))) + data[stop:]
    return data


@st.composite
def _numbers(draw: Any, data: bytes) -> bytes:
    for _ in range(draw(st.integers(1, 3))):
        found = list(re.finditer(rb"(?<![A-Za-z_])[-+]?\d[\d.]*(?:e[-+]?\d+)?", data))[:5000]
        if found:
            one = found[draw(st.integers(0, len(found) - 1))]
            data = data[: one.start()] + draw(st.sampled_from(NUMBERS_IN_TEXT)) + data[one.end() :]
    return data


@st.composite
def tree_of(draw: Any, tree: Any) -> Any:
    """A tree of tables and lists with one or two changes."""
    tree = json.loads(json.dumps(tree))
    for _ in range(draw(st.integers(1, 2))):
        inside: Any = tree
        while True:
            keys = list(inside) if isinstance(inside, dict) else list(range(len(inside)))
            if not keys:
                break
            key = draw(st.sampled_from(keys))
            if isinstance(inside[key], dict | list) and inside[key] and draw(st.integers(0, 4)):
                inside = inside[key]
                continue
            _change(draw, inside, key)
            break
    return tree


def _change(draw: Any, inside: Any, key: Any) -> None:
    what = draw(st.sampled_from(["set", "set", "set", "set", "scale", "delete", "add", "copy"]))
    value = copy.deepcopy(draw(st.sampled_from(NASTY)))  # which the next change may change
    if what == "delete":
        del inside[key]
    elif what == "add" and isinstance(inside, dict):
        inside[draw(st.sampled_from(["x", "", "name", "folder", "place", "a.b", "from_file", "surface"]))] = value
    elif what == "copy" and isinstance(inside, list):
        inside.append(inside[key])
    elif what == "scale" and isinstance(inside[key], int | float):
        inside[key] *= draw(st.sampled_from([-1, 0, 2, 1e6, 1e-6]))
    else:
        inside[key] = value


def _as_json(tree: Any) -> bytes:
    return json.dumps(tree).encode("utf-8", "surrogatepass")


def _as_toml(tree: Any) -> bytes:
    return "".join(f"{json.dumps(key)} = {_toml(value)}\n" for key, value in tree.items()).encode(
        "utf-8", "surrogatepass"
    )


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {_toml(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps("" if value is None else value, ensure_ascii=False)
