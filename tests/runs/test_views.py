"""Frames and runs of several muscles as those of one: its own part of each array, its forces, and no scalar of another."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome, collected
from fem_reference.runs.views import frame_of, run_of


def muscle(layers: int, shift: float) -> MuscleProblem:
    mesh = shapes.box((1, 1, layers), (1.0, 1.0, 1.0))
    surface = shapes.skin(mesh)
    lines = Polylines(
        np.array([[0.5, 0.5, 0.1 * i] for i in range(layers + 1)]) + [shift, 0, 0], np.array([0, layers + 1])
    )
    moved = surface.moved_to(surface.points + [shift, 0, 0])
    return MuscleProblem(moved, (), (), (0, 1), None, mesh=mesh, effects=(), fibres=lines)


def test_each_has_its_own_part() -> None:
    problem = MusclesProblem({"a": muscle(1, 0.0), "b": muscle(2, 5.0)}, (), None, apart=False)
    rest, (a, b) = problem.rest, problem.spans
    count = len(rest.mesh.tets)
    state = NodalState(np.arange(count)[:, None, None] * np.ones((1, 10, 3)), np.zeros((count, 4)), np.zeros((0, 0, 3)))
    names = ("a low", "b low", "b free on a free", "a free on b free")
    forces = {name: np.full(3, i + 1.0) for i, name in enumerate(names)}
    scalars = {"energy": 1.0, "min_det_F": 0.5, "b.volume": 2.0, "a.volume": 3.0}
    frame = Frame(0, rest.surface.points, rest.fibres.points, rest.mesh.points, scalars, state=state, forces=forces)
    own = frame_of(frame, b, ("a",))
    assert {name: force[0] for name, force in own.forces.items()} == {"low": 2, "a": 4}
    assert {name: force[0] for name, force in frame_of(frame, a, ("b",)).forces.items()} == {"low": 1, "b": 3}
    assert own.state.displacement[0, 0, 0] == len(problem.problems["a"].mesh.tets)
    run = run_of(collected([frame], Outcome("converged", ""), rest), problem, "b")
    assert run.positions[0] == pytest.approx(problem.problems["b"].surface.points)
    assert run.fibre_positions[0] == pytest.approx(problem.problems["b"].fibres.points)
    # The energy is of both; the least det F bounds that of each.
    assert {name: values[0] for name, values in run.scalars.items()} == {"volume": 2.0, "min_det_F": 0.5}
