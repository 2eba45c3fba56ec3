"""Problems of single muscles: set-ups filled with tetrahedra and fibres, and the finite element bodies made from them."""

import time
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import platformdirs

from fem_reference.effects import Effect, Interaction, in_situ
from fem_reference.effects.contact import Contact as ContactEffect
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import (
    Floats,
    Polylines,
    Surface,
    TetMesh,
    boundary,
    check_closed,
    check_finite,
    fingerprint,
    found_in,
    tet_qualities,
    tet_volumes,
    triangle_areas,
)
from fem_reference.foundations.records import join
from fem_reference.geometry import block
from fem_reference.geometry.distance import distances
from fem_reference.geometry.exemption import free_skin
from fem_reference.geometry.fibres import Directions
from fem_reference.geometry.intersections import self_intersections
from fem_reference.geometry.kept_meshes import cached as cached_mesh
from fem_reference.geometry.nested import refined
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS, Obstacle
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.geometry.signed_distance import Grid
from fem_reference.geometry.skins import Skin, attached_skin, spacing
from fem_reference.geometry.tessellation import tessellated
from fem_reference.geometry.tetrahedra import tetrahedralise
from fem_reference.io import files
from fem_reference.problems import regions
from fem_reference.problems.anatomy import facets_under, fibres_of, inside, pick, tendon_of, unshifted
from fem_reference.problems.body import Body, Cells, Prescribed
from fem_reference.problems.checks import check_agreement, check_thinness
from fem_reference.problems.contact import ContactBone, ContactLaw, check_bone, check_exempt, nearest_at_rest
from fem_reference.problems.fibre_ends import attached_ends, completed, facts_of
from fem_reference.problems.paths import Follows, From
from fem_reference.problems.problem import AtRest
from fem_reference.problems.setup import AttachedVertices, Bone, Setup, joints_of
from fem_reference.problems.tendons import pulling
from fem_reference.problems.touching import with_itself
from fem_reference.scenes.muscle import CaseBone, MuscleCase

RELAXING = 10  # an overlap at rest is removed over this many frame numbers before the first


def kept_meshes() -> Path | None:
    """The folder in which tetrahedra are stored; it may be deleted. None if tetrahedra are made anew each time."""
    return platformdirs.user_cache_path("fem_reference") / "meshes"


@dataclass(frozen=True, eq=False)
class MuscleProblem(Setup):
    """A set-up that is filled with tetrahedra and ``fibres``, with its ``effects``. ``mesh``: the tetrahedra, with the facets of
    each attachment; ``fibre``: the fibre direction at any point, None if no effect needs it; ``skin``: the contact surface, None
    without contact; ``attached_skins``: the points of springs, by attachment; ``mesh_facts``: facts about the mesh; ``seconds``:
    the time that meshing took.
    """

    mesh: TetMesh
    effects: tuple[Effect, ...]
    fibres: Polylines
    fibre: Directions | None = None
    skin: Skin | None = None
    attached_skins: dict[str, Skin] = field(default_factory=dict)
    mesh_facts: dict[str, float | str] = field(default_factory=dict)
    spans: ClassVar[tuple[()]] = ()  # the parts of joined arrays, only for several muscles
    seconds: float = 0.0

    @cached_property
    def directions(self) -> Floats | None:
        """The unit vectors (k, 3) along the fibres at the centroids of the tetrahedra; None if no effect needs them."""
        middles = self.mesh.points[self.mesh.tets].mean(axis=1)
        return None if self.fibre is None else self.fibre(np.arange(len(middles)), middles)

    @property
    def muscle(self) -> "MuscleProblem":
        """This problem, which has a single muscle."""
        return self

    @property
    def rest(self) -> AtRest:
        """The rest state of everything whose positions a frame contains."""
        return AtRest(self.surface, self.fibres, self.mesh, self.directions)

    @cached_property
    def body(self) -> Body:
        """The finite element body of the muscle. Bones prescribe the motion of exactly attached facets, and pull on other
        attachments by springs at ``attached_skins``. Facets without attachment are the region ``"free"``; contact acts on ``skin``.
        Raises InputError if two bones prescribe different motions, or a motion cannot be followed.
        """
        mesh, first = self.mesh, self.frames[0]
        check_thinness(mesh)
        attached = np.concatenate([np.zeros((0, 3), int), *(mesh.facets[entry.attachment] for entry in self.attached)])
        outer, _ = boundary(mesh.tets)
        facets = {**mesh.facets, "free": outer[~found_in(outer, attached)]}
        cells = Cells(mesh.points, mesh.tets, "tetrahedron", 1, facets)
        prescribed = list(pulling(self, mesh, self.fibres, self.effects))
        for entry in self.attached:
            name, path = entry.attachment, Follows(From(first, entry.bone.pose))
            prescribed.append(Prescribed(name, self.attached_skins.get(name, name), (0, 1, 2), path, entry.stiffness))
        acting = tuple(effect for effect in self.effects if not isinstance(effect, Interaction))
        body = Body(cells, acting, tuple(prescribed), self.frames, self.fibre, regions=self.regions)
        body = replace(body, interval=self.interval, start=self.start, touching=with_itself(self.effects, "free"))
        if self.contact is not None:
            assert self.skin is not None  # made wherever the effect acts
            body = _among_bones(body, self.bones, self.skin, self.contact)
        check_agreement(body)
        return body

    @property
    def contact(self) -> ContactEffect | None:
        """The effect of contact with bones; None without contact."""
        return among(self.effects)

    @property
    def obstacles(self) -> tuple[Bone, ...]:
        """The bones with which the muscle can be in contact."""
        return tuple(bone for bone in self.bones if self.contact is not None and self.contact.is_by(bone.name))

    def write_meshes(self, folder: Path) -> None:
        """Write surface, fibres and tetrahedra for ParaView into ``folder``."""
        files.write_surface(folder / "surface.vtp", self.surface, self.surface.points)
        files.write_polylines(folder / "fibres.vtp", self.fibres, self.fibres.points)
        files.write_tets(folder / "tets.vtu", self.mesh, self.mesh.points)


def setup(case: MuscleCase) -> Setup:
    """Read and check the surfaces of a case, and choose its attached vertices. An InputError names the invalid part."""
    place = join(case.place, "muscle.surface")
    surface = files.read_surface(case.file(case.muscle.surface, "muscle.surface"), case.muscle.unit)
    surface = check_closed(Surface(surface.points, surface.triangles, f"{place}: {surface.place}"))
    bones = tuple(_body(case, i, surface) for i in range(len(case.bone)))
    attached, joints = _attached(case, surface, bones), joints_of(case, bones)
    rest = Setup(surface, bones, attached, case.frames.numbers, case.frames.interval, joints=joints)
    return replace(rest, regions=regions.of_case(case, rest, partial(filled, case, rest)))


def build(case: MuscleCase, rest: Setup) -> MuscleProblem:
    """The problem of a case: its set-up ``rest``, filled with tetrahedra and fibres."""
    begin, contact = time.perf_counter(), among(case.effects)
    distances_known = {} if contact is None else _distances(case, rest, contact)
    mesh = filled(case, rest, case.muscle.tet_size)
    exact = tuple(attached.attachment for attached in rest.attached if attached.stiffness is None)
    for _ in range(case.muscle.refinements):
        mesh = refined(mesh, rest.surface, exact)
    for i, attached in enumerate(rest.attached):
        if len(mesh.facets[attached.attachment]) == 0:
            place = join(case.place, f"attachment[{i}]")
            raise InputError(place, "an area smaller than the tetrahedra resolve", "a smaller muscle.tet_size")
    own = rest if (plain := unshifted(case)) is case else setup(plain)
    fibres, fibre = fibres_of(case, rest.surface, partial(filled, case, own))
    ends = attached_ends(own.attached, own.exempt, fibres)
    if case.fibres.complete and ends is not None:
        fibres = inside(rest.surface, completed(fibres, ends))
        ends = attached_ends(own.attached, own.exempt, fibres)
    asked = any("fibre" in effect.needs for effect in (*case.effects, *(one.effect for one in case.decisions)))
    problem = assembled(rest, mesh, case.effects, (fibres, fibre if asked else None), spacing(rest.surface))
    facts = _mesh_facts(rest, mesh, case.muscle.tet_size / 2) | distances_known | facts_of(fibres, ends)
    return replace(problem, mesh_facts=facts, seconds=time.perf_counter() - begin)


def assembled(
    rest: Setup, mesh: TetMesh, effects: tuple[Effect, ...], lines: tuple[Polylines, Directions | None], apart: float
) -> MuscleProblem:
    """The set-up ``rest`` filled with a ``mesh``. ``lines``: the fibres, and their direction at any point, None if no effect needs
    it; ``apart`` [mm]: the spacing of contact points and spring points.
    """
    springs = {
        one.attachment: attached_skin(rest.surface, attached_shares(rest.surface, one.vertices), mesh, apart)
        for one in rest.attached
        if one.stiffness is not None
    }
    skin = None if among(effects) is None else free_skin(rest.exempt, mesh, apart)
    known: dict[str, Any] = {entry.name: getattr(rest, entry.name) for entry in fields(rest)}
    return MuscleProblem(
        **known, mesh=mesh, effects=effects, fibres=lines[0], fibre=lines[1], skin=skin, attached_skins=springs
    )


def _distances(case: MuscleCase, rest: Setup, contact: ContactEffect) -> dict[str, float | str]:
    """The spacing and errors [mm] of the distance grids of bones. Raises InputError if bones or attachments rule out contact."""
    for i, bone in enumerate(rest.bones):
        if contact.is_by(bone.name):
            place = join(case.place, f"bone[{i}]")
            check_bone(place, bone.surface, bone.shape, rest.surface, spacing(rest.surface))
    check_exempt(rest.exempt, join(case.place, "attachment"))
    return {
        f"{bone.name}_distance_{key}_mm": getattr(bone.shape, key)
        for bone in rest.bones
        if isinstance(bone.shape, Grid)
        for key in ("spacing", "mean_error", "error")
    }


def filled(case: MuscleCase, rest: Setup, size: float) -> TetMesh:
    """The surface of ``rest`` filled with tetrahedra of a ``size`` [mm]. Attachments have the facets inside their rims if the
    mesher preserves rims, and otherwise the facets chosen by ``facets_under``.
    """
    shares = {attached.attachment: attached_shares(rest.surface, attached.vertices) for attached in rest.attached}
    filled = partial(cached_mesh, tetrahedralise, shares=shares, folder=kept_meshes())
    mesh = block.fill(rest.surface, size) if case.muscle.mesher == "block" else filled(rest.surface, size)
    if set(mesh.facets) == set(shares):
        return mesh
    return replace(mesh, facets={name: facets_under(mesh, rest.surface, attached) for name, attached in shares.items()})


def _body(case: MuscleCase, i: int, muscle: Surface) -> Bone:
    bone = case.bone[i]
    if bone.surface is None or bone.unit is None:
        return closed_form(bone, muscle, join(case.place, f"bone[{i}]"))
    surface = files.read_surface(case.file(bone.surface, f"bone[{i}].surface"), bone.unit)
    check_finite(surface)
    motion = bone.motion.poses() if bone.motion else None
    return Bone(bone.name, surface, motion, bone.distance_error, bone.distance_rounding)


def closed_form(bone: CaseBone, muscle: Surface, place: str) -> Bone:
    """The bone that a record ``bone`` describes by an analytic shape, with its surface near a ``muscle``. Errors name ``place``."""
    form, motion = solid(bone), bone.motion.poses() if bone.motion else None
    assert form is not None  # a CaseBone record has an analytic shape or a surface with its unit
    return Bone(bone.name, tessellated(form, muscle.points, place), motion, solid=form)


def _attached(case: MuscleCase, surface: Surface, bones: tuple[Bone, ...]) -> tuple[AttachedVertices, ...]:
    by_name = {bone.name: bone for bone in bones}
    taken = np.zeros(len(surface.points), bool)
    attached = []
    for i, attachment in enumerate(case.attachment):
        place = join(case.place, f"attachment[{i}]")
        vertices = pick(case, i, surface, by_name[attachment.bone].surface)
        if len(vertices) == 0:
            raise InputError(place, "no vertex of the muscle", "an attachment that selects vertices")
        if taken[vertices].any():
            got = f"vertex {vertices[taken[vertices]][0]}, which belongs to another attachment"
            raise InputError(place, got, "each vertex once")
        taken[vertices] = True
        bone, tendon = by_name[attachment.bone], tendon_of(case, i)
        attached.append(AttachedVertices(attachment.name, bone, vertices, attachment.stiffness, tendon))
    return tuple(attached)


def solid(bone: CaseBone) -> Obstacle | None:
    """The analytic shape of a ``bone``; None if the bone is a surface in a file."""
    given = ((name, getattr(bone, name)) for name in CLOSED_FORMS)
    return next((CLOSED_FORMS[name](**form.model_dump()) for name, form in given if form is not None), None)


def _mesh_facts(rest: Setup, mesh: TetMesh, far: float) -> dict[str, float | str]:
    """Facts about the ``mesh``, by name: its mesher, size and quality. For each attachment there are its area on the surface and on
    the tetrahedra, and the number of its vertices that are more than ``far`` [mm] from its facets, on islands that the tetrahedra
    do not resolve.
    """
    qualities = tet_qualities(mesh.points, mesh.tets)
    facts: dict[str, float | str] = {
        "maker": mesh.maker,
        "fingerprint": fingerprint(mesh.points, mesh.tets)[:16],
        "self_intersections_of_surface": float(len(self_intersections(rest.surface))),
        "tets": float(len(mesh.tets)),
        "points": float(len(mesh.points)),
        "quality_min": float(qualities.min()),
        "quality_5_percent": float(np.percentile(qualities, 5)),
        "volume_mm3": float(tet_volumes(mesh.points, mesh.tets).sum()),
    }
    for attached in rest.attached:
        name, facets = attached.attachment, mesh.facets[attached.attachment]
        off = distances(rest.surface.points[attached.vertices], Surface(mesh.points, facets)).distance
        facts[f"{name}_area_mm2"] = attached_area(rest.surface, attached_shares(rest.surface, attached.vertices))
        facts[f"{name}_area_on_tets_mm2"] = float(triangle_areas(mesh.points, facets).sum())
        facts[f"{name}_vertices_beside_facets"] = float((off > far).sum())
    return facts


def _among_bones(body: Body, bones: tuple[Bone, ...], skin: Skin, effect: ContactEffect) -> Body:
    """A copy of ``body`` in contact with ``bones``. An overlap at rest is removed before the first frame, except under tension."""
    pressing = [bone for bone in bones if effect.is_by(bone.name)]
    first, points = body.frames[0], skin.points
    nearest = min((nearest_at_rest(bone.name, bone.shape, points) for bone in pressing), default=np.inf)
    tense = in_situ.among(body.effects) is not None
    before = first - RELAXING if nearest < effect.smoothing and not tense else None
    relaxed, support = None if before is None else (before, first), effect.support or 0.0 if tense else None
    law = ContactLaw(skin, effect.stiffness, effect.smoothing, relaxed, support, effect.friction)
    posed = tuple(ContactBone(bone.name, bone.shape, From(first, bone.pose)) for bone in pressing)
    return replace(body, frames=(*(relaxed or (first,)), *body.frames[1:]), contact=law, bones=posed)
