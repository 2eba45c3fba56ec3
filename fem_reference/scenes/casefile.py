"""case.toml -> Case: strict reading. An unknown, missing or wrong key is an InputError that names file and key."""

from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.effects import Effect, FieldEffect, Ramped, in_situ, moduli, name_of, region_of
from fem_reference.effects import find as find_effect
from fem_reference.effects import names as effect_names
from fem_reference.effects.contact import Contact, among
from fem_reference.effects.damping import Damping
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, check_once, check_used, join, keys, parse
from fem_reference.io import texts
from fem_reference.scenes import numbers, ranges, regions
from fem_reference.scenes.case import HOME, Case
from fem_reference.scenes.muscle import Frames, MuscleCase
from fem_reference.scenes.scalar import ScalarCase

# What a load acts on, where it is no attachment: the surface that is not attached to bone.
FREE = "free"


def cases() -> list[str]:
    """The names of the shipped cases."""
    return sorted(path.parent.name for path in (HOME / "cases").glob("*/case.toml"))


def read(case: str | Path, *, with_negative_control: bool = False, changes: dict[str, Any] | None = None) -> Case:
    """A shipped case by name, or the case of a folder or of a file; one with a ``domain`` is of a scalar field.

    ``changes`` maps keys such as ``"frames.last"`` or ``"effect[1].bulk"`` to other values. ``with_negative_control`` applies the
    negative control, which is checked in any case, except after changes of other keys.
    """
    path = _scene_file(case)
    table = texts.toml(path)
    for key, value in (changes or {}).items():
        _change(table, key, value, str(path))
    scene = _scene(table, path)
    asked = not changes or any(key.startswith("negative_control") for key in changes)
    if not with_negative_control and not (asked and scene.negative_control):
        return scene
    changed = _with_negative_control(scene, table, path)
    if asked:
        _check_negative_control(scene, changed)
    return changed if with_negative_control else scene


def _scene_file(case: str | Path) -> Path:
    plain = Path(case).name == str(case)  # what is written as a path is no name
    shipped = [HOME / "cases" / str(case) / "case.toml"] if plain else []
    found = list[Path]()
    for path in (*shipped, Path(case) / "case.toml", Path(case)):
        with suppress(OSError, ValueError):  # a name that is too long, or with a null character
            if path.is_file():
                found.append(path.resolve())
    if plain and len(set(found)) > 1:
        want = f"./{case} for the folder here, or {found[0].parent} for the shipped case"
        raise InputError("CASE", f'"{case}", which is a shipped case and a folder here', want)
    if found:
        return found[0]
    raise InputError("CASE", f'"{case}"', f"a scene file, a folder with a case.toml, or one of {', '.join(cases())}")


def _change(table: dict[str, Any], key: str, value: Any, place: str, *, add: bool = True) -> None:
    """Change a key of a scene, or ``add`` one to a table that it has."""
    *parents, last = numbers.parts(key)
    inside: Any = table
    try:
        for part in parents:
            inside = inside[part]
        if not (add and last and isinstance(inside, dict)):
            inside[last]  # a change replaces what is there
        inside[last] = value
    except (KeyError, IndexError, TypeError) as error:
        want = f"a key that this scene has, or a key of a table that it has{_near(table, [*parents, last])}"
        raise InputError(join(place, key), "nothing", want) from error


def _near(table: dict[str, Any], parts: list[str | int]) -> str:
    """The keys that there are where ``parts`` of a key lead nowhere, as the end of a sentence."""
    inside: Any = table
    part: Any
    for i, part in enumerate(parts):
        if isinstance(inside, list) and not (isinstance(part, int) and part < len(inside)):
            key, names = ".".join(map(str, parts[:i])), [isinstance(one, dict) and one.get("name") for one in inside]
            labels = [f"{key}[{k}]{f' ({name})' if name else ''}" for k, name in enumerate(names)]
            return f"; there are {', '.join(labels)}"
        if isinstance(inside, dict) and part not in inside:
            return f"; there are {', '.join(inside)}"
        if not isinstance(inside, list | dict):
            break
        inside = inside[part]
    return ""


def setting(text: str) -> tuple[str, Any]:
    """``KEY=VALUE`` of the command line as a key and a TOML value; any other value is text.

    >>> setting("candidate[1].peclet=10"), setting("domain.mesh.triangles=delaunay")
    (('candidate[1].peclet', 10), ('domain.mesh.triangles', 'delaunay'))
    """
    key, equals, value = text.partition("=")
    if not equals or not key:
        raise InputError("--set", f'"{text}"', "KEY=VALUE, such as candidate[1].peclet=10")
    try:
        return key, texts.parse_toml(f"value = {value}", "--set")["value"]
    except InputError:
        return key, value


def read_muscle(case: str | Path, changes: dict[str, Any] | None = None) -> MuscleCase:
    """The case of a muscle, with ``changes`` of its keys."""
    return muscle(read(case, changes=changes))


def muscle(case: Case, place: str | None = None) -> MuscleCase:
    """The ``case`` itself, where it is one of a muscle; else InputError at ``place``, by default the file of the case."""
    if not isinstance(case, MuscleCase):
        raise InputError(place or case.place, f'"{case.name}", a scalar case', "the case of a muscle")
    return case


def _with_negative_control(case: Case, table: dict[str, Any], path: Path) -> Case:
    """The ``case`` of ``table`` with its negative control applied; ``table`` stays as it is."""
    place, control = str(path), case.negative_control
    if control is None:
        raise InputError(join(place, "negative_control"), "None", "a key to change, its value, and why")
    table = deepcopy(table)
    try:
        _change(table, control.key, control.value, place, add=False)
    except InputError as error:
        raise _wrong(case, "key", "a key of this scene") from error
    try:
        return _scene(table, path)
    except InputError as error:
        raise _wrong(case, "value", f"a value that can be read ({str(error).removeprefix(f'{place}: ')})") from error


def _check_negative_control(case: Case, changed: Case) -> None:
    control = case.negative_control
    if control is None or changed.decides != case.decides:
        return
    if changed.model_copy(update={"negative_control": control}) == case:
        raise _wrong(case, "value", f"a value that changes {control.key}")
    raise _wrong(case, "key", "a key that changes what is solved, which alone can turn a verdict: of an effect, say")


def _wrong(case: Case, part: str, want: str) -> InputError:
    """The error of a ``part`` of the negative control."""
    value = getattr(case.negative_control, part)
    got = f'"{value}"' if isinstance(value, str) else repr(value)
    return InputError(join(case.place, f"negative_control.{part}"), got, want)


def _scene(table: dict[str, Any], path: Path) -> Case:
    return made(table, {"name": path.parent.name, "folder": path.parent, "place": str(path), "from_file": True})


def made(table: dict[str, Any], whose: dict[str, Any]) -> Case:
    """The case with the keys of ``table`` and the ``name``, ``folder`` and ``place`` of ``whose``."""
    place = str(whose["place"])
    record, kind = (ScalarCase, FieldEffect) if "domain" in table else (MuscleCase, Effect)
    for key in whose:
        if key in table:
            raise InputError(join(place, key), "an unknown key", f"one of {', '.join(keys(record))}")
    if "effect" in table:
        table = table | {"effect": effects(table["effect"], place, kind)}
    case: Case = parse(record, table | whose, place)
    runs = ["reference", "candidates", *(candidate.name for candidate in case.candidate)]
    check_once(runs, join(place, "candidate"))
    case.check_solvers()
    check_used(runs, [(f"expect[{i}].of", entry.of) for i, entry in enumerate(case.expect)], place)
    return _checked(case)


def with_numbers[C: Case](case: C, values: dict[str, float]) -> C:
    """The ``case`` with other numbers by key, in their units inside, checked as one of a file."""
    made = numbers.changed(case, values)
    _check_effects([name_of(one) for one in made.effect], made.effect, made.place)
    return _checked(made)


def _checked[C: Case](case: C) -> C:
    if isinstance(case, MuscleCase):
        _check_names(case)
        _check_rest(case)
        ranges.check(case)
    return case


def effects(entries: Any, place: str, kind: type[Record] = Effect) -> Any:
    """The effects of a ``kind`` that are written below the key ``effect``, each once; other values than lists unchanged."""
    if not isinstance(entries, list | tuple):
        return entries
    found = tuple(_effect(entry, join(place, f"effect[{i}]"), kind) for i, entry in enumerate(entries))
    names = [entry["name"] for entry in entries]
    _check_effects(names, found, place)
    return found


def _check_effects(names: list[str], effects: tuple[Record, ...], place: str) -> None:
    """An effect acts once in each region (two of a name would share the unknowns that it brings), a load once on each part of the
    surface. A bulk modulus below the shear modulus there is of no tissue, and usually a slip of units.
    """
    places = [region_of(effect) for effect in effects]
    acting = [(name, getattr(effect, "on", ""), at) for name, effect, at in zip(names, effects, places, strict=True)]
    known = [moduli([effect]) for effect in effects]
    for i, (name, on, region) in enumerate(acting):
        if (name, on, region) in acting[:i]:
            where = f' on "{on}"' if on else f' in "{region}"' if region else ""
            raise InputError(join(place, f"effect[{i}].name"), f'"{name}"{where} a second time', "every effect once")
        met = [j for j, other in enumerate(places) if known[j].shear and (not region or not other or other == region)]
        shear, stiff = sum(known[j].shear for j in met), [names[j] for j in met]
        if 0 < known[i].bulk < shear:
            key = ".bulk" if "bulk" in type(effects[i]).model_fields else ""
            want = f"at least the shear modulus of {' and '.join(stiff)}, {shear:g} MPa"
            raise InputError(join(place, f"effect[{i}]{key}"), f"{known[i].bulk:g} MPa", want)


def _effect(table: Any, place: str, kind: type[Record]) -> Record:
    if not isinstance(table, dict) or table.get("name") not in effect_names(kind):
        got = table.get("name") if isinstance(table, dict) else table
        raise InputError(f"{place}.name", f'"{got}"', f"one of {', '.join(effect_names(kind))}")
    return parse(find_effect(table["name"]), {key: value for key, value in table.items() if key != "name"}, place)


def _check_names(case: MuscleCase) -> None:
    """Names are used once and refer to something."""
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
    regions.check(case.region, case.effects, attachments, case.place)


def _check_forces(case: MuscleCase) -> None:
    """Forces are reported by the name of the bone, and something keeps the muscle from drifting."""
    bones = [bone.name for bone in case.bone]
    contact = among(case.effects) is not None
    for i, attachment in enumerate(case.attachment):
        if contact and attachment.name in bones:
            place = join(case.place, f"attachment[{i}].name")
            raise InputError(place, f'"{attachment.name}", which a bone in contact has too', "a name of its own")
    stays = any(isinstance(effect, Damping) or "momentum" in effect.needs for effect in case.effects)
    if not case.attachment and not stays:
        want = 'an attachment, soft as it may be, or the effect "damping" or "inertia": without any the muscle drifts'
        raise InputError(join(case.place, "attachment"), "none", want)


def _check_rest(case: MuscleCase) -> None:
    """At the first frame every bone is where its surface is, and nothing acts that comes and goes, unless a stress at rest
    balances it: the muscle rests.
    """
    for i, effect in enumerate(case.effects):
        acts = isinstance(effect, Ramped) and effect.amount(case.frames.first) != 0
        if acts and in_situ.among(case.effects) is None:
            got = f"an amount of {effect.amount(case.frames.first):g} at frame {case.frames.first}, the first"
            want = '0 there, where the muscle rests, or the effect "in_situ", which balances it'
            raise InputError(join(case.place, f"effect[{i}].ramp"), got, want)
    for i, bone in enumerate(case.bone):
        pose = bone.motion.poses().pose(case.frames.first) if bone.motion else np.eye(4)
        if not abs(pose - np.eye(4)).max() <= 1e-12:  # NaN is no rest
            slid = np.array_equal(pose[:3, :3], np.eye(3))
            what, want = ("moved", "distance 0 there") if slid else ("turned", "angle 0 there")
            raise InputError(join(case.place, f"bone[{i}].motion"), f"a bone {what} at the first frame", want)


def check_acting(acting: tuple[Record, ...], bones: list[str], frames: Frames, place: str) -> None:
    """Check that bones have a name each, contact is with some of them, and ``frames`` have an interval where time matters."""
    check_once(bones, join(place, "bone"))
    for i, effect in enumerate(acting):
        if isinstance(effect, Contact):
            check_used(bones, [(f"effect[{i}].bones", name) for name in effect.bones or ()], place)
            if effect.support is not None and in_situ.among(acting) is None:
                got = f"{effect.support:g} mm"
                raise InputError(join(place, f"effect[{i}].support"), got, 'it beside "in_situ" only')
            if effect.friction is not None and in_situ.among(acting) is not None:
                want = 'none beside "in_situ", which balances pressures at rest without friction'
                raise InputError(join(place, f"effect[{i}].friction"), f"{effect.friction:g}", want)
        if isinstance(effect, Effect) and "interval" in effect.needs and frames.interval is None:
            want = f"the time from a frame number to the next, which effect[{i}] ({effect.title}) needs"
            raise InputError(join(place, "frames.interval"), "nothing", want)
