"""case.toml -> Scene: strict reading. An unknown, missing or wrong key is an InputError that names file and key."""

import re
import tomllib
from pathlib import Path
from typing import Any

from fem_reference.effects import Effect
from fem_reference.effects import find as find_effect
from fem_reference.effects import names as effect_names
from fem_reference.errors import InputError
from fem_reference.records import join, parse
from fem_reference.scene import HOME, Scene, Spoil


def cases() -> list[str]:
    """The names of the shipped cases."""
    return sorted(path.parent.name for path in (HOME / "cases").glob("*/case.toml"))


def read(case: str | Path, *, spoiled: bool = False, changes: dict[str, Any] | None = None) -> Scene:
    """The scene of a shipped case (by name), a folder with a ``case.toml``, or a scene file.

    ``changes`` maps keys such as ``"frames.last"`` or ``"effect[1].bulk"`` to other values; ``spoiled`` applies the case's spoil.
    """
    path = _scene_file(case)
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(path, str(error), "a TOML file") from error
    for key, value in (changes or {}).items():
        _change(table, key, value, str(path))
    if spoiled:
        spoil = parse(Spoil, table.get("spoil"), join(str(path), "spoil"))
        _change(table, spoil.key, spoil.value, str(path))
    return _scene(table, path)


def _scene_file(case: str | Path) -> Path:
    for path in (HOME / "cases" / str(case) / "case.toml", Path(case) / "case.toml", Path(case)):
        if path.is_file():
            return path.resolve()
    raise InputError("CASE", f'"{case}"', f"a scene file, a folder with a case.toml, or one of {', '.join(cases())}")


def _change(table: dict[str, Any], key: str, value: Any, place: str) -> None:
    *way, last = [int(part) if part.isdigit() else part for part in re.findall(r"[^.\[\]]+", key)]
    inside: Any = table
    try:
        for part in way:
            inside = inside[part]
        inside[last]  # a change replaces what is there
        inside[last] = value
    except (KeyError, IndexError, TypeError) as error:
        raise InputError(join(place, key), "nothing", "a key of this scene") from error


def _scene(table: dict[str, Any], path: Path) -> Scene:
    place = str(path)
    effects = table.get("effect", [])
    if isinstance(effects, list):
        table = table | {"effect": tuple(_effect(entry, f"{place}: effect[{i}]") for i, entry in enumerate(effects))}
    scene = parse(Scene, {"candidate": ()} | table | {"name": path.parent.name, "folder": path.parent}, place)
    _check_names(scene)
    return scene


def _effect(table: Any, place: str) -> Effect:
    if not isinstance(table, dict) or table.get("name") not in effect_names():
        got = table.get("name") if isinstance(table, dict) else table
        raise InputError(f"{place}.name", f'"{got}"', f"one of {', '.join(effect_names())}")
    return parse(find_effect(table["name"]), {key: value for key, value in table.items() if key != "name"}, place)


def _check_names(scene: Scene) -> None:
    """Names are used once and refer to something."""
    bones = [bone.name for bone in scene.bone]
    attachments = [attachment.name for attachment in scene.attachment]
    candidates = ["reference", *(candidate.name for candidate in scene.candidate)]
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
    for i, bone in enumerate(scene.bone):
        angle = bone.motion.rotation().pose(scene.frames.first) if bone.motion else None
        if angle is not None and abs(angle - [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]).max() > 1e-12:
            raise InputError(
                join(scene.place, f"bone[{i}].motion"), "a bone turned at the first frame", "angle 0 there"
            )
