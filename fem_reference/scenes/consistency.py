"""Checks across the keys of a muscle case: names are unique and known, and the muscle is at rest at the first frame."""

import numpy as np

from fem_reference.effects import Effect, Load, PassiveFibres, Ramped, in_situ
from fem_reference.effects.contact import Contact, among
from fem_reference.effects.damping import Damping
from fem_reference.effects.touching import MuscleContact
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.material_point import fibre_tension
from fem_reference.foundations.records import Record, check_once, check_used, join
from fem_reference.scenes import regions
from fem_reference.scenes.muscle import Frames, MuscleCase

# The name of the part of the surface that is not attached to a bone. A load acts on this part or on an attachment.
FREE = "free"
# The stretch of fibres that are slightly shorter than in the given shape.
_GIVEN = 1 - 1e-5


def check_names(case: MuscleCase) -> None:
    """Raise InputError unless names are unique and everything to which a name refers exists."""
    bones = [bone.name for bone in case.bone]
    attachments = [attachment.name for attachment in case.attachment]
    check_acting(case.effects, bones, case.frames, case.place)
    check_once([*attachments, FREE], join(case.place, "attachment"))
    check_used(bones, [(f"attachment[{i}].bone", entry.bone) for i, entry in enumerate(case.attachment)], case.place)
    check_once([joint.name for joint in case.joint], join(case.place, "joint"))
    check_used(bones, [(f"joint[{i}].bone", joint.bone) for i, joint in enumerate(case.joint)], case.place)
    check_used(attachments, list(case.fibres.ends.items()), case.place)
    _check_forces(case)
    loads = [(f"effect[{i}].on", getattr(effect, "on", FREE)) for i, effect in enumerate(case.effects)]
    check_used([*attachments, FREE], loads, case.place)
    _check_loads(case)
    regions.check(case.region, case.effects, attachments, case.place)


def _check_loads(case: MuscleCase) -> None:
    """Raise InputError if a load acts on an exact attachment: the bone would carry the load, and nothing would deform."""
    exact = [attachment.name for attachment in case.attachment if attachment.stiffness is None]
    for i, effect in enumerate(case.effects):
        if isinstance(effect, Load) and effect.on in exact:
            got = f'"{effect.on}", which follows its bone exactly, so that a load on it deforms nothing'
            raise InputError(join(case.place, f"effect[{i}].on"), got, f'"{FREE}" or an attachment with a stiffness')


def _check_forces(case: MuscleCase) -> None:
    """Raise InputError if two forces would have the same name, or if neither an attachment nor an effect prevents drift."""
    bones = [bone.name for bone in case.bone]
    contact = among(case.effects) is not None
    for i, attachment in enumerate(case.attachment):
        if contact and attachment.name in bones:
            place = join(case.place, f"attachment[{i}].name")
            raise InputError(place, f'"{attachment.name}", which is also the name of a bone', "a different name")
    stays = any(isinstance(effect, Damping) or "momentum" in effect.needs for effect in case.effects)
    if not case.attachment and not stays:
        want = 'an attachment, however soft, or the effect "damping" or "inertia": otherwise the muscle drifts'
        raise InputError(join(case.place, "attachment"), "none", want)


def check_rest(case: MuscleCase) -> None:
    """Raise InputError unless the muscle is at rest at the first frame.

    Every bone must be in the position of its surface file, and no effect with a ramp may act unless a stress at rest balances it.
    """
    for i, effect in enumerate(case.effects):
        acts = isinstance(effect, Ramped) and effect.amount(case.frames.first) != 0
        if acts and in_situ.among(case.effects) is None:
            got = f"an amount of {effect.amount(case.frames.first):g} at frame {case.frames.first}, the first"
            want = '0 there, as the muscle is at rest, or the effect "in_situ", which balances it'
            raise InputError(join(case.place, f"effect[{i}].ramp"), got, want)
    _check_slack(case)
    for i, bone in enumerate(case.bone):
        pose = bone.motion.poses().pose(case.frames.first) if bone.motion else np.eye(4)
        if not abs(pose - np.eye(4)).max() <= 1e-12:  # NaN is not at rest
            slid = np.array_equal(pose[:3, :3], np.eye(3))
            what, want = ("moved", "a distance of 0") if slid else ("turned", "an angle of 0")
            raise InputError(join(case.place, f"bone[{i}].motion"), f"a bone {what} at the first frame", want)


def _check_slack(case: MuscleCase) -> None:
    """Raise InputError if passive fibres are in tension in the given shape and no stress at rest balances them."""
    for i, effect in enumerate(case.effects):
        # Slightly below the given length, because laws may have a kink at this length.
        pull = fibre_tension(effect.energy, _GIVEN) if isinstance(effect, PassiveFibres) else 0.0
        if not pull <= 0 and in_situ.among(case.effects) is None:
            want = 'slack fibres (an optimal_stretch of at least 1), or the effect "in_situ", which balances them'
            got = f"fibres under {1e3 * pull:.3g} kPa in the given shape"
            raise InputError(join(case.place, f"effect[{i}]"), got, want)


def check_acting(acting: tuple[Record, ...], bones: list[str], frames: Frames, place: str) -> None:
    """Raise InputError unless names of bones are unique, contact is with existing bones, the options of contact are compatible, and
    ``frames`` have an interval if one of the effects ``acting`` depends on time.
    """
    check_once(bones, join(place, "bone"))
    for i, effect in enumerate(acting):
        if isinstance(effect, Contact):
            check_used(bones, [(f"effect[{i}].bones", name) for name in effect.bones or ()], place)
            if effect.support is not None and in_situ.among(acting) is None:
                got = f"{effect.support:g} mm"
                raise InputError(join(place, f"effect[{i}].support"), got, 'no "support" without "in_situ"')
            if effect.friction is not None and in_situ.among(acting) is not None:
                want = 'no friction with "in_situ", which balances pressures at rest without friction'
                raise InputError(join(place, f"effect[{i}].friction"), f"{effect.friction:g}", want)
        if isinstance(effect, MuscleContact) and effect.own_normals and effect.friction is not None:
            got = f"true, with a friction of {effect.friction:g}"
            raise InputError(join(place, f"effect[{i}].own_normals"), got, "no friction, which needs the nearest point")
        if isinstance(effect, Effect) and "interval" in effect.needs and frames.interval is None:
            want = f"the time from a frame number to the next, which effect[{i}] ({effect.title}) needs"
            raise InputError(join(place, "frames.interval"), "nothing", want)
