"""Ranges in which laws are valid: the rest state is in all of them."""

import acting
import pytest

from fem_reference import effects
from fem_reference.foundations.limits import Limit


@pytest.mark.parametrize("name", effects.names())
def test_a_body_at_rest_is_in_the_range_of_every_law(name) -> None:
    for limit in effects.make(name, **acting.PARAMETERS[name]).limits():
        assert 0 <= limit.low <= 1 <= limit.high


def test_a_limit_that_is_not_given_is_none() -> None:
    assert Limit("V/V0").low < 1e-12 < 1e12 < Limit("V/V0").high
