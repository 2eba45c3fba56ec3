"""Runs for ParaView: read back by VTK, every array compared with the run, stress with a closed form of a stretched block."""

import shutil
import struct
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pages
import pytest
import pyvista
import shapes
import small

from fem_reference import cli
from fem_reference.assessment import comparison as comparing
from fem_reference.assessment import local_fields
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.effects.in_situ import among
from fem_reference.export import paraview
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, TetMesh
from fem_reference.foundations.motion import apply
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.problems.body import reference_nodes
from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs.results import Results
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from validation import homogeneous, laws

MU, BULK, STRETCH = 0.01, 10.0, 1.25
STIFFNESS = 3.0  # of contact [MPa/mm]
WALL = 'name = "wall"\nhalf_space = { point = "5, 0, 0 mm", normal = [-1, 0, 0] }\n'
CONTACT = '[[effect]]\nname = "contact"\nstiffness = "3 MPa/mm"\nbones = ["wall"]\n'
FRAMES = (0, 5, 10, 15, 20)


def stretched(points: np.ndarray, number: int) -> np.ndarray:
    """The points of a bar pulled along z as a block of its material is, most at frame 10."""
    share = 1 - abs(number - 10) / 10
    truth = homogeneous.uniaxial(laws.neo_hooke(MU), BULK, 1 + share * (STRETCH - 1))
    return points @ truth.F[::-1, ::-1].T  # the closed form pulls along x


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory):
    """The small scene with a run of closed form, with states, and a candidate that is 1 mm beside it and stops early."""
    folder = small.write(tmp_path_factory.mktemp("case") / "bar")
    text = (folder / "case.toml").read_text()
    text = text.replace("[[attachment]]", f"[[bone]]\n{WALL}\n[[attachment]]", 1).replace(
        "[fibres]", f"{CONTACT}\n[fibres]"
    )
    (folder / "case.toml").write_text(text.replace("every = 5", 'every = 5\ninterval = "20 ms"'))
    scene = casefile.read(folder)
    setup = muscle.setup(scene)
    mesh = shapes.box((2, 2, 4), (10, 10, 40))
    tets = TetMesh(mesh.points, mesh.tets)
    fibres = Polylines(np.column_stack([np.full((8, 2), 5.0), [1, 5, 10, 20, 2, 3, 4, 8]]), [0, 4, 8])
    run = written(folder / "run", scene, setup, tets, fibres)
    beside = np.array(run.positions) + [1.0, 0, 0]
    beside[-1] = np.nan
    candidate = store.Run("mine", "recorded", Outcome("converged", ""), run.numbers, setup.surface, beside)
    bars = ErrorBar("deviation", "surface_deviation", "max", "mm", np.arange(5.0), {})
    known = ErrorBars(run.numbers, (1.0, 2.0), 1.0, (bars,))
    return comparing.compare(scene, setup, run, (candidate,), known), tets


def written(folder, scene, setup, tets: TetMesh, fibres: Polylines) -> store.Run:
    """The run of closed form as a solver would have stored it."""
    along = np.tile([0.0, 0, 1], (len(tets.tets), 1))
    identity = {"name": "reference", "solver": "fenicsx", "frames": FRAMES, "origin": {"scene": scene.key}}
    writer = Writer(folder, identity, AtRest(setup.surface, fibres, tets, along))
    weights = reference_nodes("tetrahedron", 2)
    nodes = np.einsum("kc,mcx->mkx", np.column_stack([1 - weights.sum(axis=1), weights]), tets.points[tets.tets])
    for number in FRAMES:
        moved = stretched(nodes.reshape(-1, 3), number).reshape(nodes.shape)
        J = np.linalg.det(stretched(np.eye(3), number))
        state = NodalState(moved - nodes, np.full((len(nodes), 4), BULK * (J - 1)), np.zeros((0, 0, 3)))
        if among(scene.effects) is not None:
            state = replace(state, response=0 * state.displacement, response_pressure=0 * state.pressure)
        inside = {"fibres": stretched(fibres.points, number), "points": stretched(tets.points, number)}
        scalars = {"min_det_F_vertices": J}
        writer.add(Frame(number, stretched(setup.surface.points, number), state=state, scalars=scalars, **inside))
    writer.close(Outcome("converged", ""))
    return store.load(folder)


@pytest.fixture(scope="module")
def exported(compared, tmp_path_factory: pytest.TempPathFactory):
    folder = tmp_path_factory.mktemp("paraview") / "bar"
    assert "README.md" in paraview.write(compared[0], folder)
    return folder


def frame(folder, i: int) -> pyvista.MultiBlock:
    """What VTK reads of a frame."""
    reader = pyvista.PVDReader(folder / paraview.INDEX)
    reader.set_active_time_point(i)
    return reader.read()[0]


@pytest.mark.slow
def test_frames_have_their_times_and_blocks_their_names(compared, exported) -> None:
    reader = pyvista.PVDReader(exported / paraview.INDEX)
    assert reader.time_values == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])  # 20 ms from a frame number to the next
    for i in range(len(FRAMES)):
        blocks = frame(exported, i)
        assert blocks.keys() == ["reference", "candidates", "bones", "attachments"]
        assert blocks["reference"].keys() == ["muscle", "fibres", "interior"]
        assert blocks["candidates"].keys() == ["mine"]
        assert blocks["candidates"]["mine"].keys() == ["muscle", "fibres"]
        assert blocks["bones"].keys() == ["floor", "lid", "wall"]
        assert blocks["attachments"].keys() == ["origin", "insertion"]
        assert blocks["reference"]["muscle"].field_data["frame"] == FRAMES[i]
    assert frame(exported, 0)["attachments"]["origin"].n_cells == 32  # 4 x 4 squares
    assert compared[0].scene.frames.interval == pytest.approx(0.02)


@pytest.mark.slow
def test_warping_by_the_displacement_gives_the_run(compared, exported) -> None:
    result, tets = compared
    blocks = frame(exported, 2)
    for name, run in (("reference", result.reference), ("mine", result.candidates[0])):
        own = blocks["reference"] if name == "reference" else blocks["candidates"][name]
        assert np.abs(own["muscle"].points - result.setup.surface.points).max() == 0
        assert np.array_equal(own["muscle"].regular_faces, result.setup.surface.triangles)
        moved = own["muscle"].warp_by_vector("displacement").points
        assert moved == pytest.approx(run.positions[2], abs=1e-12)
    interior = blocks["reference"]["interior"].warp_by_vector("displacement")
    assert interior.points == pytest.approx(stretched(tets.points, 10), abs=1e-12)
    for bone in result.setup.bones:
        moved = blocks["bones"][bone.name].warp_by_vector("displacement").points
        assert moved == pytest.approx(apply(bone.pose(10), bone.surface.points), abs=1e-9)
    top = blocks["attachments"]["insertion"].warp_by_vector("displacement").points
    assert top[:, 2] == pytest.approx(np.full(25, 40 * STRETCH))


def test_stress_and_what_else_follows_from_the_state_is_that_of_the_closed_form(exported) -> None:
    truth = homogeneous.uniaxial(laws.neo_hooke(MU), BULK, STRETCH)
    J = np.linalg.det(truth.F)
    pull = truth.P[0, 0] * STRETCH / J
    expected = {
        "det_F": J,
        "pressure": BULK * (J - 1),
        "fibre_stretch": STRETCH,
        "fibre_stress": pull,
        "von_mises": pull,
    }
    own = frame(exported, 2)["reference"]
    for arrays in (own["interior"].cell_data, own["muscle"].point_data):
        for name, value in expected.items():
            assert np.asarray(arrays[name]) == pytest.approx(np.full(len(arrays[name]), value), rel=1e-7), name
    assert own["interior"].cell_data["det_F_at_worst_corner"].min() == pytest.approx(
        own["muscle"].field_data["min_det_F_vertices"][0]
    )
    assert frame(exported, 0)["reference"]["interior"].cell_data["von_mises"].max() < 1e-12


def test_contact_pressure_is_the_law_at_the_depth_in_a_wall(compared, exported) -> None:
    result, _ = compared
    muscle_block = frame(exported, 2)["reference"]["muscle"]
    depth = result.reference.positions[2][:, 0] - 5.0
    free = result.setup.free
    deep, outside = free & (depth > 0.1), free & (depth < -0.1)
    pressure = np.asarray(muscle_block.point_data["contact_pressure"])
    assert deep.sum() > 20
    assert outside.sum() > 20
    assert pressure[deep] == pytest.approx(STIFFNESS * depth[deep])
    assert not pressure[outside | ~free].any()
    gaps = np.asarray(muscle_block.point_data["distance_to_bones"])
    assert np.isnan(gaps[~free]).all()
    near = free & (np.abs(result.setup.surface.points[:, 2] - 20) < 5)  # of the wall alone
    assert gaps[near] == pytest.approx(-depth[near])


def test_distances_to_the_reference_and_its_error_bar(compared, exported) -> None:
    result, _ = compared
    arrays = frame(exported, 3)["candidates"]["mine"]["muscle"].point_data
    assert np.asarray(arrays["distance_to_reference"]) == pytest.approx(np.ones(len(result.setup.surface.points)))
    assert np.asarray(arrays["error_bar"]) == pytest.approx(np.full(len(result.setup.surface.points), 3.0))
    surface = frame(exported, 3)["reference"]["muscle"].warp_by_vector("displacement")
    moved = frame(exported, 3)["candidates"]["mine"]["muscle"].warp_by_vector("displacement")
    expected = moved.compute_implicit_distance(surface)["implicit_distance"]
    assert np.asarray(arrays["distance_to_reference_surface"]) == pytest.approx(np.asarray(expected), abs=1e-6)


def test_a_frame_that_a_run_did_not_reach_is_there_and_not_a_number(exported) -> None:
    own = frame(exported, 4)["candidates"]["mine"]["muscle"]
    assert not np.asarray(own.point_data["displacement"]).any()
    assert np.isnan(np.asarray(own.point_data["distance_to_reference"])).all()


def test_fibres_are_stretched_piece_by_piece(exported) -> None:
    lines = frame(exported, 2)["reference"]["fibres"]
    assert lines.n_lines == 2
    for values in (lines.point_data["fibre_stretch"], lines.cell_data["stretch_of_fibre"]):
        assert np.asarray(values) == pytest.approx(np.full(len(values), STRETCH))
    bent = Polylines(np.array([[0.0, 0, 0], [1, 0, 0], [3, 0, 0], [0, 5, 0], [0, 6, 0]]), [0, 3, 5])
    moved = bent.points * [2.0, 1, 1] + np.array([[0.0] * 3] * 2 + [[2.0, 0, 0]] + [[0.0] * 3] * 2)
    assert local_fields.stretch_along(bent, moved[None])[0] == pytest.approx([2, 8 / 3, 3, 1, 1])


def test_the_folder_must_be_free_and_options_fit_the_format(compared, tmp_path, capsys) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="which is not empty"):
        paraview.write(compared[0], tmp_path)
    assert cli.main(["export", "box_squeeze", "--to", str(tmp_path / "to"), "--candidate", "pbd"]) == cli.BAD_INPUT
    assert "want none of them: they are for paraview only" in capsys.readouterr().err


def test_blender_is_given_every_vertex_in_every_frame(compared, exported, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "paraview").symlink_to(exported)
    text = pages.snippet("docs/paraview.md", "POINTCACHE2").replace('"pelvis"', '"floor"').replace('"femur"', '"lid"')
    exec(compile(text, "docs/paraview.md", "exec"), {})
    result, rest = compared[0], compared[0].setup.surface
    data = (tmp_path / "blender" / "muscle.pc2").read_bytes()
    # https://docs.blender.org: modifier Mesh Cache; its reader expects these fields
    assert struct.unpack("<12siiffi", data[:32]) == (b"POINTCACHE2\0", 1, len(rest.points), 0.0, 1.0, len(FRAMES))
    positions = np.frombuffer(data[32:], "<f4").reshape(len(FRAMES), -1, 3)
    assert positions == pytest.approx(result.reference.positions, abs=1e-5)
    mesh = files.read_surface(tmp_path / "blender" / "muscle.ply", 1.0)
    assert np.array_equal(mesh.triangles, rest.triangles)
    assert mesh.points == pytest.approx(positions[0])
    blender = mock.MagicMock()
    monkeypatch.setitem(sys.modules, "bpy", blender)
    shown = pages.snippet("docs/paraview.md", "MESH_CACHE").replace("/path/to/blender", str(tmp_path / "blender"))
    exec(compile(shown, "docs/paraview.md", "exec"), {})
    imported = [Path(call.kwargs["filepath"]).name for call in blender.ops.wm.ply_import.call_args_list]
    assert imported == ["floor.ply", "lid.ply", "muscle.ply"]
    cache = blender.context.object.modifiers.new.return_value
    assert (cache.cache_format, cache.filepath) == ("PC2", str(tmp_path / "blender" / "muscle.pc2"))


@pytest.mark.skipif(not shutil.which("pvpython"), reason="ParaView is not installed")
def test_paraview_itself_opens_the_collection(exported) -> None:
    code = (
        "from paraview.simple import *\n"
        f"runs = OpenDataFile({str(exported / paraview.INDEX)!r})\n"
        "runs.UpdatePipeline(0.2)\n"
        "moved = WarpByVector(Input=runs, Vectors=['POINTS', 'displacement'])\n"
        "moved.UpdatePipeline(0.2)\n"
        "print(list(runs.TimestepValues), moved.GetDataInformation().GetNumberOfPoints() > 0)"
    )
    done = subprocess.run(["pvpython", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == "True"


def exported_with(folder: Path, bones: str, effects: str):
    """The small scene with more ``bones`` and ``effects``: its set-up, its run of closed form, and the muscle in frame 10."""
    small.write(folder / "bar")
    path = folder / "bar" / "case.toml"
    text = path.read_text().replace("[[attachment]]", f"{bones}\n[[attachment]]", 1)
    path.write_text(text.replace("[fibres]", f"{effects}\n[fibres]"))
    scene = casefile.read(folder / "bar")
    setup, mesh = muscle.setup(scene), shapes.box((2, 2, 4), (10, 10, 40))
    fibres = Polylines(np.column_stack([np.full((8, 2), 5.0), [1, 5, 10, 20, 2, 3, 4, 8]]), [0, 4, 8])
    run = written(folder / "run", scene, setup, TetMesh(mesh.points, mesh.tets), fibres)
    paraview.write(comparing.compare(scene, setup, run, (), None), folder / "out")
    return setup, run, frame(folder / "out", 2)["reference"]["muscle"].point_data


@pytest.mark.slow
def test_contact_pressure_is_that_of_the_bones_that_contact_names(tmp_path: Path) -> None:
    # A screen as deep in the muscle as the wall, from the other side, which contact leaves alone: it presses nothing.
    screen = 'name = "screen"\nhalf_space = { point = "5, 0, 0 mm", normal = [1, 0, 0] }\n'
    setup, run, arrays = exported_with(tmp_path, f"[[bone]]\n{WALL}\n[[bone]]\n{screen}", CONTACT)
    pressure = np.asarray(arrays["contact_pressure"])
    depth = run.positions[2][:, 0] - 5.0
    in_wall, in_screen = setup.free & (depth > 0.1), setup.free & (depth < -0.1)
    assert pressure[in_wall] == pytest.approx(STIFFNESS * depth[in_wall])
    assert pressure[in_screen].tolist() == [0.0] * max(21, in_screen.sum())


@pytest.mark.slow
def test_in_situ_no_pressure_is_shown_that_knows_nothing_of_rest(tmp_path: Path) -> None:
    """There bones press by what balances the tension, and by the change of gaps: the law of the whole gap is another pressure."""
    tense = '[[effect]]\nname = "in_situ"\nstretch = 1.1\n'
    _, _, arrays = exported_with(tmp_path, f"[[bone]]\n{WALL}", tense + CONTACT)
    assert ("distance_to_bones" in arrays, "contact_pressure" in arrays) == (True, False)
    assert "missing with `in_situ`" in (tmp_path / "out" / "README.md").read_text(encoding="utf-8")


def test_the_worst_corner_of_a_bent_tetrahedron_is_the_least() -> None:
    # u = c x^2 along x on nodes of degree 2: det F = 1 + 2 c x exactly, from 1 in the corner at 0 to 1 - 0.8 at x = 2.
    mesh = TetMesh(np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]]), np.array([[0, 1, 2, 3]]))
    weights = reference_nodes("tetrahedron", 2)
    nodes = np.column_stack([1 - weights.sum(axis=1), weights]) @ mesh.points
    moved = np.zeros((1, 10, 3))
    moved[0, :, 0] = -0.2 * nodes[:, 0] ** 2
    state = NodalState(moved, np.zeros((1, 0)), np.zeros((0, 0, 3)))
    made = Results(mesh, (), {0: state}, regions={"tendon": lambda points: points[:, 0] / 2})
    block = paraview.interior(made, 0)
    assert block.of_cells["det_F_at_worst_corner"] == pytest.approx([0.2])
    assert block.of_cells["det_F"] == pytest.approx([1 - 0.4 * 0.5])  # its middle is at x = 0.5
    assert block.of_cells["region_tendon"] == pytest.approx([0.25])
