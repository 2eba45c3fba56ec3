"""Run and the run store: what a solver produced, one folder a run, written as it goes.

    <store>/<solver>-<key>/run.json        status, cost, origin, numbers per frame
                          /surface.pvd     the user's surface over the frames, for ParaView; surface/frame_0010.vtp
                          /rest/           surface.vtp and fibres.vtp at rest, of a solver that moves no surface
                          /fibres.pvd      fibre polylines, where the solver has an interior
                          /tets.pvd        tetrahedra, where the solver has them
                          /field.pvd       a scalar field on its mesh, where that is what is solved (``fields``)
                          /state/          the unknowns of the tetrahedra, where they were asked for (``states``)
                          /restart/        of a run that is made or was cut off: what its solver goes on from (``cut_off``)

A file appears whole or not at all; ``run.json`` after the frame files that it names. A run whose status is ``running`` was cut off;
it is not read as a result, and goes on where its solver can, as one that crashed.
"""

import json
import logging
import math
import shutil
import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import fact_table
from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh, check_corners
from fem_reference.foundations.records import parse
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files, texts
from fem_reference.runs import cut_off, fields, states
from fem_reference.runs.contents import FORMAT, Contents, Status
from fem_reference.runs.cut_off import CutOff
from fem_reference.runs.fields import NodalField
from fem_reference.scenes.case import Part

log = logging.getLogger(__name__)

# Between the first and the last frame, progress is reported no more often than this [s].
QUIET = 1.0


@dataclass(frozen=True, eq=False)
class Frame:
    """One requested frame: positions [mm] of the surface (n, 3), None of a solver that moves none, and where the solver has them
    of the fibre points (m, 3) and tet points (k, 3); ``scalars`` by name; ``note`` is what progress says of it; ``state`` the
    unknowns of the tets, where they were asked for; ``field``, of a scalar problem; ``residuals`` of Newton's last load step.
    """

    number: int
    surface: Floats | None = None
    fibres: Floats | None = None
    tets: Floats | None = None
    scalars: dict[str, float] = field(default_factory=dict)
    note: str = ""
    state: states.NodalState | None = None
    field: NodalField | None = None
    residuals: tuple[float, ...] = ()


Sink = Callable[[Frame], None]


@dataclass(frozen=True)
class Outcome:
    """How a solve ended: a status, a sentence for people, and what it cost (seconds by phase ``seconds_...``, counts)."""

    status: Status
    message: str
    cost: dict[str, float] = field(default_factory=dict)


# The surface of a run that moves none.
NO_SURFACE = Surface(np.zeros((0, 3)), np.zeros((0, 3), np.int64))


@dataclass(frozen=True, eq=False)
class Run:
    """Frames that somebody's solver produced for a case.

    ``numbers`` (f,), ``positions`` (f, n, 3) [mm] of the vertices of ``surface`` (its rest state), ``fibre_positions``
    (f, m, 3) [mm] of the points of ``fibres`` or None for a surface-only solver, ``scalars`` by name (f,). A solver of lines
    alone moves no surface: ``has_surface`` is False, and every entry of ``positions`` NaN. A scalar run has a ``mesh`` in their
    place, and ``fields`` by name (f, ...) at its nodes, as :class:`NodalField` has them. ``residuals`` by frame.
    """

    name: str
    solver: str
    outcome: Outcome
    numbers: tuple[int, ...]
    surface: Surface = NO_SURFACE
    positions: Floats = field(default_factory=lambda: np.zeros((0, 0, 3)))
    fibres: Polylines | None = None
    fibre_positions: Floats | None = None
    scalars: dict[str, Floats] = field(default_factory=dict)
    origin: dict[str, Any] = field(default_factory=dict)
    folder: Path | None = None
    has_surface: bool = True
    mesh: FieldMesh | None = None
    fields: dict[str, Floats] = field(default_factory=dict)
    residuals: tuple[tuple[float, ...], ...] = ()

    @property
    def carries(self) -> frozenset[Part]:
        """What can be measured of it."""
        if self.mesh is not None:
            return frozenset({"field"})
        return frozenset({"surface", "lines"}) if self.has_surface else frozenset({"lines"})

    @property
    def points(self) -> Floats:
        """The vertices (n, d) that a field is on, else those of the surface at rest (n, 3) [mm]."""
        return self.surface.points if self.mesh is None else self.mesh.points

    @property
    def values(self) -> Floats:
        """The scalar field at all nodes (f, N); KeyError of a run that has none."""
        return self.fields[fields.VALUES]

    @property
    def vertex_values(self) -> Floats:
        """The scalar field at the vertices (f, n)."""
        return self.values[:, : len(self.points)]

    def _repr_html_(self) -> str:
        """What notebooks show."""
        known = ("seconds", "newton_iterations", "unknowns")
        cost = {name: value for name, value in self.outcome.cost.items() if name in known}
        facts = {
            "solver": self.solver,
            "status": f"{self.outcome.status}: {self.outcome.message}",
            "frames": f"{len(self.numbers)}, from {self.numbers[0]} to {self.numbers[-1]}",
            "vertices": len(self.points),
            "cost": ", ".join(f"{name} {value:.4g}" for name, value in cost.items()) or "not known",
            "stored in": self.folder or "nowhere",
        }
        return fact_table(f"run {self.name}", facts)


class Writer:
    """Writes one run into ``folder``, which it empties first but for a run that was cut off and can go on; ``add`` each frame, then
    ``close``. A frame that is stored already takes the place of the stored one and of all after it.
    """

    def __init__(
        self,
        folder: Path,
        identity: dict[str, Any],
        surface: Surface = NO_SURFACE,
        fibres: Polylines | None = None,
        mesh: TetMesh | None = None,
        directions: Floats | None = None,
    ) -> None:
        """``identity``: ``name``, ``solver``, ``origin`` and ``frames`` (the numbers wanted), as they go into run.json;
        ``directions`` (k, 3): the unit vector along the fibres in each tet of ``mesh``, which states are stored with.
        """
        self.folder, self.surface, self.fibres, self.mesh, self.directions = folder, surface, fibres, mesh, directions
        self.state: dict[str, Any] = {"format": FORMAT, **identity, "status": "running", "message": "", "numbers": []}
        self.state |= {"scalars": {}, "residuals": [], "cost": {}, "parts": []}
        self.begin, self.reported = time.perf_counter(), 0.0
        if (stored := cut_off.stored(folder, identity)) is not None:
            self.state = stored | {"name": identity["name"], "origin": identity["origin"]}
            return
        shutil.rmtree(folder) if folder.exists() else None
        files.make_folder(folder)
        self._write_state()

    @property
    def cut_off(self) -> CutOff:
        """What is stored so far, for a solver that can go on."""
        return CutOff(self.folder / cut_off.FOLDER, self.frames)

    @property
    def frames(self) -> tuple[int, ...]:
        """The numbers of those stored so far."""
        return tuple(self.state["numbers"])

    def add(self, frame: Frame) -> None:
        """Store a frame: its files first, then the index files and run.json."""
        cut_off.truncate(self.state, frame.number)
        parts: dict[str, Callable[[Path], None]] = {}
        if (surface := frame.surface) is not None:
            parts["surface"] = lambda path: files.write_surface(path, self.surface, surface)
        elif frame.field is None and not self.frames:
            self._write_rest()
        if self.fibres is not None and (fibres := frame.fibres) is not None:
            lines = self.fibres
            parts["fibres"] = lambda path: files.write_polylines(path, lines, fibres)
        if self.mesh is not None and (tets := frame.tets) is not None:
            mesh = self.mesh
            parts["tets"] = lambda path: files.write_tets(path, mesh, tets)
        stored = ["state"] if self._write_unknowns(frame) else []
        if (solved := frame.field) is not None:
            parts[fields.FOLDER] = lambda path: fields.write(path, solved)
        self.state["numbers"].append(frame.number)
        self.state["residuals"].append(frame.residuals)
        self.state["parts"] = sorted([*parts, *stored])
        for part, write in parts.items():
            suffix = ".vtu" if part in ("tets", fields.FOLDER) else ".vtp"
            (self.folder / part).mkdir(exist_ok=True)
            write(self.folder / part / f"frame_{frame.number:04d}{suffix}")
            names = [(number, f"{part}/frame_{number:04d}{suffix}") for number in self.state["numbers"]]
            files.write_pvd(self.folder / f"{part}.pvd", names)
        for name, value in (dict.fromkeys(self.state["scalars"], math.nan) | frame.scalars).items():
            unknown: list[float | None] = [None] * (len(self.state["numbers"]) - 1)  # of effects that were added since
            self.state["scalars"].setdefault(name, unknown).append(value if math.isfinite(value) else None)
        self._write_state()
        self._log_progress(frame)

    def close(self, outcome: Outcome, **origin: Any) -> None:
        """Store how it ended, and what more is known of its ``origin`` now."""
        self.state["origin"] |= origin
        cost = {"seconds": time.perf_counter() - self.begin} | outcome.cost
        self.state |= {"status": outcome.status, "message": outcome.message, "cost": cost}
        self._write_state()
        if outcome.status not in (*cut_off.ENDED_EARLY, "stopped"):
            cut_off.clear(self.folder)

    def _write_unknowns(self, frame: Frame) -> bool:
        """The unknowns of the tets, if the frame has them."""
        if self.mesh is None or frame.state is None:
            return False
        if not self.frames:
            states.write_rest(self.folder, self.mesh, self.directions)
        states.write(self.folder, frame.number, frame.state)
        return True

    def _write_rest(self) -> None:
        """The rest state, which the first frame of a solver without a surface is not."""
        (self.folder / "rest").mkdir(exist_ok=True)
        files.write_surface(self.folder / "rest" / "surface.vtp", self.surface, self.surface.points)
        if self.fibres is not None:
            files.write_polylines(self.folder / "rest" / "fibres.vtp", self.fibres, self.fibres.points)

    def _write_state(self) -> None:
        files.write_text(self.folder / "run.json", json.dumps(self.state, indent=1, allow_nan=False))

    def _log_progress(self, frame: Frame) -> None:
        done, wanted = len(self.state["numbers"]), len(self.state["frames"])
        passed = time.perf_counter() - self.begin
        left = f", about {passed / (done - 1) * (wanted - done):.0f} s left" if 1 < done < wanted else ""
        if 1 < done < wanted and passed - self.reported < QUIET:
            return
        self.reported, name, note = passed, self.state["name"], f", {frame.note}" if frame.note else ""
        log.info("%s: frame %d (%d of %d)%s, %.0f s%s", name, frame.number, done, wanted, note, passed, left)


def load(folder: Path) -> Run:
    """The run in ``folder``; InputError where there is none, it was cut off, or one of its files is damaged."""
    place = folder / "run.json"
    state = texts.read_json(place, "the run.json of a stored run")
    if isinstance(state, dict) and state.get("status") == "running":
        raise InputError(f"{place}: status", '"running"', "a run that came to its end")
    stored = parse(Contents, state, f"{place}: run")
    whose: dict[str, Any] = {"name": stored.name, "solver": stored.solver, "numbers": stored.numbers, "folder": folder}
    whose |= {"outcome": Outcome(stored.status, stored.message, stored.cost), "origin": state["origin"]}
    scalars = {name: np.asarray(values, float) for name, values in stored.scalars.items()}
    whose |= {"scalars": scalars, "residuals": stored.residuals}
    if fields.FOLDER in stored.parts:
        mesh, arrays = fields.read(folder, stored.numbers)
        return Run(**whose, has_surface=False, mesh=mesh, fields=arrays)
    return Run(**whose, **_moved(folder, stored.numbers, stored.parts))


def _moved(folder: Path, numbers: tuple[int, ...], parts: Collection[str]) -> dict[str, Any]:
    """The surface and the fibres of a run in ``folder``, at rest and moved, as :class:`Run` has them."""
    names, has_surface = [f"frame_{number:04d}.vtp" for number in numbers], "surface" in parts
    if has_surface:
        surfaces = [files.read_surface(folder / "surface" / file, 1.0) for file in names]
        surface = surfaces[0]
        _check_same(folder / "surface", names, [moved.points for moved in surfaces], surface.points)
        positions = np.stack([moved.points for moved in surfaces])
    else:
        surface = files.read_surface(folder / "rest" / "surface.vtp", 1.0)
        positions = np.full((len(numbers), *surface.points.shape), np.nan)
    check_corners(surface)
    found: dict[str, Any] = {"surface": surface, "positions": positions, "has_surface": has_surface}
    if "fibres" in parts:
        lines = [files.read_moved_polylines(folder / "fibres" / file, 1.0) for file in names]
        fibres = lines[0] if has_surface else files.read_polylines(folder / "rest" / "fibres.vtp", 1.0)
        _check_same(folder / "fibres", names, [line.points for line in lines], fibres.points)
        found |= {"fibres": fibres, "fibre_positions": np.stack([line.points for line in lines])}
    return found


def _check_same(folder: Path, names: list[str], frames: list[Floats], rest: Floats) -> None:
    """InputError where a frame has another number of points than the run has at rest."""
    for name, points in zip(names, frames, strict=True):
        if len(points) != len(rest):
            raise InputError(folder / name, f"{len(points)} points", f"{len(rest)}, as the rest of the run has")


def status(folder: Path) -> str:
    """What ``run.json`` in ``folder`` says of the run: a status, ``"running"`` where it was cut off, or ``"damaged"``."""
    try:
        return str(texts.read_json(folder / "run.json", "a run")["status"])
    except (InputError, KeyError, TypeError):
        return "damaged"


def finished(folder: Path, ended: Collection[str] = ("converged",)) -> Run | None:
    """The stored run in ``folder`` if it is there and ``ended`` so, else None."""
    try:
        run = load(folder)
    except InputError:
        return None
    return run if run.outcome.status in ended else None
