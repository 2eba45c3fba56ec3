"""The loop over frame numbers: which frames are wanted, what it costs, and how it ends."""

from dataclasses import replace

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems.problem import NO_SURFACE
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers.common.frame_loop import each, follow, refused
from fem_reference.solvers.common.state_checks import Trouble


class Counting:
    """A model that notes where it went, and is lost from the frame ``lost`` on."""

    advice = "another model"

    def __init__(self, lost: int = 100) -> None:
        self.cost = {"seconds_setup": 0.25}
        self.visited, self.lost = list[int](), lost

    def move(self, number: int) -> None:
        self.visited.append(number)

    def trouble(self) -> Trouble | None:
        return Trouble("inverted", "lost") if self.visited[-1] >= self.lost else None

    def frame(self, number: int) -> Frame:
        return Frame(number, None)

    def ending(self) -> Outcome:
        return Outcome("out of steps", "nearly")


NUMBERS = (2, 4, 6)
SETUP = Setup(NO_SURFACE, (), (), NUMBERS, None)


@pytest.mark.parametrize(
    ("loop", "given", "visited"), [(follow, (SETUP,), [3, 4, 5, 6]), (each, (NUMBERS, NUMBERS), [2, 4, 6])]
)
def test_wanted_frames_are_given_on_and_every_iteration_counts(loop, given, visited) -> None:
    model, frames = Counting(), list[Frame]()
    outcome = loop(model, *given, frames.append)
    assert model.visited == visited
    assert [frame.number for frame in frames] == [2, 4, 6]
    assert (outcome.status, outcome.message) == ("out of steps", "nearly")
    cost = outcome.cost
    assert (cost["iterations"], cost["threads"], cost["seconds_setup"]) == (len(visited), 1, 0.25)
    assert cost["seconds_per_iteration"] == cost["seconds_solve"] / len(visited)


def test_more_frame_numbers_than_anybody_goes_through_are_refused() -> None:
    far = replace(SETUP, frames=(2, 10**9))
    with pytest.raises(
        InputError, match=r"frames\.last: got 1000000000, .*want at most 100000 frame numbers after the first"
    ):
        follow(Counting(), far, list[Frame]().append)


def test_it_ends_where_the_state_is_lost_and_keeps_what_it_reached() -> None:
    model, frames = Counting(lost=5), list[Frame]()
    outcome = follow(model, SETUP, frames.append)
    assert (outcome.status, outcome.message) == ("inverted", "frame 5: lost; another model")
    assert [frame.number for frame in frames] == [2, 4]
    assert outcome.cost["iterations"] == 3


def test_a_loop_that_is_refused_gives_rest_and_says_why() -> None:
    model, frames = Counting(), list[Frame]()
    outcome = refused(model, 2, frames.append, Trouble("diverged", "nothing ties it"))
    assert (outcome.status, outcome.message) == ("diverged", "nothing ties it")
    assert [frame.number for frame in frames] == [2]
    assert (outcome.cost["iterations"], outcome.cost["seconds_solve"]) == (0, 0)
