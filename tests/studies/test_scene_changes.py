"""Scenes with one thing changed are other scenes, and all else in them stays."""

from pathlib import Path

import pytest
import small

from fem_reference.effects import make
from fem_reference.effects.contact import among
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.scene_changes import on_tetrahedra, with_contact, with_distances, with_reference


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
    assert with_reference(scene, first_step=0.5).reference.settings["first_step"] == 0.5
    halved = with_distances(scene, 0.5, "distance_error")
    assert [bone.distance_error for bone in halved.bone] == [0.5 * bone.distance_error for bone in scene.bone]
    assert [bone.distance_rounding for bone in halved.bone] == [bone.distance_rounding for bone in scene.bone]


def test_no_two_changes_have_one_key(scene: MuscleCase) -> None:
    found = (scene, on_tetrahedra(scene, tet_size=3.0), with_contact(scene, stiffness=0.4))
    assert len({one.key for one in (*found, with_distances(scene, 0.5, "distance_error"))}) == 4


def test_without_contact_none_comes(scene: MuscleCase) -> None:
    plain = scene.model_copy(update={"effect": scene.effect[:-1]})
    assert with_contact(plain, stiffness=1.0).effects == plain.effects
