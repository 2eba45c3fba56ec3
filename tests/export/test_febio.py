"""FEBio's file of a scene: well formed, every name in it there, its elements and curves those of the scene.

FEBio is not here: its conventions (numbering, order of nodes, laws) are written down in these tests once more, from its manual.
"""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import acting
import meshio
import numpy as np
import pytest
import small
from feb_file import FRAMES, TURNS, cells, effects, nodes, numbers
from scipy.spatial.transform import Rotation as Turn

from fem_reference import export
from fem_reference.effects import total_energy
from fem_reference.export import febio, febio_material
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import apply
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase


def test_the_sections_are_those_of_the_format(feb: Element) -> None:
    assert feb.attrib == {"version": "4.0"}
    sections = "Module Control Material Mesh MeshDomains MeshData Boundary Rigid Contact LoadData Output"
    assert [section.tag for section in feb] == sections.split()


def test_what_is_empty_is_written_short(bar: MuscleProblem, tmp_path: Path) -> None:
    """FEBio takes ``<Module type="solid"></Module>`` for the beginning of a list (FEBioModuleSection.cpp)."""
    febio.write(bar, tmp_path)
    text = (tmp_path / "scene.feb").read_text()
    assert '<Module type="solid" />' in text
    assert "></" not in text


def test_numbers_are_used_once_and_every_node_is_there(feb: Element) -> None:
    elements = [int(cell.attrib["id"]) for cell in feb.iterfind("Mesh/Elements/elem")]
    assert elements == list(range(1, len(elements) + 1))
    count = len(nodes(feb)) - 1
    for cell in feb.iterfind("Mesh/Elements/elem"):
        wanted = {"tet10": 10, "tri3": 3}[
            next(group for group in feb.iterfind("Mesh/Elements") if cell in group).attrib["type"]
        ]
        assert len(set(numbers(cell))) == wanted
        assert all(1 <= number <= count for number in numbers(cell))
    used = {int(number) for cell in feb.iterfind("Mesh/Elements/elem") for number in numbers(cell)}
    assert used == set(range(1, count + 1))


def test_every_name_that_is_used_is_there(feb: Element) -> None:
    def named(path: str, key: str = "name") -> set[str]:
        return {entry.attrib[key] for entry in feb.iterfind(path)}

    def texts(path: str) -> set[str | None]:
        return {entry.text for entry in feb.iterfind(path)}

    materials, domains = named("Material/material"), named("MeshDomains/*")
    rigid = {entry.attrib["name"] for entry in feb.iterfind("Material/material[@type='rigid body']")}
    assert rigid == {"bone_bottom", "bone_top", "bone_rests & <waits>"}
    assert domains == named("Mesh/Elements")
    assert named("MeshDomains/*", "mat") <= materials
    assert named("MeshData/ElementData", "elem_set") <= domains
    assert named("Boundary/bc", "node_set") == named("Mesh/NodeSet")
    assert texts(".//rb") <= rigid
    assert named("Contact/contact", "surface_pair") == named("Mesh/SurfacePair")
    assert texts("Mesh/SurfacePair/*") == named("Mesh/Surface")
    curves = {entry.attrib["id"] for entry in feb.iterfind("LoadData/load_controller")}
    assert {entry.attrib["lc"] for entry in feb.iterfind(".//*[@lc]")} == curves
    assert named("Output/logfile/node_data", "node_set") <= named("Mesh/Nodes")
    assert len(materials) == len({entry.attrib["id"] for entry in feb.iterfind("Material/material")})


def pose(feb: Element, name: str, time: float) -> np.ndarray:
    """Where FEBio has a rigid body: turned about its centre of mass by a rotation vector, then displaced; each component a value
    times its load curve.
    """
    parts = dict.fromkeys(("x", "y", "z", "Ru", "Rv", "Rw"), 0.0)
    for entry in feb.iterfind("Rigid/rigid_bc"):
        if entry.find("rb").text != name or entry.attrib["type"] == "rigid_fixed":
            continue
        value = entry.find("value")
        curve = feb.find(f"LoadData/load_controller[@id='{value.attrib['lc']}']")
        assert curve.find("interpolate").text == "LINEAR"
        times, scales = zip(*map(numbers, curve.iterfind("points/pt")), strict=True)
        assert entry.attrib["type"] == ("rigid_rotation" if entry.find("dof").text[0] == "R" else "rigid_displacement")
        parts[entry.find("dof").text] = float(value.text) * np.interp(time, times, scales)
    centre = np.array(numbers(feb.find(f"Material/material[@name='{name}']/center_of_mass")))
    x, y, z, *vector = parts.values()
    matrix = np.eye(4)
    matrix[:3, :3] = Turn.from_rotvec(vector).as_matrix()
    matrix[:3, 3] = centre + [x, y, z] - matrix[:3, :3] @ centre
    return matrix


def test_load_curves_are_the_poses(feb: Element, bar: MuscleProblem) -> None:
    """At frames, between them and at keyframes beside them."""
    for bone in bar.bones:
        for frame in (*FRAMES, 11.3, 12.5, 18.0, 22.2):
            assert np.allclose(pose(feb, f"bone_{bone.name}", frame - 10), bone.pose(frame), rtol=0, atol=1e-13)


def test_every_freedom_of_a_bone_is_fixed_or_moved(feb: Element, bar: MuscleProblem) -> None:
    for bone in bar.bones:
        mine = [entry for entry in feb.iterfind("Rigid/rigid_bc") if entry.find("rb").text == f"bone_{bone.name}"]
        fixed = [
            one.tag.removesuffix("_dof")
            for entry in mine
            for one in entry
            if one.tag.endswith("_dof") and one.text == "1"
        ]
        moved = [entry.find("dof").text for entry in mine if entry.find("dof") is not None]
        freedoms = fixed + [f"R{name}" if len(name) == 1 else name for name in moved]
        assert sorted(freedoms) == ["Ru", "Rv", "Rw", "Rx", "Ry", "Rz"]


def test_febio_passes_every_frame_wanted(feb: Element) -> None:
    must = feb.find("LoadData/load_controller[@id='1']")
    assert [numbers(point)[0] for point in must.iterfind("points/pt")] == [0, 5, 10, 15]
    assert must.find("interpolate").text == "STEP"
    control = feb.find("Control")
    steps, size = (float(control.find(key).text) for key in ("time_steps", "step_size"))
    assert steps * size == pytest.approx(FRAMES[-1] - FRAMES[0], rel=1e-15)
    assert control.find("time_stepper/dtmax").attrib["lc"] == "1"


@pytest.mark.parametrize(
    ("frames", "step", "count"), [((0, 10, 20), 2, 10), ((0, 1, 2), 1, 2), ((10, 15, 20), 5 / 3, 6), ((3, 7), 2, 2)]
)
def test_steps_are_two_frames_or_what_is_shorter_and_goes_up_evenly(
    bar: MuscleProblem, frames: tuple[int, ...], step: float, count: int
) -> None:
    feb = febio.model(replace(bar, frames=frames))
    control = feb.find("Control")
    assert float(control.find("step_size").text) == float(control.find("time_stepper/dtmax").text) == step
    assert int(control.find("time_steps").text) == count
    longest = [numbers(point)[1] for point in feb.iterfind("LoadData/load_controller[@id='1']/points/pt")]
    assert set(longest) == {step}


def test_what_febio_does_where_a_step_fails_and_when_it_stops(feb: Element) -> None:
    stepper, solver = feb.find("Control/time_stepper"), feb.find("Control/solver")
    wanted = {"max_retries": 20, "aggressiveness": 1, "cutback": 0.5}
    assert {key: float(stepper.find(key).text) for key in wanted} == wanted
    assert {key: float(solver.find(key).text) for key in ("dtol", "etol")} == {"dtol": 1e-4, "etol": 1e-5}


@pytest.mark.parametrize("moving", [("bottom",), ("top",), ("bottom", "top"), ()])
def test_load_controllers_are_numbered_without_gaps(bar: MuscleProblem, moving: tuple[str, ...]) -> None:
    """FEBio refuses an id that its list has no place for: here as well where the first bone rests."""
    bones = tuple(bone if bone.name in moving else replace(bone, motion=None) for bone in bar.bones)
    attached = tuple(replace(attached, bone=bones[i]) for i, attached in enumerate(bar.attached))
    feb = febio.model(replace(bar, bones=bones, attached=attached))
    ids = [int(curve.attrib["id"]) for curve in feb.iterfind("LoadData/load_controller")]
    assert ids == list(range(1, len(moving) + 2))
    for bone in bones:
        for frame in (*FRAMES, 12.5):
            assert np.allclose(pose(feb, f"bone_{bone.name}", frame - 10), bone.pose(frame), rtol=0, atol=1e-13)


def test_fibres_are_the_first_axis_of_each_element(feb: Element, bar: MuscleProblem) -> None:
    axes = list(feb.iterfind("MeshData/ElementData[@type='mat_axis'][@elem_set='muscle']/e"))
    assert [int(entry.attrib["lid"]) for entry in axes] == list(range(1, len(bar.mesh.tets) + 1))
    along, across = (np.array([numbers(entry.find(axis)) for entry in axes]) for axis in "ad")
    assert np.array_equal(along, bar.directions)
    assert np.allclose(np.einsum("ij,ij->i", along, across), 0, atol=1e-15)
    assert np.allclose(np.linalg.norm(across, axis=1), 1, atol=1e-15)
    assert feb.find("Material/material[@name='muscle']/fiber/vector").text == "1,0,0"


@pytest.mark.parametrize("matrix", [("neo_hooke",), ("mooney_rivlin",), ("neo_hooke", "mooney_rivlin")])
def test_the_law_is_the_same(matrix: tuple[str, ...]) -> None:
    """FEBio's energy c1 (I1 - 3) + c2 (I2 - 3) + k/2 (J - 1)^2 with its constants, of the isochoric invariants of eigenvalues."""
    acts = effects(*matrix, "incompressible_penalty")
    constants = febio_material.matrix_constants(acts) | febio_material.volume_constants(acts)
    assert constants["pressure_model"] == 2
    for state in map(acting.state, acting.deformations()):
        squares = np.linalg.eigvalsh(np.array(state.C, float))
        J = np.sqrt(squares.prod())
        a, b, c = squares * J ** (-2 / 3)
        energy = (
            constants["c1"] * (a + b + c - 3)
            + constants["c2"] * (a * b + b * c + c * a - 3)
            + constants["k"] / 2 * (J - 1) ** 2
        )
        ours = total_energy([(effect, 1.0) for effect in acts], state)
        assert energy == pytest.approx(ours, rel=1e-9)


def test_constants_of_fibres_and_kind_of_element(feb: Element, bar: MuscleProblem) -> None:
    muscle = feb.find("Material/material[@name='muscle']")
    assert muscle.attrib["type"] == "trans iso Mooney-Rivlin"
    found = {entry.tag: float(entry.text) for entry in muscle if entry.tag != "fiber"}
    assert found == {"pressure_model": 2, "k": 10, "c1": 0.005, "c2": 0, "c3": 0.01, "c4": 12, "c5": 3, "lam_max": 1.3}
    assert feb.find("MeshDomains/SolidDomain").attrib["type"] == "three-field-solid"
    plain = febio.model(replace(bar, effects=effects("neo_hooke", "incompressible_penalty"), fibre=None))
    assert plain.find("Material/material[@name='muscle']").attrib["type"] == "Mooney-Rivlin"
    assert plain.find("MeshDomains/SolidDomain").attrib["type"] == "elastic-solid"
    assert plain.find("Contact") is None
    assert plain.find("MeshData") is None


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return small.write(tmp_path_factory.mktemp("case") / "bar")


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        (
            {"effect[0]": {"name": "fibre_active", **acting.PARAMETERS["fibre_active"]}},
            r'effect\[0\]: got "fibre_active", want an effect that FEBio has in the same form: neo_hooke',
        ),
        ({"effect[0]": {"name": "contact", "stiffness": "1 kPa/mm"}}, "effect: got no matrix: neither neo_hooke"),
        ({"effect[1]": {"name": "contact", "stiffness": "1 kPa/mm"}}, "effect: got neither incompressible nor"),
    ],
)
def test_what_febio_has_not_is_refused_before_any_work(
    folder: Path, tmp_path: Path, changes: dict[str, Any], match: str
) -> None:
    scene = casefile.read(folder, changes=changes)
    assert isinstance(scene, MuscleCase)
    with pytest.raises(InputError, match=match):
        export.export(scene, lambda: pytest.fail("built"), tmp_path / "bar", "febio")
    assert list(tmp_path.iterdir()) == []


def test_frames_come_back_from_febios_log(folder: Path, bar: MuscleProblem, tmp_path: Path) -> None:
    """Its quadratic elements show a quadratic motion exactly; so does every vertex of the surface, wherever in a tet it lies."""
    scene = casefile.read(folder)
    assert isinstance(scene, MuscleCase)
    inside = bar.surface.moved_to(5 + 0.9 * (bar.surface.points - 5))  # no vertex where a node is
    export.export(scene, lambda: replace(bar, surface=inside, bones=bar.bones[:2]), tmp_path / "bar", "febio")
    feb = ElementTree.parse(tmp_path / "bar" / "scene.feb").getroot()
    positions = nodes(feb)[1 : 1 + cells(feb, "muscle").max()]

    def moved(points: np.ndarray, time: float) -> np.ndarray:
        bent = time / 1e4 * np.stack([points[:, 1] ** 2, points[:, 0] * points[:, 2], points[:, 2] ** 2], axis=1)
        return apply(TURNS.pose(10 + time), points) + bent

    log = ""
    for step, time in enumerate((5, 10, 15), start=1):
        rows = (",".join([str(i), *map(repr, row)]) for i, row in enumerate(moved(positions, time).tolist(), start=1))
        log += f"*Step  = {step}\n*Time  = {time}\n*Data  = x;y;z\n" + "\n".join(rows) + "\n"
    (tmp_path / "bar" / "nodes.txt").write_text(log)
    (block,) = re.findall(r"```python\n(.*?)```", (tmp_path / "bar" / "FEBIO.md").read_text(), re.DOTALL)
    subprocess.run([sys.executable, "-I", "-W", "error", "-c", block], cwd=tmp_path / "bar", check=True)
    assert json.loads((tmp_path / "bar" / "scene.json").read_text())["frames"] == list(FRAMES)
    for frame in FRAMES:
        back = meshio.read(tmp_path / "bar" / "febio_frames" / f"frame_{frame:04d}.ply")
        assert np.allclose(back.points, moved(inside.points, frame - 10), rtol=0, atol=1e-10)
        assert np.array_equal(back.cells_dict["triangle"], inside.triangles)
