"""The catalogue itself: every entry finds its truth, and with its negative control misses it clearly."""

import hashlib
import pickle
from collections import defaultdict
from typing import get_args

import numpy as np
import pytest

from fem_reference.assessment.catalogue import PINNED, Entry, Kind, result
from fem_reference.problems.body import Body
from fem_reference.runs.store import Frame, Outcome, Run, collected
from fem_reference.verification import runner

ENTRIES = runner.entries()
# Where rounding alone is left, a negative control misses by far more than what is allowed; where a mesh is judged, clearly.
ROUNDING = 1e-8
# Of a material of K/mu = 1e6 a hundredth of the bulk modulus is hardly felt.
HARDLY_FELT = "squeeze_force_k1e6"


class Remembering:
    """A lab that solves the same body once: entries that read other values of it, or whose negative control it is, share it."""

    def __init__(self, lab) -> None:
        self.lab, self.solved = lab, dict[bytes, Run]()

    def solve(self, body: Body, element: str, **settings: float) -> Run:
        return self._once(self.lab.solve, body, element, settings)

    def second(self, body: Body, element: str, **settings: float) -> Run:
        return self._once(self.lab.second, body, element, settings)

    def _once(self, solve, body: Body, element: str, settings: dict[str, float]) -> Run:
        key = hashlib.sha256(pickle.dumps((solve.__name__, body, element, settings))).digest()
        if key not in self.solved:
            self.solved[key] = solve(body, element, **settings)
        return self.solved[key]


@pytest.fixture(scope="module")
def lab(fem_lab):
    return Remembering(fem_lab)


def test_every_entry_states_what_a_reader_needs() -> None:
    for name, one in ENTRIES.items():
        assert one.name == name
        assert one.kind in get_args(Kind)
        assert one.within > 0, name
        assert (one.pinned is not None) == (one.kind == "experiment"), name
        words = [getattr(one, key) for key in ("group", "title", "because", "source", "negative_control")]
        assert all(text.strip() for text in words), name
        assert one.wrong, name


@pytest.mark.slow
@pytest.mark.parametrize("entry", [e for e in ENTRIES.values() if not e.slow], ids=lambda entry: entry.name)
def test_an_entry_finds_its_truth(entry: Entry, lab) -> None:
    found = result(entry, entry.find(lab), 0.0, with_negative_control=False)
    # A muscle that the model does not meet is a finding; a value that has moved from the pinned one is a failure.
    met = ("within", "outside") if entry.kind == "experiment" else ("pass",)
    assert found.word in met, (found.finding, found.truth, found.within)
    if entry.refinement is not None and entry.refinement.order is not None:
        # Less than in theory is room for meshes that are not fine enough yet.
        assert found.finding.order is None or found.finding.order > entry.refinement.order - 0.5


def controls():
    """Entries whose negative control is measured: by day one of each function that measures, at night all."""
    asked = set()
    for entry in ENTRIES.values():
        function = getattr(entry.measure, "func", entry.measure)
        if not entry.slow_negative_control:
            yield pytest.param(entry, marks=pytest.mark.nightly if function in asked else (), id=entry.name)
            asked.add(function)


@pytest.mark.slow
@pytest.mark.parametrize("entry", list(controls()))
def test_with_its_negative_control_it_misses_clearly(entry: Entry, lab) -> None:
    found = result(entry, entry.find(lab, with_negative_control=True), 0.0, with_negative_control=True)
    assert found.word == "fail", (found.finding, found.truth, found.within)
    if entry.kind == "experiment":
        assert entry.pinned is not None
        assert abs(found.finding.value - entry.pinned) > 2 * PINNED * abs(entry.pinned)
        return
    clear = 1000 if entry.within <= ROUNDING and entry.name != HARDLY_FELT else 1.5
    assert found.error > clear * found.within


class Reading:
    """A lab that solves nothing and keeps how many cells the bodies have that it is asked for, by kind."""

    def __init__(self) -> None:
        self.cells = defaultdict[str, list[int]](list)

    def solve(self, body: Body, element: str, **settings: float) -> Run:  # noqa: ARG002
        self.cells[body.mesh.kind].append(len(body.mesh.cells))
        names = [entry.name for entry in (*body.prescribed, *body.bones)]
        around = {name: np.ones(3) for name in (*names, *(on for law in body.touching for on in law.forces))}
        points, scalars = body.mesh.points, defaultdict[str, float](lambda: 1.0)
        states = [
            Frame(number, points=points + (number - body.frames[0]), forces=around, moments=around, scalars=scalars)
            for number in body.frames
        ]
        return collected(states, Outcome("converged", "", {}))

    second = solve


def finest(entry: Entry, *, with_negative_control: bool) -> dict[str, int]:
    reading = Reading()
    entry.find(reading, with_negative_control=with_negative_control)
    return {kind: max(counts) for kind, counts in reading.cells.items()}


@pytest.mark.parametrize("entry", ENTRIES.values(), ids=lambda entry: entry.name)
def test_a_negative_control_is_measured_on_the_finest_mesh(entry: Entry) -> None:
    # On a coarser one the right body may miss too, and the negative control would not be what fails.
    assert finest(entry, with_negative_control=True) == finest(entry, with_negative_control=False)
