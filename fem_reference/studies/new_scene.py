"""New scenes: a copy of a case, or one made of the surfaces of a muscle and its bones."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from string import Template

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface, check_closed, enclosed_volume
from fem_reference.geometry.distance import distances
from fem_reference.io import files
from fem_reference.scenes import casefile

UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
# Muscles are so long [mm]; where only one unit makes a length one of these, it is taken for that.
_LONG = (20.0, 700.0)
# Attached are so many of the vertices, those nearest to a bone; fewer where two attachments would share some.
_ATTACHED = (0.06, 0.04, 0.025, 0.015, 0.008)
_TETS, _REFINEMENTS = 5000, 1


@dataclass(frozen=True)
class _Attached:
    """An attachment to a bone: the vertices ``within`` a distance [mm] of it."""

    bone: str
    within: float
    vertices: Ints


def copied(case: str, folder: Path) -> Path:
    """A copy of a case, with the files beside it, in a new ``folder``; returns that."""
    scene = casefile.read(case)
    shutil.copytree(scene.folder, _new(folder))
    return folder


def of_surfaces(folder: Path, muscle: Path, bones: Sequence[Path], unit: str | None) -> Path:
    """A scene in a new ``folder`` that can be run, with the surfaces in mm; returns the folder.

    Parameters
    ----------
    folder
        Where it goes; its name is the name of the scene.
    muscle, bones
        Files of triangles. The muscle is attached to the two bones that it is nearest to, and the second of these moves.
    unit
        Of all of them, ``"mm"``, ``"cm"`` or ``"m"``; None: by the size of the muscle.

    Raises
    ------
    InputError
        Names the file that cannot be used, or what cannot be guessed.

    """
    if len(bones) < 2:
        raise InputError("--bone", f"{len(bones)} files", "two or more: a muscle goes from one to another")
    names = [path.stem for path in bones]
    if len({*names, "muscle"}) <= len(names):
        raise InputError("--bone", f"the names {', '.join(names)}", "files of different names, none of them muscle")
    factor = UNITS[unit] if unit else _unit(files.read_surface(muscle, 1.0))
    body = check_closed(_welded(files.read_surface(muscle, factor)))
    around = {name: _welded(files.read_surface(path, factor)) for name, path in zip(names, bones, strict=True)}
    attached = _attachments(body, around)
    text = _text(folder.name, muscle, body, around, attached)
    _new(folder).mkdir(parents=True)
    for name, surface in {"muscle": body, **around}.items():
        files.write_surface(folder / f"{name}.ply", surface, surface.points)
    files.write_text(folder / "case.toml", text)
    return folder


def _new(folder: Path) -> Path:
    if folder.exists():
        raise InputError("NAME", f'"{folder}", which is there already', "the name of a folder that is not there yet")
    return folder


def _unit(surface: Surface) -> float:
    """The unit [mm] of a muscle's coordinates, by its size."""
    size = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    fitting = [name for name, factor in UNITS.items() if _LONG[0] <= size * factor <= _LONG[1]]
    if len(fitting) != 1:
        got = f"none, with a muscle of length {size:.3g}, which may be in {' or '.join(fitting or UNITS)}"
        raise InputError("--unit", got, f"one of {', '.join(UNITS)}")
    return UNITS[fitting[0]]


def _welded(surface: Surface) -> Surface:
    """The surface with one point where several are the same: STL files have three points a triangle."""
    rounded = np.round(surface.points, 6)
    _, first, which = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # as they come
    place = np.empty_like(order)
    place[order] = np.arange(len(order))
    triangles = place[which.ravel()[surface.triangles]]
    whole = np.array([len({*corners}) == 3 for corners in triangles.tolist()], bool)
    return Surface(surface.points[np.sort(first)], triangles[whole], surface.place)


def _attachments(muscle: Surface, bones: dict[str, Surface]) -> tuple[_Attached, _Attached]:
    """Where the muscle is nearest to the two bones that it is nearest to, without a vertex that both would have."""
    away = {name: distances(muscle.points, bone).distance for name, bone in bones.items()}
    first, second = sorted(away, key=lambda name: float(np.quantile(away[name], _ATTACHED[-1])))[:2]
    for share in _ATTACHED:
        ends = [_nearest(name, away[name], share) for name in (first, second)]
        if not set(ends[0].vertices.tolist()) & set(ends[1].vertices.tolist()):
            return ends[0], ends[1]
    got = f"{first} and {second} at the same end of it"
    raise InputError(muscle.place, got, "bones at either end (or a scene of your own with lists of vertices)")


def _nearest(bone: str, away: Floats, share: float) -> _Attached:
    within = float(np.quantile(away, max(share, min(1.0, 12 / len(away)))))
    within = float(f"{1.001 * within + 0.01:.4g}")
    return _Attached(bone, within, np.flatnonzero(away <= within))


def _text(
    name: str, source: Path, muscle: Surface, bones: dict[str, Surface], ends: tuple[_Attached, _Attached]
) -> str:
    volume = enclosed_volume(muscle.points, muscle.triangles)
    wanted = np.cbrt(6 * np.sqrt(2) * volume / _TETS * 8**_REFINEMENTS)
    size = min(float(wanted), float(np.ptp(muscle.points, axis=0).min()) / 2)
    moving = ends[1].bone
    others = [bone for bone in bones if bone != moving]  # the motion follows the last bone
    axis, centre = _joint(muscle, bones, ends)
    surfaces = "\n".join(
        f'[[bone]]\nname = "{bone}"\nsurface = "{bone}.ply"\nunit = "mm"\n' for bone in (*others, moving)
    )
    attachments = "\n".join(
        f"[[attachment]] # {len(end.vertices)} vertices of the muscle, those nearest to {end.bone}\n"
        f'name = "{which}"\nbone = "{end.bone}"\nwithin = "{end.within:g} mm"\n'
        for which, end in zip(("origin", "insertion"), ends, strict=True)
    )
    return Template(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")).substitute(
        name=name,
        title=name.replace("_", " "),
        muscle=source.name,
        triangles=len(muscle.triangles),
        length=f"{np.linalg.norm(np.ptp(muscle.points, axis=0)):.0f}",
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
    """A guess of an axis and a centre of the motion between two bones: where these are nearest, across the muscle."""
    first, second = (bones[end.bone].points for end in ends)
    away, which = cKDTree(first).query(second)
    nearest = int(away.argmin())
    centre = (second[nearest] + first[which[nearest]]) / 2
    one, other = (muscle.points[end.vertices].mean(axis=0) for end in ends)
    axis = np.cross(other - one, centre - (one + other) / 2)
    length = float(np.linalg.norm(axis))
    return (axis / length if length > 1e-6 else np.array([1.0, 0.0, 0.0])), centre
