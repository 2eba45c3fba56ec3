"""Settings of the reference: what is refused at the door, and that every element has a rung of the ladder."""

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.problems.body import ELEMENTS
from fem_reference.solvers.common.protocol import trades
from fem_reference.solvers.fenicsx.settings import BodySettings, Settings


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("first_step", 0.0),
        ("residual", -1e-8),
        ("perturbation", 1.0),
        ("linear_solver", "guess"),
        ("newton_iterations", 0),
    ],
)
def test_settings_without_a_meaning_are_refused(key, value) -> None:
    with pytest.raises(InputError, match=f"reference.{key}"):
        parse(BodySettings, {key: value}, "reference")


def test_a_body_has_no_ranks_of_its_own() -> None:
    assert parse(Settings, {"ranks": 2}, "reference").ranks == 2
    with pytest.raises(InputError, match="ranks"):
        parse(BodySettings, {"ranks": 2}, "reference")


def test_accuracy_can_be_bought_by_any_element() -> None:
    assert trades(Settings)["element"] == tuple(ELEMENTS)
