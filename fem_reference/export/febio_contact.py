"""Contact with bones and the springs of attachments in FEBio's input file, and differences between FEBio's model and the reference.

FEBio's ``tied-elastic`` contact applies a traction: the penalty times the change, relative to rest, of the vector from a point on
the primary surface to the point on the secondary surface that was nearest at rest. FEBio integrates it over the current primary
surface, which here is a rigid copy of the attached area and keeps its size. Therefore the contact acts like the springs of an
attachment, with a stiffness per unit rest area that is the same in all directions. Springs at points of the surface are represented
by small rigid triangles at the nearest points of the tetrahedra.
"""

from collections.abc import Iterator
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from scipy.linalg import eigh

from fem_reference.export import febio_mesh, febio_regions
from fem_reference.export.febio_material import matrix_constants
from fem_reference.export.febio_regions import parts
from fem_reference.foundations.mesh import Floats, corner_areas
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices

SEARCH_RADIUS = 5.0  # the maximum depth inside a bone at which FEBio searches for contact [mm]
# The maximum initial pressure due to overlap at rest, in shear moduli of the matrix. In gluteus_maximus_anatomical the pressure is
# up to 34 with a search radius of 5 mm, and FEBio failed in its first step; with 0.1 mm it is up to 10, and FEBio succeeded.
_AT_ONCE = 10.0
SPRING_SEARCH_RADIUS = 1.0  # the search radius for springs [mm], whose two surfaces coincide at rest
# Contact by penalty without augmentation, in one pass, with the given penalty and the complete tangent.
PENALTY = {"laugon": 0, "two_pass": 0, "auto_penalty": 0, "symmetric_stiffness": 0}
# Only springs over facets have been run in FEBio 4.11: the force on the femur differs from the reference by 5.3 % in gluteus_medius
# and by 8.8 % in gluteus_maximus.
MEASURED = (
    "Springs at points have not been run in FEBio 4.11. In the reference, springs at the nearest points change the force on the "
    "femur by 0.4 % and positions by 0.01 mm (rms; gluteus_medius, frame 20), with 12 mm tetrahedra by 1.2 % and 0.04 mm; springs "
    "over facets change them by 5.8 % and 0.17 mm (FEBio 4.11: 5.3 and 8.8 % of the force, up to 1.1 mm, on two hip muscles)"
)
_FELT = 1e-3  # a smaller overlap at rest is not reported [mm]


def has_contact(problem: MuscleProblem) -> bool:
    """True if the file has a section ``Contact``; the tangent is then not symmetric."""
    return bool(problem.obstacles or febio_mesh.by_springs(problem))


def add_contact(root: Element, problem: MuscleProblem) -> None:
    """Add the section ``Contact`` if there are springs or contact with bones."""
    if not has_contact(problem):
        return
    contacts = SubElement(root, "Contact")
    for attached in febio_mesh.by_springs(problem):
        settings = {"penalty": penalty(problem, attached), "search_radius": SPRING_SEARCH_RADIUS}
        pair(contacts, "tied-elastic", febio_mesh.springs_id(attached), settings)
    deep, friction = overlaps(problem), (problem.contact.friction or 0.0) if problem.contact else 0.0
    for bone in problem.obstacles:
        assert problem.contact is not None  # as obstacles exist only with contact
        radius = search_radius(problem, deep[bone.name])
        settings = {"penalty": problem.contact.stiffness, "search_radius": radius, "fric_coeff": friction}
        pair(contacts, "sliding-elastic", febio_mesh.bone_id(bone), settings)


def pair(contacts: Element, kind: str, name: str, settings: dict[str, float]) -> None:
    """Add a contact of a ``kind`` between the two surfaces of the pair ``name``."""
    entry = SubElement(contacts, "contact", name=f"{name}_contact", type=kind, surface_pair=f"{name}_pair")
    febio_mesh.leaves(entry, {**PENALTY, **settings})


def penalty(problem: MuscleProblem, attached: AttachedVertices) -> float:
    """The penalty [MPa/mm] for springs: their stiffness if they act over facets, divided by ``SHRUNK`` if they act at points."""
    assert attached.stiffness is not None  # the attachment is by springs
    return attached.stiffness / (febio_mesh.SHRUNK if attached.attachment in problem.attached_skins else 1.0)


def overlaps(problem: MuscleProblem) -> dict[str, float]:
    """The maximum depth [mm] of the contact surface inside each bone at rest, by name; 0 if the surface is outside the bone.

    The depth is evaluated at the corners, the midpoints of edges and the centroids of facets.
    """
    if not problem.obstacles:
        return {}
    corners = problem.mesh.points[febio_mesh.free_facets(problem)]
    middles = corners[:, febio_mesh.EDGES[:3]].mean(axis=2)
    points = np.concatenate([corners, middles, corners.mean(axis=1, keepdims=True)], axis=1).reshape(-1, 3)
    inside = ((bone.name, -signed_distances(points, febio_mesh.outward(bone.surface))) for bone in problem.obstacles)
    return {name: float(depths.max(initial=0.0)) for name, depths in inside}


def search_radius(problem: MuscleProblem, deep: float) -> float:
    """The maximum depth [mm] at which FEBio searches for contact with a bone that the muscle penetrates by ``deep`` [mm] at rest.

    It is smaller than ``SEARCH_RADIUS`` if the initial pressure would exceed ``_AT_ONCE`` shear moduli of the matrix.
    """
    assert problem.contact is not None  # called only with contact
    softest = min(sum(matrix_constants(part.effects)[key] for key in ("c1", "c2")) for part in parts(problem))
    bears = _AT_ONCE * 2 * softest / problem.contact.stiffness
    return min(SEARCH_RADIUS, bears) if deep > bears else SEARCH_RADIUS


def notes(problem: MuscleProblem) -> list[str]:
    """Sentences, with values, about FEBio's differences from the reference: regions, springs at points, overlap at rest."""
    # Springs that act over facets in the reference act in the same way in FEBio.
    on_skins = [one for one in febio_mesh.by_springs(problem) if one.attachment in problem.attached_skins]
    springs = [*(_springs(problem, one) for one in on_skins), *([MEASURED] if on_skins else [])]
    return [*febio_regions.note(problem), *springs, *_overlapping(problem)]


def _springs(problem: MuscleProblem, attached: AttachedVertices) -> str:
    """A sentence about springs in FEBio and in the reference: the distance between them, and the stiffness of each."""
    skin, found = problem.attached_skins[attached.attachment], febio_mesh.spring_points(problem, attached)
    points, areas = found.points, corner_areas(found.corners) / febio_mesh.SHRUNK
    assert attached.stiffness is not None  # the attachment is by springs
    ours, theirs = (attached.stiffness * float(one.sum()) for one in (skin.areas, areas))
    centre, away = skin.areas @ skin.points / skin.areas.sum(), np.linalg.norm(points - skin.points[found.of], axis=1)
    off = float(np.linalg.norm(areas @ points / areas.sum() - centre))
    turning = eigh(_turning(points - centre, areas), _turning(skin.points - centre, skin.areas), eigvals_only=True)
    return (
        f'attachment "{attached.attachment}": springs act at the nearest points of the tetrahedra, {away.mean():.2g} mm (mean) to '
        f"{away.max():.2g} mm from the springs of the reference. Their stiffness is {theirs:.4g} instead of {ours:.4g} N/mm, their "
        f"centre is {off:.2g} mm away, and they are {turning[0]:.3f} to {turning[-1]:.3f} times as stiff against rotation"
    )


def _turning(arms: Floats, areas: Floats) -> Floats:
    """The moment of inertia (3, 3) [mm4] of ``areas`` (n,) at ``arms`` (n, 3), proportional to the stiffness against rotation."""
    squares = np.einsum("i,ij,ik->jk", areas, arms, arms)
    return np.asarray(np.trace(squares) * np.eye(3) - squares)


def _overlapping(problem: MuscleProblem) -> Iterator[str]:
    for bone, deep in overlaps(problem).items():
        if deep > _FELT:
            radius = search_radius(problem, deep)
            assert problem.contact is not None  # as overlaps are only reported with contact
            yield (
                f'bone "{bone}": facets of the tetrahedra are up to {deep:.2g} mm inside at rest. FEBio removes this overlap in '
                f"its first step, the reference before it starts. With a search_radius of {radius:.2g} mm, FEBio ignores contact "
                f"at deeper points, whose pressure exceeds {problem.contact.stiffness * radius:.2g} MPa"
            )
