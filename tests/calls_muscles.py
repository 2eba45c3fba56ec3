"""Muscles with a bone pressed into them, as the reference solves them, and the second check of each."""

from collections.abc import Callable
from typing import Any

from hypothesis import strategies as st
from odd import often, rarely

from fem_reference import solvers
from fem_reference.assessment.second_check import confirmed_frames
from fem_reference.foundations.records import parse
from fem_reference.runs.store import Frame
from fem_reference.solvers import fenicsx
from fem_reference.verification.second_check import bar

# How far [mm] a ball of 3 mm goes into a bar of 10 mm, from 0.2 mm beside it.
PATHS: list[Any] = ["0 mm", "1 mm", "2 mm", "3 mm", "5 mm", "8 mm", "14 mm", "-2 mm"]
SETTINGS: dict[str, list[Any]] = {
    "element": ["P1/P1", "P2/P1", "P1"],
    "first_step": [10.0, 1.0, 100.0],
    "residual": [1e-6, 1e-3, 1e300],
    "largest_step": [None, 2.0],
    "follow": ["stable", "equilibrium"],
}


@st.composite
def pressing(draw: Any) -> Callable[[], Any]:
    """Bars with a ball that is pressed into them, or goes through them."""
    path = draw(often(PATHS)) if rarely(draw, 10) else draw(st.sampled_from(PATHS))
    named = draw(st.lists(st.sampled_from(list(SETTINGS)), max_size=2))
    settings = {"element": "P2/P1", "time_limit": "20 s"} | {name: draw(often(SETTINGS[name])) for name in named}
    return lambda: denied(path, settings)


def denied(path: Any, settings: dict[str, Any]) -> None:
    """AssertionError where the solver crashes, or the second check denies what it says is converged."""
    problem, frames = bar(path), list[Frame]()
    chosen = parse(fenicsx.Settings, settings, "settings")
    solvers.check("fenicsx", chosen, problem.effects, "settings")
    outcome = fenicsx.solve(problem, chosen, frames.append)
    checked = confirmed_frames(problem, frames, outcome, chosen)
    assert checked.status not in ("denied", "crashed"), checked.message
