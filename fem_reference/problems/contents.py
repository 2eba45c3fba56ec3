"""The contents of a case in words and numbers, for a look before it is solved."""

from typing import Any

import numpy as np

from fem_reference.effects import Effect
from fem_reference.foundations.markup import exact
from fem_reference.foundations.mesh import Surface, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, Translation
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.problems.scalar import FieldProblem
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase


def of_muscle(setup: Setup, case: MuscleCase) -> dict[str, object]:
    """The muscle, its bones, attachments, effects and frames."""
    surface = setup.surface
    return {
        "muscle": {
            "triangles": len(surface.triangles),
            "volume_mm3": enclosed_volume(surface.points, surface.triangles),
            "tet_size_mm": case.muscle.tet_size,
            "refinements": case.muscle.refinements,
            "mesher": case.muscle.mesher,
        },
        "bones": {bone.name: f"{_shape(bone)}, {_motion(bone.motion)}" for bone in setup.bones},
        "attachments": {
            one.attachment: f"{len(one.vertices)} vertices, {_area(surface, one):.0f} mm2, attached to {one.bone.name} "
            + ("exactly" if one.stiffness is None else f"by springs of {one.stiffness:g} MPa/mm")
            for one in setup.attached
        },
        "effects": {effect.title: _parameters(effect) for effect in case.effects},
        **({"effects_chosen": [str(one) for one in case.decisions]} if case.decisions else {}),
        "frames": f"{case.frames.first} to {case.frames.last}, every {case.frames.every}",
    }


def of_field(setup: FieldProblem, case: Case) -> dict[str, object]:
    """The domain, the element, the weak form and the effects."""
    mesh, fixed = setup.mesh, int(np.isfinite(setup.fixed).sum())
    return {
        "domain": f"{len(mesh.cells)} cells, {len(mesh.points)} vertices, size {mesh.sizes.sum():.6g}",
        "element": f"P{setup.order}, {len(setup.fixed)} nodes, {fixed} fixed",
        "form": f"{setup.form}, mesh Peclet number up to {setup.peclet:.3g}",
        "effects": {
            title: {name: str(value) for name, value in effect.model_dump().items()}
            for title, effect in case.acting.items()
        },
    }


def _area(surface: Surface, attached: AttachedVertices) -> float:
    return attached_area(surface, attached_shares(surface, attached.vertices))


def _parameters(effect: Effect) -> dict[str, str]:
    return {name: f"{exact(value)} {unit}".rstrip() for name, value, unit in effect.parameters}


def _shape(bone: Bone) -> str:
    """The number of triangles of a bone's surface, or its closed form."""
    if bone.solid is None:
        return f"{len(bone.surface.triangles)} triangles"
    kind = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in type(bone.solid).__name__)
    values = ", ".join(f"{name} {_number_or_three(value)}" for name, value in vars(bone.solid).items())
    return f"{kind.strip()} of {values}, mm"


def _number_or_three(value: Any) -> str:
    return f"({', '.join(f'{entry:g}' for entry in value)})" if isinstance(value, tuple) else f"{value:g}"


def _motion(motion: RigidMotion | None) -> str:
    if motion is None:
        return "rests"
    if isinstance(motion, Translation):
        stops = zip(motion.frames, motion.distances, strict=True)
        keys = ", ".join(f"{distance:g} at {frame:g}" for frame, distance in stops)
        return f"slides along {_number_or_three(motion.direction)}, mm at frame: {keys}"
    x, y, z = motion.centre
    keys = ", ".join(f"{angle:g} at {frame:g}" for frame, angle in zip(motion.frames, motion.angles, strict=True))
    return f"turns about ({x:g}, {y:g}, {z:g}) mm along {motion.axis}, rad at frame: {keys}"
