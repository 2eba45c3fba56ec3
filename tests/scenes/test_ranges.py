"""Ranges of unknown parameters: those of effects, those of a case in their place, and wrong ones refused."""

from pathlib import Path

import pytest

from fem_reference.scenes import casefile, ranges
from tests.scenes.bars import refused

MU = {"key": "effect[0].mu", "low": "20 kPa", "high": "40 kPa", "source": "Someone 2006"}


def test_an_effect_states_its_ranges_and_a_case_its_own_in_their_place(bar: Path) -> None:
    case = casefile.read(bar)
    (key,) = ranges.ranges(case)
    assert key == "effect[0].mu"
    assert ranges.ends(case, key, ranges.ranges(case)[key], "here") == pytest.approx((0.00373, 0.0207))
    assert ranges.left_out(case) == ["effect[1].bulk"]
    within = {"key": "attachment[0].within", "low": "1 mm", "high": "3 mm", "source": "made up"}
    own = casefile.read(bar, changes={"uncertain": [MU, within]})
    assert list(ranges.ranges(own)) == ["effect[0].mu", "attachment[0].within"]
    assert ranges.ends(own, key, ranges.ranges(own)[key], "here") == pytest.approx((0.02, 0.04))
    assert own.key == case.key, "what nobody knows changes no solution"


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


def test_the_logarithm_of_zero_is_no_range(bar: Path) -> None:
    frames = {
        "key": "bone[1].motion.keyframes[0].frame",
        "low": 0.0,
        "high": 1.0,
        "source": "",
        "spread": "log-uniform",
    }
    refused(bar, "uncertain", [frames], 'uncertain[0].low: got "0.0", want more than zero: its logarithm is spread')
