"""Offers of solvers: what needs the muscle filled, and the keys that buy accuracy."""

from typing import Annotated

import pytest

from fem_reference.foundations.records import Record
from fem_reference.runs.store import Outcome
from fem_reference.solvers.common.protocol import MuscleSolver, Trade, trades


class Numerics(Record):
    """Settings of a solver of this file."""

    sweeps: Annotated[int, Trade((1, 3, 10))] = 1
    fibres: bool = False


@pytest.mark.parametrize(
    ("moves", "fibres", "fills"),
    [
        ("surface", False, False),
        ("surface", True, True),
        ("nothing", False, False),
        ("tetrahedra", False, True),
        ("lines", False, True),
    ],
)
def test_a_muscle_is_filled_for_those_that_need_its_inside(moves, fibres, fills) -> None:
    offer = MuscleSolver(
        settings=Numerics,
        solve=lambda *_: Outcome("converged", ""),
        example={},
        moves=moves,
        fibres=lambda settings: settings.fibres,
    )
    assert offer.fills(Numerics(fibres=fibres)) == fills


def test_only_marked_keys_buy_accuracy() -> None:
    assert trades(Numerics) == {"sweeps": (1, 3, 10)}
