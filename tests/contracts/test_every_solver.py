"""The solver contract: every solver meets the same small problem, and says the same kind of things about it."""

import shlex
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes

from fem_reference import effects, solvers
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, TetMesh
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import Record, parse
from fem_reference.io import files
from fem_reference.problems import scalar
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.paths import Turn
from fem_reference.problems.setup import Bone
from fem_reference.problems.shapes import box
from fem_reference.runs.store import Frame
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers.common.frame_loop import carry
from fem_reference.solvers.common.protocol import trades

MUSCLE = (
    effects.find("neo_hooke").model_validate({"mu": "10 kPa"}),
    effects.find("incompressible").model_validate({"bulk": "10 MPa"}),
)
RELAX = Path(__file__).parents[2] / "examples" / "own_command" / "relax.py"
BEND = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.3))


def offered(task: str) -> list:
    """The names of the solvers for a ``task``, each slow where it says so."""
    slow = {name: solvers.find(name, "tests", task).slow for name in solvers.names(task)}
    return [pytest.param(name, marks=[pytest.mark.slow] if slow[name] else []) for name in slow]


OFFERS = [(name, offer.task) for name in solvers.names() for offer in solvers.offers(name)]


def problem(motion: RigidMotion | None = BEND, other: RigidMotion | None = None) -> MuscleProblem:
    return shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": other, "top": motion}, MUSCLE, (0, 5, 10))


def solved(name: str, given: MuscleProblem, folder) -> tuple:
    solver = solvers.find(name, "case.toml")
    settings = dict(solver.example)
    if "folder" in settings:  # of frames: the attached vertices move, and nothing else
        settings["folder"] = str(folder)
        for number in given.frames:
            points = np.array(given.surface.points)
            carry(points, given, number)
            files.write_surface(folder / f"frame_{number}.vtp", given.surface, points)
    frames: list[Frame] = []
    if "command" in settings:
        settings["command"] = shlex.join([sys.executable, str(RELAX)]) + " --iterations {iterations} {scene} {out}"
    record = solvers.settings(SolverChoice(solver=name, **settings), "case.toml")
    return solver.solve(given, record, frames.append), frames


@pytest.mark.parametrize(("name", "task"), OFFERS)
def test_an_offer_has_an_example_of_its_settings_and_ladders_of_values_that_they_take(name, task) -> None:
    offer = solvers.find(name, "tests", task)
    assert isinstance(solvers.settings(SolverChoice(solver=name, **offer.example), "case.toml", task), Record)
    for key, ladder in trades(offer.settings).items():
        assert len(set(ladder)) == len(ladder) > 1
        for value in ladder:
            changed = SolverChoice(solver=name, **offer.example | {key: value})
            assert key in solvers.settings(changed, "case.toml", task).model_fields_set


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "solvers/unfinished: SOLVES is None, want a tuple of MuscleSolver, FieldSolver or BodySolver"),
        ("SOLVES = ()", "SOLVES is .., want a tuple"),
        ("SOLVES = len", "SOLVES is <built-in function len>, want a tuple"),
        ("SOLVES = (MuscleSolver(settings=PbdSettings, solve=len),)", "missing 1 required .* 'example'"),
        ("SOLVES = (MuscleSolver(settings=PbdSettings, example={}),)", "missing 1 required .* 'solve'"),
    ],
)
def test_a_file_that_is_no_solver_is_named_with_what_it_lacks(text, problem, tmp_path, monkeypatch) -> None:
    imports = "from fem_reference.solvers.common.protocol import MuscleSolver\nfrom fem_reference.solvers.pbd import PbdSettings\n"
    (tmp_path / "unfinished.py").write_text(imports + text)
    monkeypatch.setattr(solvers, "__path__", [*solvers.__path__, str(tmp_path)])
    monkeypatch.setitem(sys.modules, "fem_reference.solvers.unfinished", None)  # so that it is gone afterwards
    del sys.modules["fem_reference.solvers.unfinished"]
    assert "unfinished" in solvers.names()
    with pytest.raises(TypeError, match=problem):
        solvers.names("solve")


def test_an_unknown_solver_is_named() -> None:
    with pytest.raises(
        InputError, match=r'reference\.solver: got "magic", want one of .*fenicsx, .*mass_spring, .*recorded'
    ):
        solvers.find("magic", "case.toml: reference", "solve")


@pytest.mark.parametrize(("name", "task"), [("listing", "solve"), ("pbd", "solve_field")])
def test_a_solver_for_something_else_is_named(name, task) -> None:
    with pytest.raises(
        InputError, match=rf'reference\.solver: got "{name}", which does not solve (muscles|scalar fields)'
    ):
        solvers.find(name, "case.toml: reference", task)


@pytest.mark.parametrize(("name", "task"), OFFERS)
def test_settings_are_strict(name, task) -> None:
    choice = SolverChoice(solver=name, **solvers.find(name, "tests", task).example, speed=11)
    with pytest.raises(InputError, match="speed: got an unknown key"):
        solvers.settings(choice, "case.toml: reference", task)


@pytest.mark.parametrize("name", offered("solve"))
def test_every_frame_is_reached_in_order_and_the_first_is_rest(name, tmp_path) -> None:
    given = problem()
    outcome, frames = solved(name, given, tmp_path)
    assert outcome.status == "converged"
    assert outcome.message
    assert [frame.number for frame in frames] == [0, 5, 10]
    if frames[0].surface is None:  # of a solver of lines, which begins as straight ones
        assert all(frame.fibres is not None for frame in frames)
    else:
        assert frames[0].surface == pytest.approx(given.surface.points, abs=1e-9)
    assert all(np.isfinite(value) for value in outcome.cost.values())
    if solvers.find(name, "tests").moves in ("surface", "tetrahedra"):
        assert outcome.cost["unknowns"] > 0  # by which a study compares


@pytest.mark.parametrize("name", offered("solve"))
def test_nothing_that_moves_moves_nothing(name, tmp_path) -> None:
    given = problem(motion=None)
    _, frames = solved(name, given, tmp_path)
    for frame in frames:
        moved, rest = (
            (frame.surface, given.surface.points) if frame.surface is not None else (frame.fibres, frames[0].fibres)
        )
        assert moved == pytest.approx(rest, abs=1e-9)


@pytest.mark.parametrize("name", offered("solve"))
def test_attached_vertices_follow_their_bones(name, tmp_path) -> None:
    given = problem()
    _, frames = solved(name, given, tmp_path)
    for frame in frames:
        for attached in given.attached if frame.surface is not None else ():
            expected = apply(attached.bone.pose(frame.number), given.surface.points[attached.vertices])
            assert frame.surface[attached.vertices] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", offered("solve_field"))
def test_a_field_has_a_value_at_every_node_and_a_cost(name) -> None:
    solver = solvers.find(name, "tests", "solve_field")
    built = scalar.build(casefile.read("rod"))
    solution = solver.run(built, parse(solver.settings, solver.example, name))
    assert solution.outcome.status == "converged"
    assert solution.outcome.message
    assert solution.values[0].shape == built.fixed.shape
    assert np.isfinite(solution.values).all()
    assert all(np.isfinite(value) for value in solution.outcome.cost.values())


@pytest.mark.parametrize("name", offered("solve_body"))
def test_a_body_turns_with_its_ends(name) -> None:
    solver = solvers.find(name, "tests", "solve_body")
    mesh, turn = box((1, 1, 2), (1.0, 2.0, 3.0), "tetrahedron"), Turn((0.0, 1.0, 0.0), 0.4, (0.0, 0.0, 0.0))
    ends = tuple(Prescribed(end, end, (0, 1, 2), turn) for end in ("z0", "z1"))
    body = Body(mesh, MUSCLE, ends, (0.0, 0.5, 1.0))
    solved = solver.run(body, parse(solver.settings, solver.example, name))
    assert solved.outcome.status == "converged"
    assert [state.number for state in solved.states] == [0.0, 0.5, 1.0]
    for state in solved.states:
        assert state.points == pytest.approx(mesh.points + turn(mesh.points, state.number), abs=1e-7)
    assert all(np.isfinite(value) for value in solved.outcome.cost.values())


def bent(points: np.ndarray) -> np.ndarray:
    """A body without symmetry, whose points are no ties to whoever chooses among them."""
    x, y, z = points.T
    bend = [np.sin(0.21 * z + 0.3 * y), np.cos(0.17 * z + 0.4 * x), np.sin(0.5 * x + 0.23 * y)]
    return np.asarray(points + 0.8 * np.column_stack(bend))


def placed(given: MuscleProblem, at: Callable[[np.ndarray], np.ndarray], turn: np.ndarray) -> MuscleProblem:
    """The same problem with its points moved by ``at``, and the axes of its bones turned."""
    bones = dict[str, Bone]()
    for bone in given.bones:
        old = bone.motion
        centre = None if old is None else tuple(at(np.array([old.centre]))[0])
        new = None if old is None else RigidMotion(tuple(turn @ old.axis), centre, old.frames, old.amounts)
        bones[bone.name] = replace(bone, motion=new)
    return replace(
        given,
        surface=given.surface.moved_to(at(given.surface.points)),
        bones=tuple(bones.values()),
        attached=tuple(replace(one, bone=bones[one.bone.name]) for one in given.attached),
        mesh=replace(given.mesh, points=at(given.mesh.points)),
        fibres=replace(given.fibres, points=at(given.fibres.points)),
    )


def shuffled(given: MuscleProblem, seed: int) -> tuple[MuscleProblem, np.ndarray]:
    """The same problem with its tets, tet points and surface vertices in another order; new place of each surface vertex."""
    random = np.random.default_rng(seed)
    points, vertices = (random.permutation(count) for count in (len(given.mesh.points), len(given.surface.points)))
    point_at, vertex_at = np.argsort(points), np.argsort(vertices)
    tets = point_at[given.mesh.tets][random.permutation(len(given.mesh.tets))]
    facets = {name: point_at[facet] for name, facet in given.mesh.facets.items()}
    attached = tuple(replace(one, vertices=np.sort(vertex_at[one.vertices])) for one in given.attached)
    surface = Surface(given.surface.points[vertices], vertex_at[given.surface.triangles])
    mesh = TetMesh(given.mesh.points[points], tets, facets)
    return replace(given, surface=surface, attached=attached, mesh=mesh), vertex_at


@pytest.mark.parametrize("name", [one for one in offered("solve") if one.values[0] not in ("recorded", "command")])
def test_a_scene_turned_moved_scaled_and_renumbered_has_the_same_answer(name, tmp_path) -> None:
    """To rounding, which the fit of Gaussians multiplies most. What a solver says it depends on is felt.

    The reference ends with out-of-balance forces below 1e-8 N in a body of about 0.01 MPa x 10 mm: 1e-7 mm.
    """
    given, pose = placed(problem(), bent, np.eye(3)), RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
    _, frames = solved(name, given, tmp_path)
    wanted = moved(frames)
    assert np.abs(wanted - moved(frames[:1])).max() > 5
    found = {}
    for key, scale in (("pose", 1.0), ("size", 3.0)):
        there = placed(given, lambda points, scale=scale: apply(pose, scale * points), pose[:3, :3])
        found[key] = apply(np.linalg.inv(pose), moved(solved(name, there, tmp_path)[1])) / scale
    other, place = shuffled(given, 3)
    again = solved(name, other, tmp_path)[1]
    found["order"] = moved(again) if again[-1].surface is None else moved(again)[place]
    depends = solvers.find(name, "tests").depends_on
    for key, points in found.items():
        assert (np.abs(points - wanted).max() < 1e-7) == (key not in depends), key


def moved(frames: list[Frame]) -> np.ndarray:
    """The last points of the surface, else of the fibres."""
    return np.asarray(frames[-1].fibres if frames[-1].surface is None else frames[-1].surface)
