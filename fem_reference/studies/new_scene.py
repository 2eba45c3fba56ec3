"""New scenes: a copy of a case, or a scene made from the surfaces of a muscle and its bones."""

import re
import shutil
from collections.abc import Container, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from string import Template

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface, check_closed, diagonal, enclosed_volume
from fem_reference.foundations.records import check_name
from fem_reference.foundations.units import LENGTH_UNITS, length_unit
from fem_reference.geometry.distance import distances
from fem_reference.io import files
from fem_reference.io.texts import toml_text
from fem_reference.scenes import casefile

# The units among which the unit of a file is guessed: those of LENGTH_UNITS that scanners and modelling programs write.
_GUESSED = ("mm", "cm", "m", "in")
# The possible lengths of muscles and bones [mm]. A unit that gives a length outside this range is ruled out.
_LONG = {"muscle": (20.0, 700.0), "bone": (5.0, 2500.0)}
# The maximum distance of a muscle from its bones, relative to the length of the muscle; beyond it the files do not fit together.
_APART = 0.5
# The possible fractions of the muscle's vertices that are attached to a bone: those nearest to it. The largest fraction for which
# the two attachments share no vertices is used.
_ATTACHED = (0.06, 0.04, 0.025, 0.015, 0.008)
_TETS, _REFINEMENTS = 5000, 1
_LONGEST = 60  # the maximum number of characters of a name that is changed because it does not suit scenes or files


@dataclass(frozen=True)
class Unit:
    """The ``name`` of the unit of length of surfaces; ``why`` is the reason for a guessed unit, empty for a given one."""

    name: str
    why: str = ""


@dataclass(frozen=True)
class _Attached:
    """An attachment: the ``vertices`` of the muscle ``within`` a distance [mm] of a ``bone``."""

    bone: str
    within: float
    vertices: Ints


def copied(case: str, folder: Path) -> None:
    """Copy a case, with the files next to it, into a new ``folder``."""
    scene = casefile.read(case)
    shutil.copytree(scene.folder, _new(folder))


def of_surfaces(folder: Path, muscle: Path, bones: Sequence[Path], unit: str | None) -> Unit:
    """Write a scene with surfaces in mm into a new ``folder`` of the same name; return the unit in which files were read.

    ``muscle`` and ``bones`` are files of triangles. The muscle is attached to the two bones nearest to it, of which the second
    moves. ``unit``: the unit of all files, one of ``LENGTH_UNITS``. If it is None, the unit is guessed: the only one that gives
    muscle and bones a usual length. Raises InputError if a file is unusable or a value cannot be guessed.
    """
    if len(bones) < 2:
        raise InputError("--bone", f"{len(bones)} files", "two or more, which the muscle connects")
    names = [path.stem for path in bones]
    if len({*names, "muscle"}) <= len(names):
        raise InputError("--bone", f"the names {', '.join(names)}", "files of different names, none of them muscle")
    _new(folder)
    body, *others = (files.read_surface(path, 1.0) for path in (muscle, *bones))
    used = guessed_unit(body, others) if unit is None else Unit(unit)
    try:
        factor = length_unit(used.name)
    except ValueError as error:
        raise InputError("--unit", f'"{unit}"', str(error)) from error
    ends = {name: _welded(one, factor) for name, one in zip(names, others, strict=True)}
    write(folder, check_closed(_welded(body, factor)), ends)
    return used


def write(folder: Path, muscle: Surface, bones: dict[str, Surface]) -> None:
    """Write the scene of a ``muscle`` and ``bones``, all in mm, into a new ``folder``. The names of bones may be any text."""
    around, paths = dict[str, Surface](), {"muscle": "muscle.ply"}
    for name, surface in bones.items():
        clean = _distinct(name if is_name(name) else _cleaned(name), {"muscle", *around})
        around[clean] = surface
        taken = {path.removesuffix(".ply") for path in paths.values()}
        paths[clean] = f"{_distinct(_cleaned(re.sub(r'[^a-z0-9_.-]', '_', clean.lower())), taken)}.ply"
    text = _text(_new(folder).name, muscle, around, paths)
    folder.mkdir(parents=True)
    for name, surface in {"muscle": muscle, **around}.items():
        files.write_surface(folder / paths[name], surface, surface.points)
    files.write_text(folder / "case.toml", text)


def is_name(name: str) -> bool:
    """True if ``name`` is allowed as a name in a scene file."""
    try:
        return bool(check_name(name))
    except ValueError:
        return False


def _cleaned(name: str) -> str:
    """The ``name`` shortened to one line of printable characters."""
    shown = "".join(letter if letter.isprintable() else "_" for letter in name)[:_LONGEST].strip()
    return shown.lstrip(".") or "bone"


def _distinct(name: str, taken: Container[str]) -> str:
    """The ``name``, with a number appended if the name is ``taken``."""
    numbered = (f"{name}_{i}" for i in count(2))
    return name if name not in taken else next(one for one in numbered if one not in taken)


def _new(folder: Path) -> Path:
    if not is_name(folder.name):
        want = "a name of at most 100 printable characters, without blanks at the ends"
        raise InputError("NAME", f'"{folder.name}"', want)
    if folder.exists():
        raise InputError("NAME", f'"{folder}", which exists already', "the name of a new folder")
    return folder


def guessed_unit(muscle: Surface, bones: Sequence[Surface]) -> Unit:
    """The only unit in which every surface has a possible size. Raises InputError if no unit or several units are possible."""
    fitting, said = list[set[str]](), list[str]()
    for surface, kind in ((muscle, "muscle"), *((bone, "bone") for bone in bones)):
        size, (least, most) = diagonal(surface.points), _LONG[kind]
        units = [unit for unit in _GUESSED if least <= size * LENGTH_UNITS[unit] <= most]
        fitting.append(set(units))
        name = _cleaned(Path(surface.place).name)
        said.append(f'"{name}" is {size:.3g} long, possible for a {kind} in {" or ".join(units) or "no unit"}')
    shared, why = set.intersection(*fitting), "; ".join(said)
    if len(shared) != 1:
        what = "several units suit" if shared else "no unit suits"
        raise InputError("--unit", f"no unit, but {why}: {what} all of them", f"one of {', '.join(LENGTH_UNITS)}")
    return Unit(shared.pop(), why)


def _welded(surface: Surface, unit: float) -> Surface:
    """The surface in mm with equal points merged, as STL files have three points for each triangle. ``unit``: its unit of length
    [mm]. The order of points is kept, and triangles whose corners are merged with each other are removed.
    """
    points = surface.points * unit
    _, first, which = np.unique(np.round(points, 6), axis=0, return_index=True, return_inverse=True)
    place = first.argsort().argsort()
    a, b, c = corners = place[which.ravel()[surface.triangles]].T
    whole = (a != b) & (b != c) & (c != a)
    return Surface(points[np.sort(first)], corners.T[whole], surface.place)


def _attachments(muscle: Surface, bones: dict[str, Surface]) -> tuple[_Attached, _Attached]:
    """Attachments to the two bones nearest to the muscle, each at the vertices nearest to the bone. No vertex is in both."""
    away = {name: distances(muscle.points, bone).distance for name, bone in bones.items()}
    first, second = sorted(away, key=lambda name: float(np.quantile(away[name], _ATTACHED[-1])))[:2]
    for name in (first, second):
        if (gap := float(away[name].min())) > _APART * diagonal(muscle.points):
            got = f'the bone "{name}" {gap:.3g} mm from the muscle, which is {diagonal(muscle.points):.3g} mm long'
            raise InputError(muscle.place, got, "surfaces in one unit (--unit) that are near each other")
    for share in _ATTACHED:
        one, other = (_nearest(name, away[name], share) for name in (first, second))
        if not np.intersect1d(one.vertices, other.vertices).size:
            return one, other
    got = f"{first} and {second} at the same end of the muscle"
    raise InputError(muscle.place, got, "bones at either end (or a scene of your own with lists of vertices)")


def _nearest(bone: str, away: Floats, share: float) -> _Attached:
    within = float(np.quantile(away, max(share, min(1.0, 12 / len(away)))))
    within = float(f"{1.001 * within + 0.01:.4g}")
    return _Attached(bone, within, np.flatnonzero(away <= within))


def _text(name: str, muscle: Surface, bones: dict[str, Surface], paths: dict[str, str]) -> str:
    """The text of the scene file. ``paths``: the paths of the surfaces by name."""
    ends = _attachments(muscle, bones)
    volume = enclosed_volume(muscle.points, muscle.triangles)
    wanted = np.cbrt(6 * np.sqrt(2) * volume / _TETS * 8**_REFINEMENTS)
    size = min(float(wanted), float(np.ptp(muscle.points, axis=0).min()) / 2)
    source, moving = _cleaned(Path(muscle.place).name), ends[1].bone
    # The moving bone comes last, because its motion follows in the template.
    others = [bone for bone in bones if bone != moving]
    axis, centre = _joint(muscle, bones, ends)
    surfaces = "\n".join(
        f'[[bone]]\nname = {toml_text(bone)}\nsurface = {toml_text(paths[bone])}\nunit = "mm"\n'
        for bone in (*others, moving)
    )
    attachments = "\n".join(
        f"[[attachment]] # {len(end.vertices)} vertices of the muscle, those nearest to {end.bone}\n"
        f'name = "{which}"\nbone = {toml_text(end.bone)}\nwithin = "{end.within:g} mm"\n'
        for which, end in zip(("origin", "insertion"), ends, strict=True)
    )
    return Template(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).substitute(
        name=name,
        title=toml_text(name.replace("_", " ").strip() or name),
        proves=toml_text(f"The motion of the muscle of {source} with {moving}."),
        muscle=source,
        triangles=len(muscle.triangles),
        length=f"{diagonal(muscle.points):.0f}",
        volume=f"{volume / 1000:.3g}",
        size=f"{size:.3g}",
        tets=_TETS,
        refinements=_REFINEMENTS,
        bones=surfaces,
        moving=moving,
        axis="[" + ", ".join(f"{one:.4f}" for one in axis) + "]",
        centre=", ".join(f"{one:.4g}" for one in centre),
        attachments=attachments,
    )


def _joint(muscle: Surface, bones: dict[str, Surface], ends: tuple[_Attached, _Attached]) -> tuple[Floats, Floats]:
    """A guess of the axis (3,) and the centre (3,) [mm] of the rotation between two bones. The axis is perpendicular to the line
    between the attachments; the centre lies midway between the nearest points of the bones.
    """
    first, second = (bones[end.bone].points for end in ends)
    away, which = cKDTree(first).query(second)
    nearest = int(away.argmin())
    centre = (second[nearest] + first[which[nearest]]) / 2
    one, other = (muscle.points[end.vertices].mean(axis=0) for end in ends)
    axis = np.cross(other - one, centre - (one + other) / 2)
    length = float(np.linalg.norm(axis))
    return (axis / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])), centre
