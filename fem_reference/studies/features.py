"""Quantities known before a case is solved: features, by which cases are compared, and the expected cost of the reference."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from fem_reference.effects import moduli, region_of
from fem_reference.effects.contact import among
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.mesh import diagonal
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.problems.body import Body, Cells
from fem_reference.problems.setup import Setup
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers.fenicsx import resources
from fem_reference.solvers.fenicsx.settings import BodySettings

# Measured on hip_flexion: processor time [s] of a Newton iteration with this number of unknowns, the exponent with which the time
# grows with that number, and iterations per frame.
_SECONDS, _UNKNOWNS, _EXPONENT, _ITERATIONS = 0.13, 5456, 1.15, 4
# With contact between parts: the number of iterations in which attachments move by the length of a facet's edge (which limits load
# steps), and the additional processor time [s] of an iteration. Measured numbers of iterations: 12 in two_muscles, 23 on larger
# tetrahedra, 31 in hip_four_muscles.
_PER_EDGE, _CONTACT = 15, 0.1


class ExpectedCost(NamedTuple):
    """The number of ``unknowns`` of a problem, the processor time [s] of FEniCSx within a factor of three, and its memory [MB]."""

    unknowns: int
    seconds: float
    megabytes: float


def expected(body: Body, settings: Record) -> ExpectedCost:
    """The expected cost of solving a muscle as a ``body`` by FEniCSx with these ``settings``."""
    assert isinstance(settings, BodySettings)  # the settings of FEniCSx
    count = resources.unknowns(body.mesh, settings.element)
    chosen = resources.planned(settings, body.mesh, math.inf)
    wanted = sum(frame >= body.first for frame in body.frames)
    each, iterations = _SECONDS * float((count / _UNKNOWNS) ** _EXPONENT), float(_ITERATIONS * (wanted - 1))
    if sides := {name for law in body.touching if law.one != law.other for name in (law.one, law.other)}:
        each, iterations = each + _CONTACT, max(iterations, _PER_EDGE * _travel(body) / _edge(body.mesh, sides))
    memory = resources.memory(count, str(chosen.linear_solver), str(chosen.precision))
    return ExpectedCost(count, each * iterations, memory)


def _edge(mesh: Cells, regions: Iterable[str]) -> float:
    """The mean length [mm] of the edges of facets in ``regions``, from one edge of each facet."""
    ends = np.concatenate([mesh.points[mesh.facets[name][:, :2]] for name in regions])
    return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean())


def _travel(body: Body) -> float:
    """The length [mm] of the longest path of a point with a prescribed displacement, straight from each frame to the next."""
    paths = [0.0]
    for entry in body.prescribed:
        points = (
            body.mesh.points[np.unique(body.mesh.facets[entry.on])] if isinstance(entry.on, str) else entry.on.points
        )
        moved = np.diff([entry.displacements(points, frame) for frame in body.frames], axis=0)
        paths.append(float(np.linalg.norm(moved, axis=2).sum(axis=0).max(initial=0.0)))
    return max(paths)


def features(case: MuscleCase, setup: Setup) -> dict[str, float]:
    """Features of a case by name.

    ``size`` [mm]: the diagonal of the muscle's bounding box. ``triangles``: the number of triangles. ``motion`` [mm]: the maximum
    displacement of an attached vertex over frames. ``contact``: the number of bones with contact. ``bulk_to_shear`` and
    ``fibres_to_shear``: ratios of moduli outside regions, 0 without a shear modulus. ``tet_size`` [mm] and ``refinements``: those
    of the reference.
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
