"""The negative control of a scene: one key with another value, tried on reading, that changes what is judged."""

import math
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from tests.scenes.bars import SCENE, edited, refused

NAN = math.nan
TITLE = {"key": "title", "value": "another", "because": "it is another"}
# Key, what stands there instead, what the message says.
WRONG = [
    ("negative_control.key", "nonsense.key", 'negative_control.key: got "nonsense.key", want a key of this scene'),
    ("negative_control.key", "", 'negative_control.key: got "", want a key of this scene'),
    ("negative_control.key", "effect[\u00b2].bulk", "want a key of this scene"),
    (
        "negative_control.key",
        "negative_control.because",
        'negative_control.value: got "40 kPa", want a value that changes negative_control.because',
    ),
    (
        "negative_control.value",
        "30000 kPa",
        'negative_control.value: got "30000 kPa", want a value that changes effect[1].bulk',
    ),
    (
        "negative_control.value",
        "5 mm",
        'negative_control.value: got "5 mm", want a value that can be read (effect[1].bulk: got "5 mm", want',
    ),
    (
        "negative_control.value",
        5,
        "negative_control.value: got 5, want a value that can be read (effect[1].bulk: got 5, want a pressure",
    ),
    ("negative_control", TITLE, 'negative_control.key: got "title", want a key that changes the solution'),
    (
        "negative_control",
        TITLE | {"key": "expect[0].truth", "value": "9 %"},
        'key: got "expect[0].truth", want a key that',
    ),
    (
        "negative_control",
        TITLE | {"key": "candidate[0].stretch", "value": 0.5},
        'key: got "candidate[0].stretch", want a',
    ),
    ("negative_control.value", True, "negative_control.value: got True, want"),
    ("negative_control.value", NAN, "negative_control.value: got nan, want"),
]


@pytest.mark.parametrize(("key", "value", "message"), WRONG, ids=lambda entry: str(entry)[:40])
def test_wrong_value_names_file_and_key(bar: Path, key: str, value: object, message: str) -> None:
    refused(bar, key, value, message)


def test_a_negative_control_changes_what_is_judged(bar: Path) -> None:
    # What changes the time only, or a run that nothing is expected of, turns no verdict.
    control = {"key": "reference.ranks", "value": 2, "because": "it is faster"}
    with pytest.raises(InputError, match=r'negative_control\.key: got "reference\.ranks", want a key that changes'):
        casefile.read(bar, changes={"reference.ranks": 1, "negative_control": control})
    edited(bar, 'key = "effect[1].bulk"\nvalue = "40 kPa"', 'key = "title"\nvalue = "another"')
    for wrong in (True, False):
        with pytest.raises(InputError, match=r'negative_control\.key: got "title"'):
            casefile.read(bar, with_negative_control=wrong)
    control = {"key": "candidate[0].stretch", "value": 0.5, "because": "it is softer"}
    for of in ("fast", "candidates"):
        read = casefile.read(bar, changes={"expect[0].of": of, "negative_control": control})
        assert read.negative_control.key == control["key"]


def test_negative_control_changes_one_key(bar: Path) -> None:
    assert casefile.read(bar, with_negative_control=True) == casefile.read(bar, changes={"effect[1].bulk": "40 kPa"})


def test_negative_control_that_is_missing(bar: Path) -> None:
    with pytest.raises(InputError, match=r"case.toml: negative_control: got None"):
        casefile.read(edited(bar, SCENE[SCENE.index("[negative_control]") :], ""), with_negative_control=True)


def test_negative_control_is_tried_on_reading(bar: Path) -> None:
    with pytest.raises(InputError, match=r"case\.toml: negative_control\.key: got .*want a key of this scene"):
        casefile.read(edited(bar, 'key = "effect[1].bulk"', 'key = "effect[2].bulk"'))


def test_negative_control_may_be_a_number(bar: Path) -> None:
    file = edited(bar, 'key = "effect[1].bulk"\nvalue = "40 kPa"', 'key = "frames.last"\nvalue = 15')
    assert casefile.read(file, with_negative_control=True).frames.last == 15


def test_changes_may_take_away_what_the_negative_control_changes(bar: Path) -> None:
    changes = {"effect": [{"name": "neo_hooke", "mu": "1 kPa"}]}
    assert len(casefile.read(bar, changes=changes).effects) == 1
    with pytest.raises(InputError, match=r"negative_control\.key: got .*, want a key of this scene"):
        casefile.read(bar, changes=changes, with_negative_control=True)
