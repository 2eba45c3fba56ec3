"""Open formats bring everything back: surfaces, tetrahedra, poses, attachments, and facts with their units."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import acting
import meshio
import numpy as np
import pytest

from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.common import open_formats

pytestmark = pytest.mark.slow


def rows(path: Path) -> list[list[str]]:
    with path.open(newline="") as table:
        return list(csv.reader(table))[1:]


def test_surfaces_and_fibres_come_back_to_the_bit(exported: Path, built: MuscleProblem) -> None:
    surfaces = [built.surface, *(bone.surface for bone in built.bones)]
    for name, surface in zip(("muscle.ply", "bones/0.ply", "bones/1.ply"), surfaces, strict=True):
        for points, triangles in (
            (meshio.read(exported / name).points, meshio.read(exported / name).cells_dict["triangle"]),
            (files.read_surface(exported / name, 1.0).points, files.read_surface(exported / name, 1.0).triangles),
        ):
            assert np.array_equal(points, surface.points)
            assert np.array_equal(triangles, surface.triangles)
    fibres = files.read_polylines(exported / "fibres.vtk", 1.0)
    assert np.array_equal(fibres.points, built.fibres.points)
    assert np.array_equal(fibres.offsets, built.fibres.offsets)


@pytest.mark.parametrize("name", ["tets.vtu", "tets.msh"])
def test_tets_and_fibre_directions_come_back_to_the_bit(exported: Path, built: MuscleProblem, name: str) -> None:
    mesh = meshio.gmsh.read(exported / name) if name.endswith("msh") else meshio.read(exported / name)
    assert np.array_equal(mesh.points, built.mesh.points)
    assert np.array_equal(mesh.cells_dict["tetra"], built.mesh.tets)
    assert np.array_equal(mesh.cell_data["fibre"][0], built.directions)


def test_poses_of_every_bone_and_frame(exported: Path, built: MuscleProblem) -> None:
    found = {
        (bone, int(frame)): np.reshape(row, (4, 4)).astype(float) for bone, frame, *row in rows(exported / "poses.csv")
    }
    assert len(found) == len(built.bones) * len(built.frames)
    for bone in built.bones:
        for frame in built.frames:
            assert np.array_equal(found[bone.name, frame], bone.pose(frame))


def test_what_is_attached(exported: Path, built: MuscleProblem) -> None:
    for attached in built.attached:
        vertices = [
            int(row[2])
            for row in rows(exported / "attachments.csv")
            if row[:2] == [attached.attachment, attached.bone.name]
        ]
        assert np.array_equal(vertices, attached.vertices)
        facets = [
            row[2:]
            for row in rows(exported / "attachment_facets.csv")
            if row[:2] == [attached.attachment, attached.bone.name]
        ]
        assert np.array_equal(np.array(facets, int), built.mesh.facets[attached.attachment])


def test_the_surface_lies_where_its_shares_of_the_tets_say(exported: Path, built: MuscleProblem) -> None:
    """1e-9 mm is rounding at 40 mm in flat tets, whose shares are large."""
    table = np.array(rows(exported / "surface_in_tets.csv"), float)
    corners = built.mesh.points[built.mesh.tets[table[:, 1].astype(int)]]
    assert np.array_equal(table[:, 0], np.arange(len(built.surface.points)))
    assert np.allclose(np.einsum("vi,vik->vk", table[:, 2:], corners), built.surface.points, rtol=0, atol=1e-9)


def test_the_scene_says_units_and_values(exported: Path, built: MuscleProblem) -> None:
    facts = json.loads((exported / "scene.json").read_text())
    assert facts["frames"] == [0, 5, 10, 15, 20]
    assert [effect["name"] for effect in facts["effects"]] == ["neo_hooke", "incompressible"]
    assert facts["effects"][0]["parameters"] == {"mu": {"value": 0.01, "unit": "MPa"}}  # 10 kPa
    floor, lid = facts["bones"]
    assert (floor["name"], floor["file"], floor["obstacle"]) == ("floor", "bones/0.ply", False)
    assert "motion" not in floor
    assert lid["motion"]["keyframes"][1] == {"frame": 10.0, "angle": 0.4}
    assert facts["mesh"]["tets"] == len(built.mesh.tets)


def test_springs_are_stated_in_the_unit_that_they_have(scene: MuscleCase, built: MuscleProblem) -> None:
    soft = casefile.read_muscle(scene.folder, changes={"attachment[0].stiffness": "250 kPa/mm"})
    facts = open_formats.facts(replace(built, attached=muscle.setup(soft).attached))
    assert facts["attachments"] == [
        {"name": "origin", "bone": "floor", "stiffness": 0.25, "unit": "MPa/mm"},
        {"name": "insertion", "bone": "lid", "stiffness": None, "unit": "MPa/mm"},
    ]


def test_bones_that_contact_names_are_obstacles(built: MuscleProblem) -> None:
    contact = parse(acting.effects.find("contact"), acting.PARAMETERS["contact"] | {"bones": ["lid"]}, "test")
    facts = open_formats.facts(replace(built, effects=(*built.effects, contact)))
    assert [bone["obstacle"] for bone in facts["bones"]] == [False, True]


@pytest.mark.parametrize("name", sorted(acting.PARAMETERS))
def test_every_effect_can_be_stated(built: MuscleProblem, name: str) -> None:
    effect = parse(acting.effects.find(name), acting.PARAMETERS[name], "test")
    (printed,) = open_formats.facts(replace(built, effects=(effect,)))["effects"]
    assert printed["name"] == name
    assert json.loads(json.dumps(printed, allow_nan=False))["parameters"].keys() == type(effect).model_fields.keys() - {
        "region"
    }


def test_regions_are_exported_with_what_acts_in_them(scene: MuscleCase, built: MuscleProblem, tmp_path: Path) -> None:
    table = {"name": "tendon", "width": "0 mm", "attachment": {"name": "origin", "length": "8 mm"}}
    laws = [{"name": "neo_hooke", "mu": mu, "in": at} for mu, at in (("1 kPa", "not tendon"), ("1 MPa", "tendon"))]
    volume = {"name": "incompressible", "bulk": "10 MPa"}
    there = casefile.read_muscle(scene.folder, changes={"region": [table], "effect": [*laws, volume]})
    problem = replace(built, effects=there.effects, regions=muscle.setup(there).regions)
    open_formats.write(problem, tmp_path, {})
    facts = json.loads((tmp_path / "scene.json").read_text())
    assert [effect.get("in") for effect in facts["effects"]] == ["not tendon", "tendon", None]
    assert facts["regions"] == ["tendon"]
    middles = built.mesh.points[built.mesh.tets].mean(axis=1)
    for name in ("tets.vtu", "tets.msh"):
        found = meshio.read(tmp_path / name).cell_data["region_tendon"][0]
        assert np.array_equal(found, problem.regions["tendon"](middles))
    assert 0 < found.mean() < 0.5
