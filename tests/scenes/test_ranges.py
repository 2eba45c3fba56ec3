"""Ranges of unknown parameters: those of effects, those of a case in their place, and wrong ones refused."""

import re
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile, ranges
from tests.scenes.bars import refused

MU = {"key": "effect[0].mu", "low": "20 kPa", "high": "40 kPa", "source": "Someone 2006"}


def test_an_effect_states_its_ranges_and_a_case_its_own_in_their_place(bar: Path) -> None:
    case = casefile.read(bar)
    (key,) = ranges.ranges(case)
    assert key == "effect[0].mu"
    assert ranges.ends(case, key, ranges.ranges(case)[key], "here") == pytest.approx((0.00373, 0.0207))
    assert ranges.left_out(case) == ["effect[1].bulk"]
    bulk = {"key": "effect[1].bulk", "low": "10 MPa", "high": "30 MPa", "source": "made up"}
    own = casefile.read(bar, changes={"uncertain": [MU, bulk]})
    assert list(ranges.ranges(own)) == ["effect[0].mu", "effect[1].bulk"]
    assert ranges.ends(own, key, ranges.ranges(own)[key], "here") == pytest.approx((0.02, 0.04))
    assert own.key == case.key, "ranges change no solution"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"key": "effect[0].nu"}, 'uncertain[0].key: got "effect[0].nu", want the key of a number that this case has'),
        (
            {"key": "attachment[0].stiffness"},
            'uncertain[0].key: got "attachment[0].stiffness", want the key of a number',
        ),
        ({"low": "1 mm"}, 'uncertain[0].low: got "1 mm", want a pressure'),
        ({"high": "20 kPa"}, 'uncertain[0].high: got "20 kPa", want more than low, "20 kPa"'),
        ({"spread": "normal"}, "uncertain[0].spread: got"),
        ({"source": None}, "uncertain[0].source"),
    ],
)
def test_a_wrong_range_is_named(bar: Path, change: dict[str, object], message: str) -> None:
    refused(bar, "uncertain", [MU | change], message)


def test_a_key_has_one_range(bar: Path) -> None:
    refused(bar, "uncertain", [MU, MU], 'uncertain[1].key: got "effect[0].mu" a second time, want every key once')


@pytest.mark.parametrize("again", ["effect.0.mu", "effect[00].mu"])
def test_another_way_to_write_a_key_is_no_other_key(bar: Path, again: str) -> None:
    refused(bar, "uncertain", [MU, MU | {"key": again}], f'uncertain[1].key: got "{again}" a second time')
    (key,) = ranges.ranges(casefile.read(bar, changes={"uncertain": [MU | {"key": again}]}))
    assert key == "effect[0].mu", "in place of the published one"


@pytest.mark.parametrize(
    "key",
    ["attachment[0].within", "bone[1].motion.keyframes[1].angle", "muscle.tet_size", "frames.interval"],
)
def test_what_runs_are_measured_with_is_not_varied(bar: Path, key: str) -> None:
    message = f'uncertain[0].key: got "{key}", want a number of an effect, the stiffness or outline.shift.by of'
    refused(bar, "uncertain", [MU | {"key": key}], message)


@pytest.mark.parametrize(
    ("c2", "low", "message"),
    [
        ("1 kPa", "0 kPa", 'uncertain[0].low: got "0 kPa", want more than zero, for a log-uniform range'),
        ("0 kPa", "1 kPa", 'uncertain[0].spread: got "log-uniform" of 0, want "uniform"'),
    ],
)
def test_the_logarithm_of_zero_is_no_range_and_no_place_in_one(bar: Path, c2: str, low: str, message: str) -> None:
    one = {"key": "effect[0].c2", "low": low, "high": "2 kPa", "source": "", "spread": "log-uniform"}
    effects = [{"name": "mooney_rivlin", "c1": "3 kPa", "c2": c2}, {"name": "incompressible", "bulk": "10 MPa"}]
    with pytest.raises(InputError, match=re.escape(message)):
        casefile.read(bar, changes={"effect": effects, "uncertain": [one]})
