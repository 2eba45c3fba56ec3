"""Problems of every kind, as solvers and those who judge them know them."""

from typing import get_args

import numpy as np
import pytest

from fem_reference.effects import make
from fem_reference.problems import of_case, shapes
from fem_reference.problems.body import Body
from fem_reference.problems.problem import NO_SURFACE, NOTHING, AtRest, Problem, Task
from fem_reference.problems.scalar import FieldProblem
from fem_reference.problems.setup import Setup
from fem_reference.scenes import casefile

KINDS: tuple[type[Problem], ...] = (Setup, FieldProblem, Body)


def test_each_kind_of_problem_has_a_task_of_its_own() -> None:
    assert sorted(kind.task for kind in KINDS) == sorted(get_args(Task))


def test_what_has_no_surface_has_nothing_that_moves() -> None:
    assert AtRest().surface is NO_SURFACE
    assert NO_SURFACE.points.shape == NO_SURFACE.triangles.shape == (0, 3)
    assert (NOTHING.fibres, NOTHING.mesh, NOTHING.directions) == (None, None, None)
    field = of_case.setup(casefile.read("rod_advection"))
    body = Body(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "hexahedron"), (make("neo_hooke", mu=0.01),), (), (0.0, 1.0))
    assert field.rest is body.rest is NOTHING


def test_a_muscle_before_it_is_meshed_moves_its_surface_alone(bar) -> None:
    setup = of_case.setup(casefile.read(bar))
    assert setup.rest.surface is setup.surface
    assert setup.rest.mesh is None
    assert setup.body is None


@pytest.mark.slow
def test_a_meshed_muscle_moves_its_tetrahedra_and_fibres_too_and_writes_them(bar, tmp_path) -> None:
    case = casefile.read(bar)
    setup = of_case.setup(case)
    problem = of_case.problem(case, setup)
    assert np.array_equal(problem.rest.surface.points, setup.surface.points)
    assert len(problem.rest.mesh.tets) == problem.mesh_facts["tets"]
    assert len(problem.rest.fibres.lengths()) == case.fibres.traced.count
    problem.write_meshes(tmp_path)
    assert any(path.stat().st_size > 1000 for path in tmp_path.iterdir())
