"""Features of a case, as numbers known before it is solved: by them cases are compared."""

import numpy as np

from fem_reference.effects import moduli
from fem_reference.effects.contact import among
from fem_reference.foundations.mesh import diagonal
from fem_reference.foundations.motion import apply
from fem_reference.problems.setup import Setup
from fem_reference.scenes.muscle import MuscleCase


def features(case: MuscleCase, setup: Setup) -> dict[str, float]:
    """``size`` [mm], the diagonal of the muscle's box; ``triangles``; ``motion`` [mm], the greatest displacement of an
    attached vertex over the frames; ``contact``, how many bones may press; ``bulk_to_shear`` and ``fibres_to_shear`` of the
    material, 0 where it has none; ``tet_size`` [mm] and ``refinements`` of the reference.
    """
    points = setup.surface.points
    moved = [
        np.linalg.norm(apply(entry.bone.pose(number), points[entry.vertices]) - points[entry.vertices], axis=1).max()
        for entry in setup.attached
        for number in setup.frames
        if len(entry.vertices)
    ]
    contact = among(case.effects)
    shear, bulk, fibres = moduli(case.effects)
    pressing = 0 if contact is None else len(case.bone if contact.bones is None else contact.bones)
    return {
        "size": diagonal(points),
        "triangles": float(len(setup.surface.triangles)),
        "motion": float(max(moved, default=0.0)),
        "contact": float(pressing),
        "bulk_to_shear": bulk / shear if shear else 0.0,
        "fibres_to_shear": fibres / shear if shear else 0.0,
        "tet_size": float(case.muscle.tet_size),
        "refinements": float(case.muscle.refinements),
    }
