"""case.toml -> Scene: strict reading. An unknown, missing or wrong key is an InputError that names file and key."""

import re
import tomllib
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.effects import Effect
from fem_reference.effects import find as find_effect
from fem_reference.effects import names as effect_names
from fem_reference.errors import InputError
from fem_reference.records import join, parse
from fem_reference.scene import HOME, Scene, SceneFile, Spoil


def cases() -> list[str]:
    """The names of the shipped cases."""
    return sorted(path.parent.name for path in (HOME / "cases").glob("*/case.toml"))


def read(case: str | Path, *, spoiled: bool = False, changes: dict[str, Any] | None = None) -> Scene:
    """The scene of a shipped case (by name), a folder with a ``case.toml``, or a scene file.

    ``changes`` maps keys such as ``"frames.last"`` or ``"effect[1].bulk"`` to other values; ``spoiled`` applies the case's spoil.
    That the spoil can be applied is checked too, except after changes of other keys: they may take away what it spoils.
    """
    path = _scene_file(case)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, str(error), "a TOML file") from error
    for key, value in (changes or {}).items():
        _change(table, key, value, str(path))
    if spoiled:
        return _spoiled(table, path)
    scene = _scene(table, path)
    if not changes or any(key.startswith("spoil") for key in changes):
        _check_spoil(scene, _spoiled(table, path))
    return scene


def _scene_file(case: str | Path) -> Path:
    for path in (HOME / "cases" / str(case) / "case.toml", Path(case) / "case.toml", Path(case)):
        if path.is_file():
            return path.resolve()
    raise InputError("CASE", f'"{case}"', f"a scene file, a folder with a case.toml, or one of {', '.join(cases())}")


def _change(table: dict[str, Any], key: str, value: Any, place: str) -> None:
    parts = re.findall(r"[^.\[\]]+", key) or [""]
    *way, last = [int(part) if part.isdecimal() else part for part in parts]
    inside: Any = table
    try:
        for part in way:
            inside = inside[part]
        inside[last]  # a change replaces what is there
        inside[last] = value
    except (KeyError, IndexError, TypeError) as error:
        raise InputError(join(place, key), "nothing", "a key of this scene") from error


def _spoiled(table: dict[str, Any], path: Path) -> Scene:
    """The scene with its spoil applied; ``table`` stays as it is."""
    place = str(path)
    spoil = parse(Spoil, table.get("spoil"), join(place, "spoil"))
    table = deepcopy(table)
    try:
        _change(table, spoil.key, spoil.value, place)
    except InputError as error:
        raise InputError(join(place, "spoil.key"), f'"{spoil.key}"', "a key of this scene") from error
    try:
        return _scene(table, path)
    except InputError as error:
        why = str(error).removeprefix(f"{place}: ")
        raise InputError(join(place, "spoil.value"), _told(spoil), f"a value that can be read ({why})") from error


def _check_spoil(scene: Scene, spoiled: Scene) -> None:
    if spoiled.model_copy(update={"spoil": scene.spoil}) == scene:
        raise InputError(
            join(scene.place, "spoil.value"), _told(scene.spoil), f"a value that changes {scene.spoil.key}"
        )


def _told(spoil: Spoil) -> str:
    return f'"{spoil.value}"' if isinstance(spoil.value, str) else repr(spoil.value)


def _scene(table: dict[str, Any], path: Path) -> Scene:
    place = str(path)
    effects = table.get("effect", [])
    if isinstance(effects, list):
        table = table | {"effect": tuple(_effect(entry, f"{place}: effect[{i}]") for i, entry in enumerate(effects))}
    inside = parse(SceneFile, {"candidate": ()} | table, place)
    if isinstance(effects, list):
        _check_effects([entry["name"] for entry in effects], place)
    scene = Scene(name=path.parent.name, folder=path.parent, **dict(inside))
    _check_names(scene)
    _check_rest(scene)
    return scene


def _check_effects(names: list[str], place: str) -> None:
    """An effect acts once: two of a name would share the unknowns that it brings."""
    for i, name in enumerate(names):
        if name in names[:i]:
            raise InputError(join(place, f"effect[{i}].name"), f'"{name}" a second time', "every effect once")


def _effect(table: Any, place: str) -> Effect:
    if not isinstance(table, dict) or table.get("name") not in effect_names():
        got = table.get("name") if isinstance(table, dict) else table
        raise InputError(f"{place}.name", f'"{got}"', f"one of {', '.join(effect_names())}")
    return parse(find_effect(table["name"]), {key: value for key, value in table.items() if key != "name"}, place)


def _check_names(scene: Scene) -> None:
    """Names are used once and refer to something."""
    bones = [bone.name for bone in scene.bone]
    attachments = [attachment.name for attachment in scene.attachment]
    candidates = ["reference", "candidates", *(candidate.name for candidate in scene.candidate)]
    for key, list_of_names in (("bone", bones), ("attachment", attachments), ("candidate", candidates)):
        twice = next((name for name in list_of_names if list_of_names.count(name) > 1), None)
        if twice is not None:
            raise InputError(join(scene.place, key), f'the name "{twice}" twice', "every name once")
    traced = scene.fibres.traced
    wanted = [(f"attachment[{i}].bone", entry.bone, bones) for i, entry in enumerate(scene.attachment)]
    wanted += [(f"fibres.traced.{end}", getattr(traced, end), attachments) for end in ("start", "end") if traced]
    wanted += [(f"expect[{i}].of", entry.of, candidates) for i, entry in enumerate(scene.expect)]
    for key, name, known in wanted:
        if name not in known:
            raise InputError(join(scene.place, key), f'"{name}"', f"one of {', '.join(known)}")


def _check_rest(scene: Scene) -> None:
    """At the first frame every bone is where its surface is."""
    for i, bone in enumerate(scene.bone):
        pose = bone.motion.rotation().pose(scene.frames.first) if bone.motion else np.eye(4)
        if not abs(pose - np.eye(4)).max() <= 1e-12:  # NaN is no rest
            raise InputError(
                join(scene.place, f"bone[{i}].motion"), "a bone turned at the first frame", "angle 0 there"
            )
