"""The muscle of a problem as a finite element body, attached to bones and in contact with them."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem_reference.effects import Effect, Interaction
from fem_reference.effects.contact import Contact as ContactEffect
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, TetMesh, boundary, place_of, tet_volumes
from fem_reference.geometry.fibres import Directions
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.checks import check_agreement
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Follows, From
from fem_reference.problems.setup import Bone, Setup

# Frame numbers before the first over which an overlap at rest is removed.
RELAXING = 10
# Where the overlap at rest reaches down to this share of a bone's half thickness, no direction leads out.
_MIDDLE = 0.95
# The greatest ratio of a cell's length to its thickness: stiffnesses differ by its square, and 16 digits do not hold both.
_THINNEST = 1e6


def body_of(
    setup: Setup,
    mesh: TetMesh,
    effects: tuple[Effect, ...],
    fibre: Directions | None,
    skin: Skin | None,
    attached_skins: Mapping[str, Skin],
) -> Body:
    """The muscle of a ``setup`` as a body of ``mesh``. Its bones prescribe the motion of exactly attached facets, or pull by
    springs at ``attached_skins``; the rest of its surface is ``"free"``, with contact on ``skin``. InputError where two bones
    prescribe different motions, or one moves in a way that cannot be followed.
    """
    _check_thickness(mesh)
    attached = np.concatenate([np.zeros((0, 3), int), *(mesh.facets[entry.attachment] for entry in setup.attached)])
    outer, _ = boundary(mesh.tets)
    taken = {tuple(facet) for facet in np.sort(attached, axis=1).tolist()}
    free = outer[[tuple(facet) not in taken for facet in np.sort(outer, axis=1).tolist()]]
    cells = Cells(mesh.points, mesh.tets, "tetrahedron", 1, {**mesh.facets, "free": free})
    first = setup.frames[0]
    prescribed = tuple(
        Prescribed(
            entry.attachment,
            attached_skins.get(entry.attachment, entry.attachment),
            (0, 1, 2),
            Follows(From(first, entry.bone.pose)),
            entry.stiffness,
        )
        for entry in setup.attached
    )
    acting, contact = tuple(effect for effect in effects if not isinstance(effect, Interaction)), among(effects)
    body = Body(cells, acting, prescribed, setup.frames, fibre, interval=setup.interval, start=setup.start)
    if contact is not None:
        assert skin is not None  # built with the effect
        body = _among_bones(body, setup.bones, skin, contact)
    check_agreement(body)
    return body


def _among_bones(body: Body, bones: tuple[Bone, ...], skin: Skin, effect: ContactEffect) -> Body:
    """The body with its bones in contact; where they overlap it at rest, it is relaxed before the first frame."""
    pressing = [bone for bone in bones if effect.is_by(bone.name)]
    first, points = body.frames[0], skin.points
    nearest = min((_nearest(bone, points) for bone in pressing), default=np.inf)
    before = first - RELAXING if nearest < effect.smoothing else None
    law = ContactLaw(skin, effect.stiffness, effect.smoothing, None if before is None else (before, first))
    frames = body.frames if before is None else (before, *body.frames)
    posed = tuple(ContactBone(bone.name, bone.shape, From(first, bone.pose)) for bone in pressing)
    return replace(body, frames=frames, contact=law, bones=posed)


def _nearest(bone: Bone, points: Floats) -> float:
    """The least distance [mm] to a bone; InputError where a point is in its middle."""
    nearest, half = float(bone.shape.sample(points).distance.min(initial=np.inf)), bone.shape.half_thickness
    if nearest < -_MIDDLE * half:
        got = f"{-nearest:.3g} mm of overlap with the muscle at rest"
        raise InputError(
            f'bone "{bone.name}"', got, f"less: its middle is {half:.3g} mm deep, and from there no side is nearer"
        )
    return nearest


def _check_thickness(mesh: TetMesh) -> None:
    """Raise InputError where a cell is too thin for double precision."""
    corners = mesh.points[mesh.tets]
    longest = np.linalg.norm(corners[:, [0, 0, 0, 1, 1, 2]] - corners[:, [1, 2, 3, 2, 3, 3]], axis=2).max(axis=1)
    ratios = longest**3 / (6 * tet_volumes(mesh.points, mesh.tets))
    worst = int(np.argmax(ratios))
    if not ratios[worst] < _THINNEST:
        place = f"cell {worst} at {place_of(corners[worst].mean(axis=0))}"
        raise InputError(
            place, f"{ratios[worst]:.1e} times as long as thick", f"less than {_THINNEST:g}, for double precision"
        )
