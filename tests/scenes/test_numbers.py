"""Numbers of a case by key: the ones of the file, changed like by the file, and refused where they are none."""

from pathlib import Path
from typing import Any

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile, numbers
from tests.scenes.bars import RAMP

NO_CONTROL = {"key": "effect[0].mu", "value": "10 kPa", "because": "it is softer then"}
ACTIVE: dict[str, Any] = {"name": "fibre_active", "stress": "300 kPa", "optimal_stretch": 1.0, "ramp": RAMP}


def test_numbers_and_units_are_those_of_the_file(bar: Path) -> None:
    case = casefile.read(bar)
    for key, value, unit, title in (
        ("effect[0].mu", 0.03, "MPa", "neo_hooke mu"),
        ("muscle.tet_size", 20.0, "mm", "muscle tet_size"),
        ("attachment[0].within", 2.0, "mm", "attachment start within"),
        ("frames.last", 20.0, "", "frames last"),
        ("bone[1].motion.keyframes[1].frame", 10.0, "", "bone lever motion keyframes 2 frame"),
    ):
        assert numbers.number(case, key) == pytest.approx(value)
        assert (numbers.unit(case, key), numbers.title(case, key)) == (unit, title)


def test_a_changed_case_is_that_of_a_changed_file(bar: Path) -> None:
    case = casefile.read(bar)
    changed = numbers.changed(case, {"effect[0].mu": 0.02, "attachment[0].within": 3.0})
    assert changed == casefile.read(bar, changes={"effect[0].mu": "20 kPa", "attachment[0].within": "3 mm"})
    assert changed.key != case.key
    assert numbers.changed(changed, {"effect[0].mu": 0.03, "attachment[0].within": 2.0}).key == case.key
    assert numbers.read(case, "effect[0].mu", "20 kPa") == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("key", "message"),
    [
        ("effect[7].mu", "nothing"),
        ("effect[0].nu", "nothing"),
        ("effect[0]", "NeoHooke"),
        ("effect.mu", "nothing"),
        ("title", "str"),
        ("attachment[0].stiffness", "no value"),
        ("", "nothing"),
        ("bone[1].motion.axis[0]", "a number in a list"),
    ],
)
def test_a_key_of_no_number_is_refused(bar: Path, key: str, message: str) -> None:
    with pytest.raises(InputError, match=f"got {message}, want the key of a number"):
        numbers.read(casefile.read(bar), key, 1.0)


def test_a_value_is_checked_as_in_a_file(bar: Path) -> None:
    case = casefile.read(bar)
    with pytest.raises(InputError, match=r'effect\[0\]\.mu: got "1 mm", want a pressure'):
        numbers.read(case, "effect[0].mu", "1 mm")
    with pytest.raises(InputError, match=r"effect\[0\]\.mu: got -0.01, want more than zero"):
        numbers.changed(case, {"effect[0].mu": -0.01})
    with pytest.raises(InputError, match=r"effect\[0\]\.mu: got nan"):
        numbers.changed(case, {"effect[0].mu": float("nan")})


def test_a_record_is_checked_again_as_a_whole(bar: Path) -> None:
    """Points of a ramp out of order, and an activation at rest with nothing to balance it, are no case of a file either."""
    effects = [{"name": "neo_hooke", "mu": "30 kPa"}, ACTIVE]
    case = casefile.read(bar, changes={"effect": effects, "negative_control": NO_CONTROL})
    with pytest.raises(InputError, match=r"effect\[1\]\.ramp: got .*want knots in the order of their frames"):
        numbers.changed(case, {"effect[1].ramp[0].frame": 12.0})
    with pytest.raises(
        InputError, match=r"effect\[1\]\.ramp: got an amount of 0.25 at frame 0, the first, want 0 there"
    ):
        casefile.with_numbers(case, {"effect[1].ramp[0].amount": 0.25})
    soft = casefile.read(bar)
    with pytest.raises(InputError, match=r"effect\[1\]\.bulk: got 0\.01 MPa, want at least the shear modulus"):
        casefile.with_numbers(soft, {"effect[1].bulk": 0.01})


def test_what_stays_as_it_is_can_be_read_again() -> None:
    """Each number of a whole shipped case, with itself: units, files and closed forms on the way are those of the file."""
    case = casefile.read("box_squeeze")
    for key in ("muscle.tet_size", "bone[0].motion.keyframes[1].distance", "bone[0].box.rounding", "effect[0].mu"):
        again = casefile.with_numbers(case, {key: numbers.number(case, key)})
        assert (again, again.key) == (case, case.key)


def test_a_key_has_one_way_to_be_written() -> None:
    assert numbers.canonical("effect.1.mu") == numbers.canonical("effect[01].mu") == "effect[1].mu"


def test_a_stiffness_that_may_be_missing_and_an_amount_of_a_ramp_are_numbers_too(bar: Path) -> None:
    """As bands of attachments and of activation ask for."""
    effects = [{"name": "neo_hooke", "mu": "30 kPa"}, ACTIVE]
    given = {"attachment[0].stiffness": "100 kPa/mm", "effect": effects, "negative_control": NO_CONTROL}
    case = casefile.read(bar, changes=given)
    stiffness, amount = "attachment[0].stiffness", "effect[1].ramp[1].amount"
    assert (numbers.number(case, stiffness), numbers.unit(case, stiffness)) == (pytest.approx(0.1), "MPa/mm")
    assert numbers.title(case, amount) == "fibre_active ramp 2 amount"
    changed = numbers.changed(case, {stiffness: 0.2, amount: 0.5})
    other = [effects[0], ACTIVE | {"ramp": [RAMP[0], RAMP[1] | {"amount": 0.5}]}]
    assert changed == casefile.read(bar, changes=given | {stiffness: "200 kPa/mm", "effect": other})
    with pytest.raises(InputError, match=r"effect\[1\]\.ramp\[1\]\.amount: got -1, want greater than or equal to 0"):
        numbers.changed(case, {amount: -1})
