"""The catalogue itself: every entry finds its truth, and with its negative control misses it clearly."""

from collections import defaultdict
from collections.abc import Callable

import numpy as np
import pytest

from fem_reference.assessment.catalogue import Entry, Lab, result
from fem_reference.problems.body import Body
from fem_reference.runs.store import Frame, Outcome, Run, collected
from fem_reference.verification import runner

ENTRIES = runner.entries()
# Quadratic elements promise order 4 for the work of stresses; less is room for meshes that are not fine enough yet.
FOURTH_ORDER = {"torsion", "inflation", "flexure"}
# Where rounding alone is left, a negative control misses by far more than what is allowed; where a mesh is judged, clearly.
ROUNDING = {"homogeneous", "fibres", "loads", "patch tests", "rigid motion"}


@pytest.mark.slow
@pytest.mark.parametrize("entry", [e for e in ENTRIES.values() if not e.slow], ids=lambda entry: entry.name)
def test_an_entry_finds_its_truth(entry: Entry, fem_lab) -> None:
    found = result(entry, entry.measure(fem_lab), 0.0, with_negative_control=False)
    assert found.word == "pass", (found.finding, found.truth, found.within)
    if entry.group in FOURTH_ORDER:
        assert found.finding.order is None or found.finding.order > 3.5


@pytest.mark.slow
@pytest.mark.parametrize(
    "entry", [e for e in ENTRIES.values() if not e.slow_negative_control], ids=lambda entry: entry.name
)
def test_with_its_negative_control_it_misses_clearly(entry: Entry, fem_lab) -> None:
    found = result(entry, entry.with_negative_control(fem_lab), 0.0, with_negative_control=True)
    assert found.word == "fail", (found.finding, found.truth, found.within)
    assert found.error > (1000 if entry.group in ROUNDING else 1.5) * found.within


class Reading:
    """A lab that solves nothing and keeps how many cells the bodies have that it is asked for, by kind."""

    def __init__(self) -> None:
        self.cells = defaultdict[str, list[int]](list)

    def solve(self, body: Body, element: str, **settings: float) -> Run:  # noqa: ARG002
        self.cells[body.mesh.kind].append(len(body.mesh.cells))
        around = {entry.name: np.ones(3) for entry in (*body.prescribed, *body.obstructions)}
        points = body.mesh.points + 1.0
        states = [
            Frame(frame, points=points, forces=around, moments=around, scalars=defaultdict(lambda: 1.0))
            for frame in body.frames
        ]
        return collected(states, Outcome("converged", "", {}))

    second = solve


def finest(measure: Callable[[Lab], object]) -> dict[str, int]:
    reading = Reading()
    measure(reading)
    return {kind: max(counts) for kind, counts in reading.cells.items()}


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=lambda entry: entry.name)
def test_a_negative_control_is_measured_on_the_finest_mesh(entry: Entry) -> None:
    # On a coarser one the right body may miss too, and the negative control would not be what fails.
    assert finest(entry.with_negative_control) == finest(entry.measure)
