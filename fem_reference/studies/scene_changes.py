"""Scenes with one thing changed: tetrahedra, contact, distances to bones, load steps."""

from typing import Any

from fem_reference.effects.contact import among
from fem_reference.scenes.muscle import MuscleCase


def on_tetrahedra(case: MuscleCase, **changes: float) -> MuscleCase:
    """The case with other keys of its muscle: ``tet_size`` [mm], ``refinements``."""
    return case.model_copy(update={"muscle": case.muscle.model_copy(update=changes)})


def with_contact(case: MuscleCase, **changes: float) -> MuscleCase:
    """The case with other parameters of its contact."""
    contact = among(case.effects)
    effects = (one.model_copy(update=changes) if one is contact else one for one in case.effects)
    return case.model_copy(update={"effect": tuple(effects)})


def with_distances(case: MuscleCase, factor: float, *keys: str) -> MuscleCase:
    """The case with ``keys`` of the distances to the surfaces of bones times ``factor``; closed forms are exact."""
    bones = (
        bone.model_copy(update={key: factor * getattr(bone, key) for key in keys}) if bone.surface else bone
        for bone in case.bone
    )
    return case.model_copy(update={"bone": tuple(bones)})


def with_reference(case: MuscleCase, **changes: Any) -> MuscleCase:
    """The case with other settings of its reference."""
    return case.model_copy(update={"reference": case.reference.model_copy(update=changes)})
