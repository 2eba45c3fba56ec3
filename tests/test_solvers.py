"""The solver contract: every solver meets the same small problem, and says the same kind of things about it."""

import numpy as np
import pytest
import shapes

from fem_reference import effects, solvers
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface, TetMesh
from fem_reference.foundations.motion import Rotation, apply
from fem_reference.io import files
from fem_reference.problems.muscle import AttachedVertices, Problem
from fem_reference.runs.store import Frame
from fem_reference.scenes.case import SolverChoice

pytestmark = pytest.mark.slow

MUSCLE = (
    effects.find("neo_hooke").model_validate({"mu": "10 kPa"}),
    effects.find("incompressible").model_validate({"bulk": "10 MPa"}),
)
BEND = Rotation((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.3))
PBD = {"sub_iterations": 3, "solver_iterations": 2, "damping": 0.1, "stretch": 1.0, "volume": 1.0, "bending": 0.5}
SPRINGS = {"stiffness": "1 N/mm", "density": "1060 kg/m3", "frame_time": "20 ms", "damping": "eq. 5.5"}
SETTINGS = {"fenicsx": {"ranks": 1}, "pbd": PBD, "recorded": {"unit": "mm"}}
ARAP = {"weights": "clamped cotangent", "iterations": 3}
SETTINGS |= {"arap": ARAP | {"fixed": "remove", "rotations": "each", "volume_step": False}}
SETTINGS |= {"arap_pbd": ARAP | {"volume_constraint": True}}
SETTINGS |= {"line_of_action": {}, "mass_spring": SPRINGS}
SETTINGS |= {"pbd_program": {"sub_iterations": 3, "damping": 0.01, "bending": 0.9, "voxels": 64, "anisotropy": 1.0}}
SETTINGS["xpbd"] = {"frame_time": "20 ms", "sub_steps": 2, "sweeps": 2, "density": "1060 kg/m3", "stretch": "0.4 N/mm"}


def problem(motion: Rotation | None = BEND, other: Rotation | None = None) -> Problem:
    return shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": other, "top": motion}, MUSCLE, (0, 5, 10))


def solved(name: str, given: Problem, folder) -> tuple:
    settings = dict(SETTINGS[name])
    if name == "recorded":
        for number in given.frames:
            files.write_surface(folder / f"frame_{number}.vtp", given.surface, given.surface.points)
        settings["folder"] = str(folder)
    frames: list[Frame] = []
    record = solvers.settings(SolverChoice(solver=name, **settings), "case.toml")
    return solvers.find(name, "case.toml").solve(given, record, frames.append), frames


def test_every_solver_is_under_test() -> None:
    assert sorted(SETTINGS) == solvers.names("solve")
    assert solvers.names("solve_field") == ["fenicsx", "listing", "scikit_fem"]
    assert solvers.names() == sorted({*solvers.names("solve"), *solvers.names("solve_field")})


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


@pytest.mark.parametrize("name", SETTINGS)
def test_settings_are_strict(name) -> None:
    choice = SolverChoice(solver=name, **SETTINGS[name], speed=11)
    with pytest.raises(InputError, match="speed: got an unknown key"):
        solvers.settings(choice, "case.toml: reference")


@pytest.mark.parametrize("name", SETTINGS)
def test_every_frame_is_reached_in_order_and_the_first_is_rest(name, tmp_path) -> None:
    given = problem()
    outcome, frames = solved(name, given, tmp_path)
    assert outcome.status == "converged"
    assert outcome.message
    assert [frame.number for frame in frames] == [0, 5, 10]
    if name == "line_of_action":  # it has no surface, and begins as straight lines
        assert frames[0].surface is None
    else:
        assert frames[0].surface == pytest.approx(given.surface.points, abs=1e-9)
    assert all(np.isfinite(value) for value in outcome.cost.values())


@pytest.mark.parametrize("name", ["arap", "arap_pbd", "fenicsx", "mass_spring", "pbd", "pbd_program", "xpbd"])
def test_nothing_that_moves_moves_nothing(name, tmp_path) -> None:
    given = problem(motion=None)
    _, frames = solved(name, given, tmp_path)
    for frame in frames:
        assert frame.surface == pytest.approx(given.surface.points, abs=1e-9)


@pytest.mark.parametrize("name", ["arap", "arap_pbd", "fenicsx", "mass_spring", "pbd", "pbd_program", "xpbd"])
def test_attached_vertices_follow_their_bones(name, tmp_path) -> None:
    given = problem()
    _, frames = solved(name, given, tmp_path)
    for frame in frames:
        for attached in given.attached:
            expected = apply(attached.bone.pose(frame.number), given.surface.points[attached.vertices])
            assert frame.surface[attached.vertices] == pytest.approx(expected, abs=1e-9)


def shuffled(given: Problem, seed: int) -> tuple[Problem, np.ndarray]:
    """The same problem with its tets, tet points and surface vertices in another order; new place of each surface vertex."""
    random = np.random.default_rng(seed)
    points, vertices = (random.permutation(count) for count in (len(given.mesh.points), len(given.surface.points)))
    point_at, vertex_at = np.argsort(points), np.argsort(vertices)
    tets = point_at[given.mesh.tets][random.permutation(len(given.mesh.tets))]
    facets = {name: point_at[facet] for name, facet in given.mesh.facets.items()}
    attached = tuple(
        AttachedVertices(one.attachment, one.bone, np.sort(vertex_at[one.vertices])) for one in given.attached
    )
    surface = Surface(given.surface.points[vertices], vertex_at[given.surface.triangles])
    mesh = TetMesh(given.mesh.points[points], tets, facets)
    return Problem(**(vars(given) | {"surface": surface, "attached": attached, "mesh": mesh})), vertex_at


def test_the_reference_does_not_depend_on_the_order_of_nodes(tmp_path) -> None:
    # PBD does, and says so: its constraints are projected one after the other.
    given = problem()
    other, place = shuffled(given, 3)
    assert isinstance(other.fibres, Polylines)
    _, frames = solved("fenicsx", given, tmp_path)
    _, again = solved("fenicsx", other, tmp_path)
    for one, two in zip(frames, again, strict=True):
        # Both end with out-of-balance forces below 1e-8 N in a body of about 0.01 MPa x 10 mm: 1e-7 mm.
        assert two.surface[place] == pytest.approx(one.surface, abs=1e-7)
        assert two.fibres == pytest.approx(one.fibres, abs=1e-7)
