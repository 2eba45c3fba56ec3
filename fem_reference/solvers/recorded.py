"""A solver that reads deformed surfaces, computed by another program, from files and checks them against the scene."""

import hashlib
import logging
import math
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface, check_finite, diagonal
from fem_reference.foundations.records import FileName, Name, Record, parse
from fem_reference.foundations.units import LengthUnit, length_unit
from fem_reference.io import files, texts
from fem_reference.io.formats import formats
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.scenes.case import Candidate
from fem_reference.solvers.common.protocol import MuscleSolver

log = logging.getLogger(__name__)

# There is a warning if the first frame is farther than this [mm] (rms) from the rest surface; rounding in any format is less.
AT_REST = 0.1
# The maximum distance of the first frame from rest, in diagonals of the rest surface's bounding box: more than solvers move points
# in their first frame, and less than the effect of a wrong unit (at a tenth of the size, the rms distance is at least 0.9 times the
# rms radius: 0.26 diagonals for a sphere).
NEAR_REST = 0.05
# The minimum size of a frame relative to rest. No solver shrinks a body so much, but coordinates in m are 1/1000 of those in mm.
SMALLEST = 1 / 50
# The maximum distance [mm] between corners of an STL file that are the same vertex: three times the spacing of float32 at 500 mm.
SAME_POINT = 1e-4
# The maximum difference between a time and the time of its frame, in frames: more than rounding to four digits, far less than 0.5.
ON_FRAME = 1e-3

_INDICES = (".pvd", ".xdmf")
# The file next to the frames that describes a sequence.
ABOUT = "candidate.toml"


class RecordedSettings(Record):
    """The location of the recorded frames and their unit of length.

    ``folder``: a folder with a mesh file for each frame, whose frame number is the last number in the file name; a .pvd or .xdmf
    file, or a folder that contains such a file; or the folder of a stored run.
    """

    folder: str
    unit: LengthUnit


class About(Record):
    """The contents of ``candidate.toml``.

    ``name``, ``version``: the program that computed the sequence. ``unit``: the unit of length. ``seconds_per_frame``: the time to
    solve one frame. ``threads``: the number of threads. ``left_out``: the parts of the scene that the program does not model, in
    words. The other keys are for standings. ``group``: the group of the method. ``case``: the case. ``scene``: the key of the
    scene, which the export states. ``sha256``: the hashes of files, by file name, which are checked.
    """

    name: FileName | None = None
    version: Name | None = None
    unit: str | None = None
    seconds_per_frame: float | None = Field(default=None, gt=0)
    threads: int | None = Field(default=None, gt=0)
    left_out: tuple[str, ...] = ()
    group: str | None = None
    case: Name | None = None
    scene: str | None = None
    sha256: dict[FileName, str] = Field(default_factory=dict)

    @property
    def lacks(self) -> str:
        """The end of a sentence, with a list of the parts that are left out; empty if there are none."""
        return f"; left out: {', '.join(self.left_out)}" if self.left_out else ""

    @field_validator("unit")
    @classmethod
    def _check_unit(cls, unit: str) -> str:
        length_unit(unit)
        return unit


def about(path: Path) -> About:
    """The ``candidate.toml`` of the sequence at ``path``, a folder or an index file; an empty record if the file does not exist."""
    file = _about_file(path)
    return parse(About, texts.toml(file), str(file)) if os.path.lexists(file) else About()


def choice(path: Path, unit: str | None = None, place: str = "folder") -> Candidate:
    """A candidate whose frames are recorded in the folder or file at ``path``.

    Its name, and its unit if no ``unit`` is given, are from the ``candidate.toml`` of the frames. ``place``: the name of the path
    in messages.
    """
    if not path.exists() or not path.parts:
        raise InputError(place, f'"{path}"', "a folder of frames")
    folder = path.resolve()
    said = about(folder)
    plain = re.sub(r"[^\w.-]+", "_", folder.stem if folder.is_file() else folder.name)
    name = said.name or plain.lstrip(".")[:100] or "candidate"
    unit = said.unit or "mm" if unit is None else unit
    return parse(Candidate, {"name": name, "solver": "recorded", "folder": str(folder), "unit": unit}, place)


def _about_file(path: Path) -> Path:
    return (path if path.is_dir() else path.parent) / ABOUT


def origin(settings: RecordedSettings) -> dict[str, Any]:
    """The provenance of a run: name and version of the program, as stated in ``candidate.toml``."""
    said = about(Path(settings.folder)).model_dump(exclude_none=True, include={"name", "version"})
    return {"candidate": said} if said else {}


def solve(setup: Setup, settings: RecordedSettings, sink: Sink) -> Outcome:
    """Read and check all requested frames, then pass them to ``sink``. The cost is from ``candidate.toml``."""
    folder = Path(settings.folder)
    said = checked_about(folder, settings.unit)
    frames = list(checked_frames(setup, folder, settings.unit))
    for frame in frames:
        sink(frame)
    cost = said.model_dump(exclude_none=True, include={"seconds_per_frame", "threads"})
    message = f"read {len(frames)} frames from {_source(folder)}{said.lacks}"
    return Outcome("converged", message, {key: float(cost[key]) for key in cost})


def checked_frames(setup: Setup, folder: Path, unit: float) -> Iterator[Frame]:
    """Yield the requested frames of the sequence in ``folder``, whose unit of length is ``unit`` [mm].

    Times in an index file are multiples of ``setup.interval`` [s], or frame numbers if the interval is None. Raises InputError at
    the first frame that is missing or does not have the surface of ``setup``.
    """
    source = _source(folder)
    sequence = _sequence(source, unit, setup.interval)
    missing = [str(number) for number in setup.frames if number not in sequence]
    for number in setup.frames:
        if number not in sequence:
            there = f"{min(sequence)} to {max(sequence)}" if sequence else "none"
            got = f"no frame {', '.join(missing)} (there are {len(sequence)}: {there})"
            raise InputError(source, got, "every requested frame")
        entry = sequence[number]
        surface = entry if isinstance(entry, Surface) else files.read_surface(entry, unit)
        positions = _positions(surface, setup.surface)
        if number == setup.frames[0]:
            _check_at_rest(surface.place, number, positions, setup.surface)
        size = diagonal(positions) / diagonal(setup.surface.points)
        if not size >= SMALLEST:
            got = f"a surface of {size:.2g} times the size at rest"
            raise InputError(surface.place, got, "one unit of length in all frames")
        yield Frame(number, positions)


def checked_about(folder: Path, unit: float | None) -> About:
    """The ``candidate.toml`` of the sequence in ``folder``.

    Raises InputError if it states a unit other than ``unit`` [mm], or if a file does not have the hash that it states.
    """
    said = about(folder)
    if said.unit is not None and unit is not None and length_unit(said.unit) != unit:
        place = f"{_about_file(folder)}: unit"
        raise InputError(place, f'"{said.unit}"', f"the unit of --unit or of the case, {unit:g} mm")
    for name, wanted in said.sha256.items():
        file = _about_file(folder).with_name(name)
        got = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else "no file"
        if got != wanted:
            raise InputError(f"{_about_file(folder)}: sha256.{name}", got, wanted)
    return said


def _source(path: Path) -> Path:
    """The folder with mesh files, or the index file, that ``path`` stands for."""
    if (path / "run.json").is_file():
        return path / "surface"
    if path.is_dir():
        indices = sorted(file for file in _visible(path) if file.suffix.lower() in _INDICES)
        if len(indices) > 1:
            raise InputError(path, f"the sequences {indices[0].name} and {indices[1].name}", "one of them")
        return indices[0] if indices else path
    if path.suffix.lower() not in _INDICES or not path.is_file():
        raise InputError(path, "another kind of file, or nothing", "a folder, or a .pvd or .xdmf file")
    return path


def _visible(folder: Path) -> list[Path]:
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def _sequence(source: Path, unit: float, interval: float | None) -> dict[int, Path | Surface]:
    """The surface of each frame, or the file that contains it, by frame number."""
    entries: Iterable[tuple[int | None, str, Path | Surface]]
    if source.suffix.lower() == ".xdmf":
        steps = files.read_xdmf(source, unit)
        entries = ((_number(time, interval), step.place, step) for time, step in steps)
    elif source.suffix.lower() == ".pvd":
        entries = ((_number(time, interval), path.name, path) for time, path in files.read_pvd(source))
    else:
        meshes = [path for path in _visible(source) if path.suffix.lower() in formats()]
        last = {path: re.findall(r"\d+", path.stem)[-1:] for path in meshes}  # the last number in each name
        entries = ((int(digits[0]), path.name, path) for path, digits in last.items() if digits)
    found: dict[int, tuple[str, Path | Surface]] = {}
    for number, name, frame in entries:
        if number in found:
            raise InputError(source, f"frame {number} in {found[number][0]} and {name}", "every frame once")
        if number is not None:
            found[number] = (name, frame)
    return {number: frame for number, (_, frame) in found.items()}


def _number(time: float, interval: float | None) -> int | None:
    """The frame number at a ``time``; None if the time is between two frames."""
    number = time if interval is None else time / interval
    return round(number) if math.isfinite(number) and abs(number - round(number)) < ON_FRAME else None


def _positions(surface: Surface, rest: Surface) -> Floats:
    """The points (n, 3) [mm] of ``surface``. Raises InputError if it does not have the vertices and triangles of ``rest``.

    The vertices must be in the same order as in ``rest``. The triangles may be in any order, and all of them may be reversed.
    """
    check_finite(surface)
    want = f"the vertices and triangles of {rest.place}"
    if len(surface.triangles) != len(rest.triangles):
        raise InputError(surface.place, f"{len(surface.triangles)} triangles instead of {len(rest.triangles)}", want)
    if not files.shares_points(surface.place):
        return _welded(surface, rest)
    if len(surface.points) != len(rest.points):
        raise InputError(surface.place, f"{len(surface.points)} vertices instead of {len(rest.points)}", want)
    if np.array_equal(surface.triangles, rest.triangles):
        return surface.points
    orders = (_strangers(surface.triangles, triangles) for triangles in (rest.triangles, rest.triangles[:, ::-1]))
    other = min(orders, key=np.count_nonzero)
    if other.any():
        got = (
            f"{np.count_nonzero(other)} triangles with other vertices, the first of which is triangle {other.argmax()}"
        )
        raise InputError(surface.place, got, want)
    return surface.points


def _strangers(triangles: Ints, rest: Ints) -> NDArray[np.bool_]:
    """A mask (m,) of the ``triangles`` (m, 3) that occur more often than in ``rest`` (m, 3), whichever corner comes first."""
    both = np.concatenate([_turned(triangles), _turned(rest)])
    which = np.unique(both, axis=0, return_inverse=True)[1].ravel()
    here, there = which[: len(triangles)], which[len(triangles) :]
    more = np.bincount(here, minlength=len(both)) > np.bincount(there, minlength=len(both))
    return np.asarray(more[here])


def _turned(triangles: Ints) -> Ints:
    """The ``triangles`` (m, 3), each beginning with its lowest vertex index and with the same orientation."""
    corners = (triangles.argmin(axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, corners, axis=1)


def _welded(soup: Surface, rest: Surface) -> Floats:
    """The positions (n, 3) [mm] of the vertices of ``rest``, from a ``soup`` of the same triangles in the same order.

    Triangles of a soup share no vertices, as in an STL file. Raises InputError if the corners at a vertex do not coincide.
    """
    points, found = np.full(rest.points.shape, np.nan), []
    for vertices in (rest.triangles.ravel(), rest.triangles[:, ::-1].ravel()):
        points[vertices] = soup.points
        gaps = np.linalg.norm(points[vertices] - soup.points, axis=1)  # from the last corner at the same vertex
        found.append((float(gaps.max()), int(vertices[gaps.argmax()]), points.copy()))
    gap, vertex, points = min(found, key=lambda one: one[0])
    if gap > SAME_POINT:
        got = f"corners of vertex {vertex} that are {gap:.3g} mm apart"
        raise InputError(soup.place, got, f"the triangles of {rest.place} in their order")
    return points


def _check_at_rest(place: str, number: int, positions: Floats, rest: Surface) -> None:
    """Raise InputError if the first frame is far from ``rest``, and log a warning if it differs slightly."""
    away = float(np.sqrt(np.mean(np.sum((positions - rest.points) ** 2, axis=1))))
    limit = NEAR_REST * diagonal(rest.points)
    got = f"a first frame ({number}) that is {away:.3g} mm (rms) from the rest surface {rest.place}"
    if not away <= limit:
        raise InputError(place, got, f"at most {limit:.3g} mm; the usual reason is another unit or another mesh")
    if away > AT_REST:
        log.warning("%s: %s, which adds to every measure", place, got)


SOLVES = (
    MuscleSolver(settings=RecordedSettings, solve=solve, moves="nothing", example={"folder": "frames", "unit": "mm"}),
)
