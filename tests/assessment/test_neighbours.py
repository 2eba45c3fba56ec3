"""Muscles in each other: the greatest depth of two at each frame, and none where one is not known."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from scipy.spatial.transform import Rotation

from fem_reference.assessment.neighbours import between, depths
from fem_reference.effects.touching import MuscleContact
from fem_reference.foundations.mesh import Polylines
from fem_reference.geometry.quadratic import EDGES
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.problems.touching import pressure_name
from fem_reference.runs.store import Outcome, Run


def test_depths_of_two_cubes_by_frame() -> None:
    cube = shapes.skin(shapes.box((2, 2, 2), (1.0, 1.0, 1.0)))
    heights = (1.5, 0.9, np.nan)
    still = Run("one", "x", Outcome("converged", ""), (0, 1, 2), cube, np.stack([cube.points] * 3))
    moved = replace(still, positions=np.stack([cube.points + [0, 0, height] for height in heights]))
    ((one, other, found),) = depths({"still": still, "moved": moved})
    assert (one, other) == ("still", "moved")
    assert found == pytest.approx([0.0, 0.1, np.nan], nan_ok=True)


def test_muscles_may_overlap_by_the_give_of_their_own_contact_alone() -> None:
    """Three cubes of 1 mm, whose edges and diagonals are 0.5 to 0.87 mm, over one another: "b" is 0.1 mm in "a", and "c" apart."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0))
    lines = Polylines(np.array([[0.5, 0.5, 0.1], [0.5, 0.5, 0.9]]), np.array([0, 2]))
    cube = MuscleProblem(shapes.skin(mesh), (), (), (0, 1), None, mesh=mesh, effects=(), fibres=lines)
    law = MuscleContact(stiffness="1 MPa/mm", smoothing="0.01 mm")
    problem = MusclesProblem(dict.fromkeys("abc", cube), (("a", "b"), ("b", "c")), law, apart=True)
    count = len(mesh.points)
    lifts = np.repeat([0.0, 0.9, 2.5], count)[:, None] * [0.0, 0.0, 1.0]
    nodes = np.tile(mesh.points, (3, 1)) + lifts

    def denied(pressed: str, pressure: float, places: np.ndarray | None = nodes) -> list[str]:
        """What is not met under a ``pressure`` [MPa] between two muscles."""
        known = {pressure_name(f"{one} free", f"{other} free"): 0.0 for one, other in problem.pairs}
        known |= dict.fromkeys(("touching_pressure", pressure_name(*(f"{one} free" for one in pressed))), pressure)
        run = Run(
            "reference",
            "fenicsx",
            Outcome("converged", ""),
            (0,),
            cube.surface,
            cube.surface.points[None],
            scalars={name: np.array([value]) for name, value in known.items()},
        )
        return [one.name for one in between(problem, run, lambda _: places) if not one.met]

    assert denied("ab", 0.09) == []  # 0.09 and 0.01, and 0.05 of an edge that bulges
    assert denied("ab", 0.02) == ["penetration of a and b into each other"]  # at most 0.073
    assert denied("bc", 0.09) == [
        "penetration of a and b into each other"
    ]  # others that press each other are no excuse
    assert len(denied("ab", 0.09, None)) == 3  # not known, so that none is met
    # Where contact was left out, as no two come near, nothing is allowed, in any of several frames.
    still = replace(problem, law=None, pairs=())
    run = Run("r", "fenicsx", Outcome("converged", ""), (0, 1), cube.surface, np.stack([cube.surface.points] * 2))
    for lifted, lost in (
        (nodes, ["penetration of a and b into each other"]),
        (np.tile(mesh.points, (3, 1)) + 2 * lifts, []),
    ):
        assert [one.name for one in between(still, run, lambda _, places=lifted: places) if not one.met] == lost


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.1])
def test_bodies_that_share_a_face_are_not_in_each_other(turn: float) -> None:
    """Two cubes on one another, turned about an oblique axis: rounding (1e-16 of their size) is no overlap, 1e-3 mm is one."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0))
    lines = Polylines(np.array([[0.5, 0.5, 0.1], [0.5, 0.5, 0.9]]), np.array([0, 2]))
    cube = MuscleProblem(shapes.skin(mesh), (), (), (0,), None, mesh=mesh, effects=(), fibres=lines)
    problem = MusclesProblem(dict.fromkeys("ab", cube), (), None, apart=True)
    turned = Rotation.from_rotvec(turn * np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0))
    run = Run("r", "fenicsx", Outcome("converged", ""), (0,), cube.surface, cube.surface.points[None])
    for lift, met in ((1.0, True), (0.999, False)):
        nodes = turned.apply(np.concatenate([mesh.points, mesh.points + [0.0, 0.0, lift]]))
        assert [one.met for one in between(problem, run, lambda _, places=nodes: places)] == [met]


def displaced(mesh, by) -> np.ndarray:
    """The displacement (m, 10, 3) at the nodes of the tetrahedra of a ``mesh``: along z, ``by`` a function of x."""
    corners = mesh.points[mesh.tets]
    nodes = np.concatenate([corners, corners[:, EDGES].mean(axis=2)], axis=1)
    return np.stack([0 * nodes[..., 0], 0 * nodes[..., 0], by(nodes[..., 0])], axis=2)


@pytest.mark.parametrize(("dent", "follows", "flat", "curved"), [(0.4, True, False, True), (-0.4, False, True, False)])
def test_curved_facets_decide_where_they_are_known(dent, follows, flat, curved) -> None:
    """Two cubes on one another; their common face is bent by a parabola, 0.1 mm deep in its middle, which quadratic displacements
    represent. As a dent in both, the corners of the finer mesh are 0.1 mm in the flat triangles of the coarser one, although both
    share the face, to 1/16 of that by its pieces. As a bulge of the lower cube alone it is 0.1 mm in the other, between corners
    that only touch.
    """
    boxes = [shapes.box((1, 1, 1), (1.0, 1.0, 1.0)), shapes.box((2, 1, 1), (1.0, 1.0, 1.0))]
    boxes[1] = replace(boxes[1], points=boxes[1].points + [0.0, 0.0, 1.0])
    lines = Polylines(np.array([[0.5, 0.5, 0.1], [0.5, 0.5, 0.9]]), np.array([0, 2]))
    cubes = [MuscleProblem(shapes.skin(box), (), (), (0,), None, mesh=box, effects=(), fibres=lines) for box in boxes]
    law = MuscleContact(stiffness="1 MPa/mm", smoothing="0.01 mm")
    problem = MusclesProblem(dict(zip("ab", cubes, strict=True)), (("a", "b"),), law, apart=True)
    fields = [lambda x: -dent * x * (1 - x), lambda x: -dent * x * (1 - x) * follows]
    lifts = [by(box.points[:, 0])[:, None] * [0.0, 0.0, 1.0] for box, by in zip(boxes, fields, strict=True)]
    nodes = np.concatenate([box.points + lift for box, lift in zip(boxes, lifts, strict=True)])
    state = np.concatenate([displaced(box, by) for box, by in zip(boxes, fields, strict=True)])
    surface = cubes[0].surface
    pressed = {"touching_pressure": np.array([0.001])}
    run = Run("r", "fenicsx", Outcome("converged", ""), (0,), surface, surface.points[None], scalars=pressed)
    assert [one.met for one in between(problem, run, lambda _: nodes)] == [flat]
    assert [one.met for one in between(problem, run, lambda _: nodes, lambda _: state)] == [curved]
    if not curved:
        (found,) = between(problem, run, lambda _: nodes, lambda _: state)
        assert found.value == pytest.approx(0.1, abs=1e-9)  # at a corner of a piece
    # Linear displacements have no curved facets.
    assert [one.met for one in between(problem, run, lambda _: nodes, lambda _: state[:, :4])] == [flat]
