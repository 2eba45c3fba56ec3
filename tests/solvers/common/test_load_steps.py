"""Adaptive load steps: every frame is hit, failures are cut, easy steps grow, and what cannot be reached is said."""

from itertools import pairwise

from fem_reference.solvers.common.load_steps import Attempt, StepSizes, march


def marched(attempt, frames=(0, 10, 20), first_step=10.0, smallest_step=0.5):
    return list(march(attempt, frames, StepSizes(first_step, smallest_step)))


def test_easy_steps_hit_every_frame_at_once() -> None:
    tried = []
    reached = marched(lambda at: tried.append(at) or Attempt("converged", 3))
    assert tried == [10, 20]
    assert [entry.frame for entry in reached] == [10, 20]
    assert [entry.iterations for entry in reached] == [3, 3]


def test_no_step_is_above_the_largest() -> None:
    tried = [0.0]
    list(march(lambda at: tried.append(at) or Attempt("converged", 2), (0, 10, 11), StepSizes(1.0, 0.5, 3.0)))
    assert max(later - earlier for earlier, later in pairwise(tried)) <= 3
    assert tried[-2:] == [10, 11]


def test_large_steps_never_skip_a_frame() -> None:
    reached = marched(lambda _: Attempt("converged", 2), frames=(0, 1, 2, 7), first_step=100.0)
    assert [entry.frame for entry in reached] == [1, 2, 7]


def test_failed_steps_are_halved_and_resume_from_the_last_good_state() -> None:
    state = {"at": 0.0}

    def attempt(at: float) -> Attempt:
        if at - state["at"] > 4:
            return Attempt("diverged", 14)
        state["at"] = at
        return Attempt("converged", 6)

    reached = marched(attempt)
    assert [entry.frame for entry in reached] == [10, 20]
    assert all(entry.last.status == "converged" for entry in reached)
    assert reached[0].cutbacks == 2  # 10 -> 5 -> 2.5
    assert reached[0].steps == 4


def test_steps_are_equal_and_none_is_a_sliver() -> None:
    tried = []
    marched(lambda at: tried.append(at) or Attempt("converged", 6), frames=(0, 10), first_step=3.0)
    assert tried == [2.5, 5.0, 7.5, 10]


def test_gives_up_below_the_smallest_step_and_says_where() -> None:
    reached = marched(lambda at: Attempt("inverted", 4, detail="det F") if at > 10 else Attempt("converged", 3))
    assert reached[0].frame == 10
    assert reached[0].last.status == "converged"
    assert (reached[1].last.status, reached[1].last.detail) == ("inverted", "det F")
    assert reached[1].at == 10
    assert len(reached) == 2


def test_what_was_solved_before_needs_no_step() -> None:
    tried = []
    reached = marched_back(lambda at: tried.append(at) or Attempt("converged", 3), known={20, 30})
    assert tried == [10, 40]
    assert [(entry.frame, entry.steps) for entry in reached] == [(10, 1), (20, 0), (30, 0), (40, 1)]


def marched_back(attempt, known):
    return list(march(attempt, (0, 10, 20, 30, 40), StepSizes(10.0, 0.5), lambda frame: frame in known))


def test_a_frame_that_is_a_little_further_than_the_largest_step_takes_two() -> None:
    tried = []
    list(march(lambda at: tried.append(at) or Attempt("converged", 2), (0, 3.5), StepSizes(3.0, 0.5, 3.0)))
    assert tried == [1.75, 3.5]


def test_a_last_resort_begins_anew_and_is_asked_once_it_helps_no_more() -> None:
    tried, resorts = [], [True, False]
    can = {"steps": 1.0}

    def attempt(at: float) -> Attempt:
        tried.append(at)
        return Attempt("diverged", 14) if at > 10 and can["steps"] else Attempt("converged", 6)

    def give_in() -> bool:
        can["steps"] = 0.0
        return resorts.pop(0)

    reached = list(march(attempt, (0, 10, 20), StepSizes(10.0, 4.0), last_resort=give_in))
    assert [entry.last.status for entry in reached] == ["converged", "converged"]
    assert tried == [10, 20, 15, 20]  # whole, halved, and whole anew
    fails = list(
        march(
            lambda at: Attempt("diverged" if at > 10 else "converged", 9, detail="why"),
            (0, 10, 20),
            StepSizes(10.0, 4.0),
            last_resort=lambda: resorts.pop(0),
        )
    )
    assert [entry.last.status for entry in fails] == ["converged", "diverged"]
    assert not resorts
