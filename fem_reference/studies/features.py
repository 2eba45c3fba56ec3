"""Numbers known about a case before it is solved: features, by which cases are compared, and the cost of its reference."""

import math
from typing import NamedTuple

import numpy as np

from fem_reference.effects import moduli, region_of
from fem_reference.effects.contact import among
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.mesh import diagonal
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.problems.body import Body
from fem_reference.problems.setup import Setup
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.fenicsx import resources
from fem_reference.solvers.fenicsx.settings import BodySettings

# Measured on hip_flexion: processor time [s] of a Newton iteration with this number of unknowns, the exponent with which it grows,
# and iterations per frame.
_SECONDS, _UNKNOWNS, _EXPONENT, _ITERATIONS = 0.13, 5456, 1.15, 4


class ExpectedCost(NamedTuple):
    """The size of a problem, the processor time [s] that FEniCSx takes for it, within a factor of three, and its memory [MB]."""

    unknowns: int
    seconds: float
    megabytes: float


def expected(body: Body, settings: Record) -> ExpectedCost:
    """The cost of a muscle as a ``body`` by FEniCSx with these ``settings``."""
    assert isinstance(settings, BodySettings)  # the settings of FEniCSx
    count = resources.unknowns(body.mesh, settings.element)
    chosen = resources.planned(settings, body.mesh, math.inf)
    wanted = sum(frame >= body.first for frame in body.frames)
    seconds = _SECONDS * float((count / _UNKNOWNS) ** _EXPONENT) * _ITERATIONS * (wanted - 1)
    return ExpectedCost(count, seconds, resources.memory(count, str(chosen.linear_solver), str(chosen.precision)))


def features(case: MuscleCase, setup: Setup) -> dict[str, float]:
    """``size`` [mm], the diagonal of the muscle's box; ``triangles``; ``motion`` [mm], the greatest displacement of an
    attached vertex over the frames; ``contact``, the number of obstacles; ``bulk_to_shear`` and ``fibres_to_shear`` of the
    material without its regions, 0 if it has none; ``tet_size`` [mm] and ``refinements`` of the reference.
    """
    points = setup.surface.points
    moved = [
        np.linalg.norm(apply(entry.bone.pose(number), points[entry.vertices]) - points[entry.vertices], axis=1).max()
        for entry in setup.attached
        for number in setup.frames
        if len(entry.vertices)
    ]
    contact = among(case.effects)
    everywhere = [effect for effect in case.effects if not (region := region_of(effect)) or region.startswith(REST)]
    shear, bulk, fibres = moduli(everywhere or case.effects)
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
