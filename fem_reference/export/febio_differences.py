"""Differences of the model in FEBio, with their numbers: springs of attachments, bones that overlap the muscle at rest."""

from collections.abc import Iterator

import numpy as np
from scipy.linalg import eigh

from fem_reference.export.febio_contact import overlaps, search_radius
from fem_reference.export.febio_mesh import by_springs
from fem_reference.foundations.mesh import Floats, corner_areas
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices

# What FEBio 4.11 gave with springs over facets, for the reference's own, at 1 rad on gluteus_medius and gluteus_maximus.
MEASURED = (
    "the same springs at points and over facets differed by 5.3 and 8.8 % of the force on the femur, and by up to 1.1 mm (rms) "
    "in positions, on two muscles of the hip: compare forces no closer than that"
)
_FELT = 1e-3  # [mm]: an overlap at rest that is worth a word


def notes(problem: MuscleProblem) -> list[str]:
    """The sentences; none where nothing of this is there."""
    springs = [_springs(problem, attached) for attached in by_springs(problem) if _has_points(problem, attached)]
    return [*springs, *([MEASURED] if springs else []), *_overlapping(problem)]


def _has_points(problem: MuscleProblem, attached: AttachedVertices) -> bool:
    """True where the reference has its springs at points of the surface, not over facets too."""
    return attached.attachment in problem.attached_skins


def _springs(problem: MuscleProblem, attached: AttachedVertices) -> str:
    """Stiffness of FEBio's springs, in all and against turning about the middle of the reference's, and their place."""
    assert attached.stiffness is not None  # one by springs
    skin = problem.attached_skins[attached.attachment]
    corners = problem.mesh.points[problem.mesh.facets[attached.attachment]]
    thirds = corner_areas(corners) / 3
    middles = (corners + np.roll(corners, 1, axis=1)) / 2  # of edges: a rule that is exact for squares
    points, areas = middles.reshape(-1, 3), np.repeat(thirds, 3)
    centre = skin.areas @ skin.points / skin.areas.sum()
    away = float(np.linalg.norm(areas @ points / areas.sum() - centre))
    turning = eigh(_turning(points - centre, areas), _turning(skin.points - centre, skin.areas), eigvals_only=True)
    ours, theirs = (attached.stiffness * float(one.sum()) for one in (skin.areas, areas))
    return (
        f'attachment "{attached.attachment}": springs over facets of the tetrahedra, not at points of the surface as in the '
        f"reference: {theirs:.4g} N/mm in all for {ours:.4g} ({100 * (theirs / ours - 1):+.1f} %), their middle {away:.2f} mm "
        f"away, {turning[0]:.2f} to {turning[-1]:.2f} times as stiff against turning"
    )


def _turning(arms: Floats, areas: Floats) -> Floats:
    """The moment of inertia (3, 3) [mm4] of ``areas`` (n,) at ``arms`` (n, 3): springs of one stiffness resist turning so."""
    squares = np.einsum("i,ij,ik->jk", areas, arms, arms)
    return np.asarray(np.trace(squares) * np.eye(3) - squares)


def _overlapping(problem: MuscleProblem) -> Iterator[str]:
    for bone, deep in overlaps(problem).items():
        if deep > _FELT:
            radius = search_radius(problem, deep)
            assert problem.contact is not None  # or nothing overlaps
            yield (
                f'bone "{bone}": facets of the tetrahedra begin up to {deep:.2g} mm inside, which FEBio removes in its first step, '
                f"the reference before; its search_radius is {radius:.2g} mm, and a point deeper than that, pressed by more "
                f"than {problem.contact.stiffness * radius:.2g} MPa, is not in contact there"
            )
