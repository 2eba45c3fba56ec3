"""Cases with one thing changed are other cases, and all else in them stays."""

from pathlib import Path

import numpy as np
import pytest
import shapes
import small

from fem_reference.effects import make
from fem_reference.effects.contact import among
from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench
from fem_reference.studies.scene_changes import nearest_vertices, on_tetrahedra, resample, with_contact, with_distances


@pytest.fixture
def scene(tmp_path: Path) -> MuscleCase:
    """The small scene with contact."""
    found = casefile.read_muscle(small.write(tmp_path / "bar"))
    contact = make("contact", stiffness="100 kPa/mm", bones=(found.bone[0].name,))
    return found.model_copy(update={"effect": (*found.effect, contact)})


def test_only_what_is_named_changes(scene: MuscleCase) -> None:
    assert on_tetrahedra(scene, tet_size=3.0).muscle == scene.muscle.model_copy(update={"tet_size": 3.0})
    stiffer = with_contact(scene, stiffness=0.4)
    assert among(stiffer.effects).stiffness == 0.4
    assert stiffer.effects[:-1] == scene.effects[:-1]
    halved = with_distances(scene, 0.5, "distance_error")
    assert [bone.distance_error for bone in halved.bone] == [0.5 * bone.distance_error for bone in scene.bone]
    assert [bone.distance_rounding for bone in halved.bone] == [bone.distance_rounding for bone in scene.bone]


def test_no_two_changes_have_one_key(scene: MuscleCase) -> None:
    found = (scene, on_tetrahedra(scene, tet_size=3.0), with_contact(scene, stiffness=0.4))
    assert len({one.key for one in (*found, with_distances(scene, 0.5, "distance_error"))}) == 4


def test_without_contact_none_comes(scene: MuscleCase) -> None:
    plain = scene.model_copy(update={"effect": scene.effect[:-1]})
    assert with_contact(plain, stiffness=1.0).effects == plain.effects


def test_it_can_be_set_up_from_a_folder_outside_the_case(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "case" / "bar"))
    rest = muscle.setup(scene)
    coarse = muscle.setup(resample(scene, rest, -1, tmp_path / "elsewhere"))
    assert len(coarse.surface.triangles) < 0.5 * len(rest.surface.triangles)
    assert [one.attachment for one in coarse.attached] == [one.attachment for one in rest.attached]


def test_a_vertex_is_attached_where_the_nearest_is() -> None:
    """Points beside the vertices of a ball, each nearer to one of them than to any other."""
    ball = shapes.sphere(1, 10.0)
    beside = ball.points * 1.02 + np.random.default_rng(5).uniform(-0.3, 0.3, ball.points.shape)
    assert np.array_equal(nearest_vertices(ball, beside), np.arange(len(ball.points)))


def test_a_resampled_scene_has_one_key_wherever_its_study_is(tmp_path: Path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    keys, runs = set(), set()
    for name in ("here", "elsewhere"):
        bench = Bench(scene, tmp_path / name)
        other = resample(scene, bench.setup(), -1, tmp_path / name / "surfaces")
        keys.add(other.key)
        runs.add(Bench(other, tmp_path / name).folder(other.candidate[0], "candidate[0]").name)
    assert len(keys) == len(runs) == 1
    assert keys != {scene.key}
