"""Scenes with one thing changed: tetrahedra, contact, distances to bones, load steps."""

from typing import Any

from fem_reference.effects.contact import among
from fem_reference.scenes.muscle import MuscleCase


def on_tetrahedra(scene: MuscleCase, **changes: float) -> MuscleCase:
    """The scene with other keys of its muscle: ``tet_size`` [mm], ``refinements``."""
    return scene.model_copy(update={"muscle": scene.muscle.model_copy(update=changes)})


def with_contact(scene: MuscleCase, **changes: float) -> MuscleCase:
    """The scene with other parameters of its contact."""
    contact = among(scene.effects)
    effects = (one.model_copy(update=changes) if one is contact else one for one in scene.effects)
    return scene.model_copy(update={"effect": tuple(effects)})


def with_distances(scene: MuscleCase, factor: float, *keys: str) -> MuscleCase:
    """The scene with ``keys`` of the distances to the surfaces of bones times ``factor``; closed forms are exact."""
    bones = (
        bone.model_copy(update={key: factor * getattr(bone, key) for key in keys}) if bone.surface else bone
        for bone in scene.bone
    )
    return scene.model_copy(update={"bone": tuple(bones)})


def with_reference(scene: MuscleCase, **changes: Any) -> MuscleCase:
    """The scene with other settings of its reference."""
    return scene.model_copy(update={"reference": scene.reference.model_copy(update=changes)})
