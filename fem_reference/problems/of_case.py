"""The set-up and the problem of any case, of muscles or of a scalar field, and their description in words and numbers."""

import logging
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fem_reference.effects import Effect
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import exact
from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.problems import muscle, muscles, regions, scalar
from fem_reference.problems.estimates import Decision, decisions, estimates
from fem_reference.problems.guess import described_motion
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.muscles import MusclesProblem, MusclesSetup
from fem_reference.problems.scalar import FieldProblem
from fem_reference.problems.setup import Bone, Setup
from fem_reference.problems.stresses import Watch
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase
from fem_reference.scenes.scalar import ScalarCase

log = logging.getLogger(__name__)

# The set-up of a case before meshing, which suffices to judge runs, and the problem of a case, which a solver receives.
CaseSetup = Setup | MusclesSetup | FieldProblem
MechanicalProblem = MuscleProblem | MusclesProblem
CaseProblem = MechanicalProblem | FieldProblem


def mechanical(built: CaseProblem) -> MechanicalProblem | None:
    """The problem ``built`` if it is a problem of muscles; None if it is a scalar field."""
    return None if isinstance(built, FieldProblem) else built


def effects_of(built: MechanicalProblem) -> tuple[Effect, ...]:
    """The effects that act in a problem: in its muscle, or in all of its muscles and between them."""
    if isinstance(built, MuscleProblem):
        return built.effects
    found = tuple(effect for one in built.problems.values() for effect in one.effects)
    return found if built.law is None else (*found, built.law)


def at_frames(built: MechanicalProblem, frames: tuple[int, ...]) -> MechanicalProblem:
    """A copy of the problem ``built`` with other ``frames``."""
    if isinstance(built, MuscleProblem):
        return replace(built, frames=frames)
    return replace(built, problems={name: replace(one, frames=frames) for name, one in built.problems.items()})


def explained(case: Case, rest: Callable[[], CaseSetup] | None = None) -> tuple[Decision, ...]:
    """The decisions, with reasons, on the effects that a case needs; empty for a scalar field.

    ``rest``: a function that returns the set-up of the case; if it is None, the set-up is made here.
    """
    if not isinstance(case, MuscleCase | MusclesCase):
        return ()
    known = setup(case) if rest is None else rest()
    if isinstance(case, MusclesCase):
        assert isinstance(known, MusclesSetup)
        return muscles.explained(case, known)
    assert isinstance(known, Setup)  # of a muscle
    return decisions(case, known)


def facts(case: Case, setup: CaseSetup) -> dict[str, object]:
    """Facts about a case and its ``setup``, in words and numbers, by heading."""
    if isinstance(case, MuscleCase) and isinstance(setup, Setup):
        return _facts_of_muscle(setup, case)
    if isinstance(case, MusclesCase) and isinstance(setup, MusclesSetup):
        own = zip(case.parts, setup.muscles.items(), strict=True)
        pairs = [" and ".join(pair) for pair in setup.pairs]
        known = {name: _facts_of_muscle(rest, part) for part, (name, rest) in own}
        return {
            **known,
            "may touch": ", ".join(pairs)
            or ("none" if case.touching else 'none, as the effect "touching" is not listed'),
        }
    assert isinstance(setup, FieldProblem)  # there are no other types
    mesh, fixed = setup.mesh, int(np.isfinite(setup.fixed).sum())
    return {
        "domain": f"{len(mesh.cells)} cells, {len(mesh.points)} vertices, size {mesh.sizes.sum():.6g}",
        "element": f"P{setup.order}, {len(setup.fixed)} nodes, {fixed} fixed",
        "form": f"{setup.form}, mesh Peclet number up to {setup.peclet:.3g}",
        "effects": {
            title: {name: str(value) for name, value in effect.model_dump().items()}
            for title, effect in case.acting.items()
        },
    }


def _facts_of_muscle(setup: Setup, case: MuscleCase) -> dict[str, object]:
    surface, frames = setup.surface, case.frames
    return {
        "muscle": {
            "triangles": len(surface.triangles),
            "volume_mm3": enclosed_volume(surface.points, surface.triangles),
            "tet_size_mm": case.muscle.tet_size,
            "refinements": case.muscle.refinements,
            "mesher": case.muscle.mesher,
        },
        "bones": {bone.name: f"{_shape(bone)}, {_motion(bone.motion)}" for bone in setup.bones},
        "attachments": {
            one.attachment: f"{len(one.vertices)} vertices, "
            f"{attached_area(surface, attached_shares(surface, one.vertices)):.0f} mm2, attached to {one.bone.name} "
            + ("exactly" if one.stiffness is None else f"by springs of {one.stiffness:g} MPa/mm")
            for one in setup.attached
        },
        "effects": {
            effect.title: {name: f"{exact(value)} {unit}".rstrip() for name, value, unit in effect.parameters}
            for effect in case.effects
        },
        **({"regions": regions.facts(setup)} if setup.regions else {}),
        **({"effects_chosen": [str(one) for one in case.decisions]} if case.decisions else {}),
        "frames": f"{frames.first} to {frames.last}, every {frames.every}",
    }


def _shape(bone: Bone) -> str:
    """The shape of a bone in words: the number of triangles of its surface, or its analytic shape."""
    if bone.solid is None:
        return f"{len(bone.surface.triangles)} triangles"
    kind = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in type(bone.solid).__name__)
    return f"{kind.strip()} of {', '.join(f'{name} {_said(value)}' for name, value in vars(bone.solid).items())}, mm"


def _said(value: float | tuple[float, ...]) -> str:
    return f"({', '.join(f'{entry:g}' for entry in value)})" if isinstance(value, tuple) else f"{value:g}"


def _motion(motion: RigidMotion | None) -> str:
    if motion is None:
        return "fixed"
    how, unit = f"slides along {_said(motion.axis)}", "mm"
    if motion.centre is not None:
        how, unit = f"rotates about {_said(motion.axis)} through {_said(motion.centre)} mm", "rad"
    keys = zip(motion.frames, motion.amounts, strict=True)
    return f"{how}: {', '.join(f'{amount:g} {unit} at frame {frame:g}' for frame, amount in keys)}"


def known(case: Case, setup: CaseSetup) -> dict[str, object]:
    """Facts that are known before a case is solved, in words, by heading; empty for a scalar field.

    For one muscle, these are the influence of the bones' motion on its length, its regions, and the reasons for its effects. For
    several muscles, these are the reasons for the effects.
    """
    if isinstance(case, MusclesCase):
        every = case.decisions or explained(case, lambda: setup)
        return {"effects": {one.title: one.why for one in every}}
    if not isinstance(case, MuscleCase) or not isinstance(setup, Setup):
        return {}
    found = case.decisions or explained(case)
    effects = {one.title: one.why for one in found}
    motion = described_motion(setup)
    parts = {"regions": regions.facts(setup)} if setup.regions else {}
    return ({"motion": motion} if motion else {}) | parts | {"effects": effects}


def chosen[C: Case](case: C, rest: Callable[[], CaseSetup] | None = None) -> C:
    """A copy of the case with only the effects that it needs, as decided by ``explained``.

    A case that is to use all listed effects is returned unchanged. ``rest``: as in ``explained``.
    """
    if not isinstance(case, MuscleCase | MusclesCase) or case.choice == "listed":
        return case
    found = explained(case, rest)
    for one in found:
        log.info("%s: %s", case.name, one)
    if isinstance(case, MusclesCase):
        return muscles.needed(case, found)  # type: ignore[return-value]  # of the type of the case
    kept = tuple(one.effect for one in found if one.needed)
    return case.model_copy(update={"choice": "listed", "effect": kept, "decisions": found})


def watch(case: Case, rest: CaseSetup, built: Callable[[], CaseProblem]) -> Watch | None:
    """The watch for effects that were omitted from the case of a single muscle; None if none were omitted, or for other cases.

    ``rest``: the set-up of the case; ``built``: a function that returns its problem.
    """
    if not isinstance(case, MuscleCase) or all(one.needed for one in case.decisions):
        return None
    assert isinstance(rest, Setup)  # of a muscle
    return Watch(case, rest, estimates(case, rest), built)


def with_effects[C: Case](case: C, found: tuple[Decision, ...]) -> C:
    """A copy of the case with only the needed effects. The decisions ``found`` replace earlier decisions on the same effects."""
    for one in found:
        log.info("%s: %s", case.name, one)
    new = {id(one.effect): one for one in found}
    made = tuple(new.get(id(one.effect), one) for one in case.decisions)
    kept = tuple(one.effect for one in made if one.needed)
    return case.model_copy(update={"effect": kept, "decisions": made})


def scalar_case(case: Case) -> ScalarCase:
    """The ``case`` itself if it has a scalar field. Raises InputError otherwise."""
    if not isinstance(case, ScalarCase):
        raise InputError(case.place, f'"{case.name}", the case of a muscle', "a scalar case")
    return case


def setup(case: Case) -> CaseSetup:
    """The set-up of a case. Raises an InputError that names the invalid part."""
    if isinstance(case, MusclesCase):
        return muscles.setup(case)
    return muscle.setup(case) if isinstance(case, MuscleCase) else scalar.build(scalar_case(case))


def problem(case: Case, rest: CaseSetup) -> CaseProblem:
    """The problem of a case, made from its set-up ``rest`` by filling each muscle with tetrahedra."""
    if isinstance(case, MusclesCase):
        assert isinstance(rest, MusclesSetup)
        return muscles.build(case, rest)
    if not isinstance(case, MuscleCase):
        assert isinstance(rest, FieldProblem)
        return rest
    assert isinstance(rest, Setup)
    size = case.muscle.tet_size / 2**case.muscle.refinements
    log.info("%s: filling the muscle with tetrahedra of %g mm", case.name, size)
    built = muscle.build(case, rest)
    facts = built.mesh_facts
    log.info("%s: %d tetrahedra, quality at least %.2f", case.name, facts["tets"], facts["quality_min"])
    return built
