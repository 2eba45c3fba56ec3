"""Strict reading of a ``case.toml`` as a ``Case``.

An unknown key, a missing key or an invalid value raises an InputError that names the file and the key.
"""

from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from typing import Any

from fem_reference.effects import Effect, FieldEffect, Interaction, in_situ, moduli, name_of, region_of
from fem_reference.effects import find as find_effect
from fem_reference.effects import names as effect_names
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, check_once, check_used, join, keys, parse
from fem_reference.io import texts
from fem_reference.scenes import numbers, ranges
from fem_reference.scenes.case import HOME, Case
from fem_reference.scenes.consistency import check_acting, check_names, check_rest
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase, alone
from fem_reference.scenes.scalar import ScalarCase


def cases() -> list[str]:
    """The names of the shipped cases."""
    return sorted(path.parent.name for path in (HOME / "cases").glob("*/case.toml"))


def read(case: str | Path, *, with_negative_control: bool = False, changes: dict[str, Any] | None = None) -> Case:
    """Read a shipped case by name, or the case in a folder or a file. A case with a ``domain`` has a scalar field.

    ``changes``: new values by key, such as ``"frames.last"`` or ``"effect[1].bulk"``. ``with_negative_control``: True to apply the
    negative control of the case. It is checked even if it is not applied, unless there are ``changes`` and they leave it as it is.
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
    plain = Path(case).name == str(case)  # True for a name, False for a path
    shipped = [HOME / "cases" / str(case) / "case.toml"] if plain else []
    found = list[Path]()
    for path in (*shipped, Path(case) / "case.toml", Path(case)):
        with suppress(OSError, ValueError):  # a name that is too long or contains a null character
            if path.is_file():
                found.append(path.resolve())
    if plain and len(set(found)) > 1:
        want = f"./{case} for the folder here, or {found[0].parent} for the shipped case"
        raise InputError("CASE", f'"{case}", which is a shipped case and a folder here', want)
    if found:
        return found[0]
    raise InputError("CASE", f'"{case}"', f"a scene file, a folder with a case.toml, or one of {', '.join(cases())}")


def _change(table: dict[str, Any], key: str, value: Any, place: str, *, add: bool = True) -> None:
    """Set a ``key`` in the ``table`` of a scene. If ``add`` is True, the key may be new in a table that exists."""
    *parents, last = numbers.parts(key)
    inside: Any = table
    try:
        for part in parents:
            inside = inside[part]
        if not (add and last and isinstance(inside, dict)):
            inside[last]  # raises an error if there is no value to change
        inside[last] = value
    except (KeyError, IndexError, TypeError) as error:
        want = f"a key that this scene has, or a key of a table that it has{_near(table, [*parents, last])}"
        raise InputError(join(place, key), "nothing", want) from error


def _near(table: dict[str, Any], parts: list[str | int]) -> str:
    """The end of a message on the missing key with these ``parts``: the keys that exist there; empty if there are none."""
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
    """Split ``KEY=VALUE`` of the command line into the key and the value, which is text unless it is valid TOML.

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
    """Read the case of a single muscle. ``changes``: new values by key."""
    return muscle(read(case, changes=changes))


def muscle(case: Case, place: str | None = None) -> MuscleCase:
    """The ``case`` itself if it has one muscle. Otherwise an InputError names ``place``, by default the file of the case."""
    if not isinstance(case, MuscleCase):
        kind = "a case of several muscles" if isinstance(case, MusclesCase) else "a scalar case"
        raise InputError(place or case.place, f'"{case.name}", {kind}', "the case of a muscle")
    return case


def _with_negative_control(case: Case, table: dict[str, Any], path: Path) -> Case:
    """The ``case`` with its negative control applied to a copy of its ``table``."""
    place, control = str(path), case.negative_control
    if control is None:
        raise InputError(join(place, "negative_control"), "None", "a key to change, its value and the reason")
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
    raise _wrong(
        case, "key", "a key that changes the solution, such as one of an effect: no other key can change a verdict"
    )


def _wrong(case: Case, part: str, want: str) -> InputError:
    """The InputError for a ``part`` (``key`` or ``value``) of the negative control."""
    value = getattr(case.negative_control, part)
    got = f'"{value}"' if isinstance(value, str) else repr(value)
    return InputError(join(case.place, f"negative_control.{part}"), got, want)


def _scene(table: dict[str, Any], path: Path) -> Case:
    return made(table, {"name": path.parent.name, "folder": path.parent, "place": str(path), "from_file": True})


def made(table: dict[str, Any], whose: dict[str, Any]) -> Case:
    """The checked case with the keys of ``table``. ``whose``: ``name``, ``folder`` and ``place``, and ``from_file`` for a file."""
    place = str(whose["place"])
    table = alone(table, place)
    record: type[Case]
    kind: type[Record]
    record, kind = (ScalarCase, FieldEffect) if "domain" in table else (MuscleCase, Effect)
    if isinstance(table.get("muscle"), list):
        several = [with_effects(one, join(place, f"muscle[{i}]")) for i, one in enumerate(table["muscle"])]
        record, table = MusclesCase, table | {"muscle": several}
    for key in whose:
        if key in table:
            raise InputError(join(place, key), "an unknown key", f"one of {', '.join(keys(record))}")
    case: Case = parse(record, with_effects(table, place, kind) | whose, place)
    runs = ["reference", "candidates", *(candidate.name for candidate in case.candidate)]
    check_once(runs, join(place, "candidate"))
    case.check_solvers()
    check_used(runs, [(f"expect[{i}].of", entry.of) for i, entry in enumerate(case.expect)], place)
    return _checked(case)


def with_numbers[C: Case](case: C, values: dict[str, float]) -> C:
    """A copy of the ``case`` with new numbers, checked like a case from a file. ``values``: numbers by key, in internal units."""
    made = numbers.changed(case, values)
    _check_effects([name_of(one) for one in made.effect], made.effect, made.place)
    return _checked(made)


def _checked[C: Case](case: C) -> C:
    if isinstance(case, MusclesCase):
        _check_muscles(case)
    if isinstance(case, MuscleCase):
        check_names(case)
        check_rest(case)
        ranges.check(case)
    return case


def with_effects(table: Any, place: str, kind: type[Record] = Effect) -> Any:
    """A copy of ``table`` in which the tables under the key ``effect`` are replaced by records of a ``kind``.

    Raises InputError if an effect is listed twice. Without a list of effects, ``table`` itself is returned.
    """
    entries = table.get("effect") if isinstance(table, dict) else None
    if not isinstance(entries, list | tuple):
        return table
    found = tuple(_effect(entry, join(place, f"effect[{i}]"), kind) for i, entry in enumerate(entries))
    names = [entry["name"] for entry in entries]
    _check_effects(names, found, place)
    return table | {"effect": found}


def _check_effects(names: list[str], effects: tuple[Record, ...], place: str) -> None:
    """Raise InputError if an effect acts twice in a region, or a load acts twice on a part of the surface.

    Two effects with the same name would share their unknowns. A bulk modulus below the shear modulus in the same region is refused
    too, as it is usually a mistake in units.
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


def _check_muscles(case: MusclesCase) -> None:
    """Raise InputError unless the names of muscles differ, no contact is stated for one muscle only, and each muscle is valid."""
    check_acting(case.effect, [bone.name for bone in case.bone], case.frames, case.place)
    others = [bone.name for bone in case.bone]
    others += [one.name for muscle in case.muscle for one in muscle.attachment]
    check_once([*(muscle.name for muscle in case.muscle), *dict.fromkeys(others)], join(case.place, "muscle"))
    check_once([muscle.name.lower() for muscle in case.muscle], join(case.place, "muscle"))  # they name folders
    if case.expect:
        raise InputError(join(case.place, "expect"), "expectations of all muscles", "muscle[i].expect, for each muscle")
    if in_situ.among(case.effects) is not None:
        raise InputError(join(case.place, "effect"), '"in_situ" with several muscles', "muscles without stress at rest")
    runs = ["reference", "candidates", *(candidate.name for candidate in case.candidate)]
    for i, muscle in enumerate(case.muscle):
        used = [(f"muscle[{i}].expect[{k}].of", entry.of) for k, entry in enumerate(muscle.expect)]
        check_used(runs, used, case.place)
        if any(isinstance(effect, Interaction) for effect in muscle.effect):
            want = "contact among the effects of the case, as it acts on all muscles"
            raise InputError(join(case.place, f"muscle[{i}].effect"), "contact of one muscle", want)
        part = case.parts[i]
        with case.placed(i):
            _check_effects([name_of(one) for one in part.effect], part.effect, part.place)
            _checked(part)
