"""A record says which key is unknown, missing or wrong, and cannot be changed."""

from typing import Any

import pytest

from fem_reference.errors import InputError
from fem_reference.records import Record, join, parse


class Leaf(Record):
    """A record inside another."""

    number: int


class Tree(Record):
    """A record with others inside."""

    leaf: Leaf
    leaves: tuple[Leaf, ...] = ()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"leaf": {"number": 1, "colour": 2}}, "a.toml: leaf.colour: got an unknown key, want one of number"),
        (
            {"leaf": {"number": 1}, "leaves": [{"number": 1, "x": 2}]},
            "a.toml: leaves[0].x: got an unknown key, want one of number",
        ),
        ({"leaf": {"number": 1}, "root": 1}, "a.toml: root: got an unknown key, want one of leaf, leaves"),
        ({"leaf": {}}, "a.toml: leaf.number: got nothing, want this key"),
        ({"leaf": {"number": "x"}}, 'a.toml: leaf.number: got "x", want a valid integer'),
    ],
)
def test_record_names_the_key(table: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(Tree, table, "a.toml")
    assert str(caught.value).startswith(message)


def test_records_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        parse(Leaf, {"number": 1}, "a.toml").number = 2


def test_join_says_where_a_key_is() -> None:
    assert [join("a.toml", "b"), join("a.toml: b", "c"), join("a.toml", "")] == ["a.toml: b", "a.toml: b.c", "a.toml"]
