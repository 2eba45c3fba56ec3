"""A record says which key is unknown, missing or wrong, and cannot be changed."""

import math
import pickle
from typing import Any, Literal

import pytest
from pydantic import Field

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, directed, increasing, join, one_of, parse


class Leaf(Record):
    """A record inside another."""

    number: int


class Tree(Record):
    """A record with others inside."""

    leaf: Leaf
    leaves: tuple[Leaf, ...] = ()
    height: float = 1.0
    age: int | Literal["any"] = "any"
    rings: tuple[tuple[float, float], ...] = ()
    seeds: tuple[Leaf, ...] = Field(default=(Leaf(number=1),), min_length=1)


LEAF = {"number": 1}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"leaf": {"number": 1, "colour": 2}}, "a.toml: leaf.colour: got an unknown key, want one of number"),
        (
            {"leaf": {"number": 1}, "leaves": [{"number": 1, "x": 2}]},
            "a.toml: leaves[0].x: got an unknown key, want one of number",
        ),
        (
            {"leaf": {"number": 1}, "root": 1},
            "a.toml: root: got an unknown key, want one of age, height, leaf, leaves, rings, seeds",
        ),
        ({"leaf": {}}, "a.toml: leaf.number: got nothing, want this key"),
        ({"leaf": {"number": True}}, "a.toml: leaf.number: got True, want a valid integer"),
        ({"leaf": {"number": "1"}}, 'a.toml: leaf.number: got "1", want a valid integer'),
        ({"leaf": {"number": 1.0}}, "a.toml: leaf.number: got 1.0, want a valid integer"),
        ({"leaf": LEAF, "height": "1"}, 'a.toml: height: got "1", want a valid number'),
        ({"leaf": LEAF, "height": True}, "a.toml: height: got True, want a valid number"),
        ({"leaf": LEAF, "height": math.nan}, "a.toml: height: got nan, want a finite number"),
        ({"leaf": LEAF, "height": -math.inf}, "a.toml: height: got -inf, want a finite number"),
        ({"leaf": LEAF, "age": 1.5}, "a.toml: age: got 1.5, want a valid integer"),
        ({"leaf": LEAF, "rings": [[1, 2], [3]]}, "a.toml: rings[1][1]: got nothing, want this key"),
        ({"leaf": LEAF, "rings": [[1, math.inf]]}, "a.toml: rings[0][1]: got inf, want a finite number"),
        ({"leaf": LEAF, "rings": 3}, "a.toml: rings: got 3, want a valid tuple"),
        ({"leaf": [1, [2]]}, "a.toml: leaf: got [1, [2]], want"),
        ({"leaf": {"number": "x"}}, 'a.toml: leaf.number: got "x", want a valid integer'),
    ],
)
def test_record_names_the_key(table: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(Tree, table, "a.toml")
    assert str(caught.value).startswith(message)


def test_a_list_is_not_too_short_for_what_is_wrong_inside_it() -> None:
    for seeds, message in (
        ([{"number": "x"}], 'a.toml: seeds[0].number: got "x", want a valid integer'),
        ([], "a.toml: seeds: got [], want Tuple should have at least 1 item after validation, not 0"),
    ):
        with pytest.raises(InputError) as caught:
            parse(Tree, {"leaf": LEAF, "seeds": seeds}, "a.toml")
        assert str(caught.value) == message


def test_lists_become_tuples_and_integers_floats() -> None:
    tree = parse(Tree, {"leaf": LEAF, "leaves": [LEAF], "height": 2, "age": 3, "rings": [[1, 2.5]]}, "a.toml")
    assert (tree.leaves, tree.height, tree.age, tree.rings) == ((Leaf(number=1),), 2.0, 3, ((1.0, 2.5),))
    assert isinstance(tree.height, float)


def test_records_are_frozen() -> None:
    with pytest.raises(ValueError, match="frozen"):
        parse(Leaf, {"number": 1}, "a.toml").number = 2


def test_join_says_where_a_key_is() -> None:
    assert [join("a.toml", "b"), join("a.toml: b", "c"), join("a.toml", "")] == ["a.toml: b", "a.toml: b.c", "a.toml"]


def test_bad_input_is_the_same_in_another_process() -> None:
    error = InputError("case.toml: bone", None, "a bone")
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.place, again.want) == (str(error), "case.toml: bone", "a bone")


class Choice(Record):
    """A record with two keys of which one is wanted."""

    one: int | None = None
    other: int | None = None

    _check = one_of("one", "other")


def test_exactly_one_of_some_keys_is_given() -> None:
    assert parse(Choice, {"one": 0}, "a.toml").one == 0
    for table in ({}, {"one": 1, "other": 2}):
        with pytest.raises(InputError, match='exactly one of "one" and "other"'):
            parse(Choice, table, "a.toml")


def test_what_increases_and_what_points_somewhere() -> None:
    assert increasing((1, 2, 3), "more") == (1, 2, 3)
    assert increasing(None, "more") is None
    assert directed((0.0, 0.0, -2.0), "an axis") == (0.0, 0.0, -2.0)
    for values in ((1, 1), (2, 1), (1, 3, 2)):
        with pytest.raises(ValueError, match="more"):
            increasing(values, "more")
    for vector in ((0.0, 0.0, 0.0), (0.0, 1e10, 0.0), (math.nan, 0.0, 1.0)):
        with pytest.raises(ValueError, match="an axis that is not zero"):
            directed(vector, "an axis")
