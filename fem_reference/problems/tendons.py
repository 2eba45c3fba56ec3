"""Tendons as springs that pull but do not push, from the surface of a muscle around its fibre ends to points on bones beyond it."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.effects import Effect, in_situ
from fem_reference.effects.tendon import Tendon
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, TetMesh
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import attached_skin, spacing
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.fibre_ends import attached_ends, ends_of
from fem_reference.problems.paths import Follows, From
from fem_reference.problems.setup import Setup


def force_name(attachment: str) -> str:
    """The name under which the force of the tendons of an ``attachment`` is reported."""
    return f"{attachment}_tendon"


def check(body: Body) -> None:
    """Raise InputError if a tendon is combined with tension at rest."""
    if in_situ.among(body.effects) is not None and any(entry.anchor is not None for entry in body.prescribed):
        raise InputError(
            "effects", "a tendon together with in_situ", "only one of these: the tension of a tendon at rest is unknown"
        )


def pulling(rest: Setup, mesh: TetMesh, fibres: Polylines, effects: tuple[Effect, ...]) -> Iterator[Prescribed]:
    """Yield the springs of each effect ``tendon`` among ``effects``. ``rest``, ``mesh``, ``fibres``: the set-up and its filling."""
    for effect in effects:
        if isinstance(effect, Tendon):
            yield _springs(effect, rest, mesh, fibres)


def _springs(effect: Tendon, rest: Setup, mesh: TetMesh, fibres: Polylines) -> Prescribed:
    """The springs of an ``effect``. Raises InputError if no fibre continues as its tendon."""
    number = [one.attachment for one in rest.attached].index(effect.on)
    entry, place = rest.attached[number], f"effect {effect.title}"
    if entry.tendon is None:
        raise InputError(place, f'the attachment "{effect.on}" without a tendon', "landmarks at its end")
    ends = attached_ends(rest.attached, rest.exempt, fibres)
    assert ends is not None  # there is an attachment
    beyond = (ends.by == number) & np.isfinite(ends.tendons[:, :, 0])
    if not beyond.any():
        raise InputError(place, "no fibre that continues as this tendon", "fibres that end near the attachment")
    away, _ = cKDTree(ends_of(fibres)[beyond]).query(rest.surface.points)
    shares = attached_shares(rest.surface, np.setdiff1d(np.flatnonzero(away <= effect.reach), rest.attached_vertices))
    skin = attached_skin(rest.surface, shares, mesh, spacing(rest.surface))
    if not skin.areas.sum() > 0:
        raise InputError(f"{place}.reach", f"{effect.reach:g} mm, within which no triangle is free", "a greater reach")
    path, (x, y, z) = Follows(From(rest.frames[0], entry.bone.pose)), map(float, entry.tendon)
    return Prescribed(force_name(effect.on), skin, (0, 1, 2), path, effect.stiffness / skin.areas.sum(), (x, y, z))
