"""What a case is made of, in words and numbers: what ``show`` tells."""

from typing import Any

from fem_reference.effects import Effect
from fem_reference.mesh import enclosed_volume, vertex_areas
from fem_reference.motion import Rotation
from fem_reference.problem import Setup
from fem_reference.report.page import effect_parameters
from fem_reference.scene import Scene


def scene_facts(scene: Scene, setup: Setup) -> dict[str, Any]:
    """Everything that a person asks of a case before solving it, as words and numbers by name."""
    surface = setup.surface
    areas = vertex_areas(surface.points, surface.triangles)
    return {
        "case": scene.name,
        "title": scene.title,
        "proves": scene.proves,
        "muscle": {
            "triangles": len(surface.triangles),
            "volume_mm3": enclosed_volume(surface.points, surface.triangles),
            "tet_size_mm": scene.muscle.tet_size,
        },
        "bones": {
            bone.name: f"{len(bone.surface.triangles)} triangles, {_motion(bone.motion)}" for bone in setup.bones
        },
        "attachments": {
            held.attachment: f"{len(held.vertices)} vertices, {areas[held.vertices].sum():.0f} mm2, held by {held.bone.name}"
            for held in setup.held
        },
        "effects": {type(effect).__name__: _parameters(effect) for effect in scene.effects},
        "frames": f"{scene.frames.first} to {scene.frames.last}, every {scene.frames.every}",
        "reference": scene.reference.solver,
        "candidates": {candidate.name: candidate.solver for candidate in scene.candidate},
        "expects": [
            f"{e.of} {e.metric} {e.statistic} at frame {e.frame}: {e.truth} within {e.within} ({e.kind})"
            for e in scene.expect
        ],
    }


def _parameters(effect: Effect) -> dict[str, str]:
    return {name: f"{value:g} {unit}" for name, value, unit in effect_parameters(effect)}


def _motion(motion: Rotation | None) -> str:
    if motion is None:
        return "rests"
    x, y, z = motion.centre
    keys = ", ".join(f"{angle:g} at {frame:g}" for frame, angle in zip(motion.frames, motion.angles, strict=True))
    return f"turns about ({x:g}, {y:g}, {z:g}) mm along {motion.axis}, rad at frame: {keys}"
