"""Contact with bones and springs of attachments in FEBio's input file.

FEBio's ``tied-elastic`` pulls with a traction: its penalty times the vector from a point of the first surface to the point of the
second that was nearest at rest. It integrates over the first surface as that is now: a rigid copy of the area attached, which keeps
its rest area. So it is the springs of an attachment: their stiffness per rest area, the same in all directions.
"""

from xml.etree.ElementTree import Element, SubElement

from fem_reference.export.febio_mesh import bone_id, by_springs, leaf, obstacles, springs_id
from fem_reference.problems.muscle import Problem

SEARCH_RADIUS = 5.0  # [mm]: contact is not looked for deeper than this inside a bone
SPRING_SEARCH_RADIUS = 1.0  # [mm]: at rest the two surfaces of springs coincide
# By penalty alone, in one pass, the penalty as it is given, with the whole tangent.
PENALTY = {"laugon": 0, "two_pass": 0, "auto_penalty": 0, "symmetric_stiffness": 0}


def has_contact(problem: Problem) -> bool:
    """Whether the file has a section ``Contact``, whose tangent is not symmetric."""
    return bool(obstacles(problem) or by_springs(problem))


def add_contact(root: Element, problem: Problem) -> None:
    """The section ``Contact``, where something acts between surfaces."""
    if not has_contact(problem):
        return
    contacts = SubElement(root, "Contact")
    for attached in by_springs(problem):
        settings = {"penalty": attached.stiffness, "search_radius": SPRING_SEARCH_RADIUS}
        _pair(contacts, "tied-elastic", springs_id(attached), settings)
    for bone in obstacles(problem):
        assert problem.contact is not None  # or there is no contact
        settings = {"penalty": problem.contact.stiffness, "search_radius": SEARCH_RADIUS, "fric_coeff": 0.0}
        _pair(contacts, "sliding-elastic", bone_id(bone), settings)


def _pair(contacts: Element, kind: str, name: str, settings: dict[str, float | None]) -> None:
    """A contact of a ``kind`` between the surfaces of the pair of this name."""
    entry = SubElement(contacts, "contact", name=f"{name}_contact", type=kind, surface_pair=f"{name}_pair")
    for tag, value in (PENALTY | settings).items():
        leaf(entry, tag, value)
