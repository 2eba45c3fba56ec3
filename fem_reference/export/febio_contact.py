"""Contact with bones and springs of attachments in FEBio's input file.

FEBio's ``tied-elastic`` pulls with a traction: its penalty times the vector from a point of the first surface to the point of the
second that was nearest at rest. It integrates over the first surface as that is now: a rigid copy of the area attached, which keeps
its rest area. So it is the springs of an attachment: their stiffness per rest area, the same in all directions.
"""

from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference.export.febio_material import matrix_constants
from fem_reference.export.febio_mesh import (
    EDGES,
    bone_id,
    by_springs,
    free_facets,
    leaves,
    obstacles,
    outward,
    springs_id,
)
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.problems.muscle import MuscleProblem

SEARCH_RADIUS = 5.0  # [mm]: contact is not looked for deeper than this inside a bone
# Shear moduli of the matrix with which an overlap at rest may press at once: in gluteus_maximus_anatomical, where it is up to 34 of
# them, FEBio never took its first step with a search radius of 5 mm, and 0.1 mm, which is 10 of them, helped.
_AT_ONCE = 10.0
SPRING_SEARCH_RADIUS = 1.0  # [mm]: at rest the two surfaces of springs coincide
# By penalty alone, in one pass, the penalty as it is given, with the whole tangent.
PENALTY = {"laugon": 0, "two_pass": 0, "auto_penalty": 0, "symmetric_stiffness": 0}


def has_contact(problem: MuscleProblem) -> bool:
    """True where the file has a section ``Contact``, whose tangent is not symmetric."""
    return bool(obstacles(problem) or by_springs(problem))


def add_contact(root: Element, problem: MuscleProblem) -> None:
    """The section ``Contact``, where something acts between surfaces."""
    if not has_contact(problem):
        return
    contacts = SubElement(root, "Contact")
    for attached in by_springs(problem):
        settings = {"penalty": attached.stiffness, "search_radius": SPRING_SEARCH_RADIUS}
        _pair(contacts, "tied-elastic", springs_id(attached), settings)
    deep = overlaps(problem)
    for bone in obstacles(problem):
        assert problem.contact is not None  # or there is no contact
        radius = search_radius(problem, deep[bone.name])
        settings = {"penalty": problem.contact.stiffness, "search_radius": radius, "fric_coeff": 0.0}
        _pair(contacts, "sliding-elastic", bone_id(bone), settings)


def _pair(contacts: Element, kind: str, name: str, settings: dict[str, float | None]) -> None:
    """A contact of a ``kind`` between the surfaces of the pair of this name."""
    entry = SubElement(contacts, "contact", name=f"{name}_contact", type=kind, surface_pair=f"{name}_pair")
    leaves(entry, {**PENALTY, **settings})


def overlaps(problem: MuscleProblem) -> dict[str, float]:
    """Depths [mm] by bone in contact of the facets of the contact surface inside it at rest: at corners and middles; 0 outside."""
    if not obstacles(problem):
        return {}
    corners = problem.mesh.points[free_facets(problem)]
    middles = corners[:, EDGES[:3]].mean(axis=2)
    points = np.concatenate([corners, middles, corners.mean(axis=1, keepdims=True)], axis=1).reshape(-1, 3)
    inside = ((bone.name, -signed_distances(points, outward(bone.surface))) for bone in obstacles(problem))
    return {name: float(depths.max(initial=0.0)) for name, depths in inside}


def search_radius(problem: MuscleProblem, deep: float) -> float:
    """Depth [mm] inside a bone to which FEBio looks for contact, where the muscle is ``deep`` [mm] in it at rest: less where that
    would press at once with more than the matrix bears.
    """
    assert problem.contact is not None  # or there is no contact
    matrix = matrix_constants(problem.effects)
    bears = _AT_ONCE * 2 * (matrix["c1"] + matrix["c2"]) / problem.contact.stiffness
    return min(SEARCH_RADIUS, bears) if deep > bears else SEARCH_RADIUS
