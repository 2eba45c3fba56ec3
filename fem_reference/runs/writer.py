"""Writing runs to disk while they are solved, one frame after the other.

Files are written atomically, and ``run.json`` is written after the frame files that it names. A stored run with the status
``running`` was cut off or crashed. It is not read as a result, but a solver that supports continuation continues it.
"""

import json
import logging
import math
import shutil
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import parse
from fem_reference.io import files, texts
from fem_reference.problems.problem import NOTHING, AtRest
from fem_reference.runs import states
from fem_reference.runs.contents import FORMAT, Contents, RunJson, frame_file
from fem_reference.runs.store import Frame, Outcome

RESTART = "restart"
# The statuses of a run that was killed, as when memory or disk is full: "crashed", or "running" if its writer was killed too.
ENDED_EARLY = ("running", "crashed")


@dataclass(frozen=True)
class CutOff:
    """The stored part of a run that was cut off.

    ``folder``: the folder with restart files of the solver. ``numbers``: the numbers of the stored frames.
    """

    folder: Path
    numbers: tuple[int, ...]


def stored_before(folder: Path, identity: RunJson) -> RunJson | None:
    """The run.json of a run in ``folder`` that was cut off and that the run of ``identity`` can continue; None if there is none."""
    place = folder / "run.json"
    with suppress(InputError):
        state = texts.read_json(place, "a run")
        if not isinstance(state, dict) or state.get("status") not in ENDED_EARLY or not state.get("numbers"):
            return None
        if not (folder / RESTART).is_dir():
            return None
        whole = parse(Contents, state | {"status": "crashed"}, f"{place}: run")
        wanted = json.loads(json.dumps(identity))
        same = (whole.solver, list(whole.frames)) == (wanted["solver"], wanted["frames"])
        if wanted["origin"].get("settings", {}).get("store_state") and "state" not in whole.parts:
            return None  # the stored frames have no states, which are now requested
        if same and whole.origin.versions == wanted["origin"].get("versions", {}):
            for part in folder.rglob(".*"):  # incomplete files
                part.unlink()
            return state | {"status": "running", "message": "", "cost": {}}
    return None


def truncate(state: RunJson, number: float) -> None:
    """Remove the frame ``number`` and later frames, which will be solved again, from a ``state``, the contents of run.json."""
    kept = sum(stored < number for stored in state["numbers"])
    state["numbers"], state["residuals"] = state["numbers"][:kept], state.get("residuals", [])[:kept]
    state["scalars"] = {name: values[:kept] for name, values in state["scalars"].items()} if kept else {}


def places(folder: Path, number: float) -> tuple[Floats, Floats | None]:
    """The positions [mm] of the surface (n, 3), and of the points of the tetrahedra (k, 3) or None, in a stored frame of a run."""
    tets = folder / "tets" / frame_file(number, ".vtu")
    surface = files.read_surface(folder / "surface" / frame_file(number, ".vtp"), 1.0).points
    return surface, files.read_points(tets) if tets.is_file() else None


def pass_on(folder: Path, to: Path) -> None:
    """Copy the run in ``folder``, if it has restart files, to the folder ``to``, where another run can continue it.

    Nothing is copied if ``to`` exists. In any case the restart files in ``folder`` are removed.
    """
    if (folder / RESTART).is_dir() and not to.exists():
        with tempfile.TemporaryDirectory(dir=to.parent) as new:
            copy = shutil.copytree(folder, Path(new) / to.name)
            state = texts.read_json(copy / "run.json", "a run")
            (copy / "run.json").write_text(json.dumps(state | {"status": "running"}), encoding="utf-8")
            copy.rename(to)
    clear(folder)


def clear(folder: Path) -> None:
    """Remove the restart files of the finished run in ``folder``."""
    shutil.rmtree(folder / RESTART, ignore_errors=True)


log = logging.getLogger(__name__)

# The minimum time [s] between two reports of progress, except those of the first and the last frame.
QUIET = 1.0


class Writer:
    """A writer that stores a run in ``folder``.

    The folder is emptied first, unless it contains a run that was cut off and can continue. Call ``add`` for each frame, then
    ``close``. A frame whose number is already stored replaces the stored frame and all later frames.
    """

    def __init__(self, folder: Path, identity: RunJson, rest: AtRest = NOTHING, *, anew: bool = False) -> None:
        """Begin a run. ``identity``: the first keys of run.json. ``rest``: shapes at rest. ``anew``: ignore a stored run."""
        self.folder, self.rest = folder, rest
        self.state: RunJson = {"format": FORMAT, **identity, "status": "running", "message": "", "numbers": []}
        self.state |= {"scalars": {}, "residuals": [], "cost": {}, "parts": []}
        self.begin, self.reported = time.perf_counter(), 0.0
        if not anew and (kept := stored_before(folder, identity)) is not None:
            self.state = kept | {"name": identity["name"], "origin": identity["origin"]}
            return
        shutil.rmtree(folder) if folder.exists() else None
        files.make_folder(folder)
        self._write_state()

    @property
    def cut_off(self) -> CutOff:
        """The stored part of the run, for a solver that supports continuation."""
        return CutOff(self.folder / RESTART, self.frames)

    @property
    def frames(self) -> tuple[int, ...]:
        """The numbers of the stored frames."""
        return tuple(self.state["numbers"])

    def add(self, frame: Frame) -> None:
        """Store a frame: first its files, then the index files and run.json."""
        truncate(self.state, frame.number)
        parts: dict[str, Callable[[Path], None]] = {}
        surface, lines, mesh = self.rest.surface, self.rest.fibres, self.rest.mesh
        if (positions := frame.surface) is not None:
            parts["surface"] = lambda path: files.write_surface(path, surface, positions)
        elif frame.field is None and not self.frames:
            self._write_rest()
        if lines is not None and (fibres := frame.fibres) is not None:
            parts["fibres"] = lambda path: files.write_polylines(path, lines, fibres)
        if mesh is not None and len(frame.points):
            parts["tets"] = lambda path: files.write_tets(path, mesh, frame.points)
        stored = ["state"] if self._write_unknowns(frame) else []
        if (solved := frame.field) is not None:
            parts[states.FIELD] = lambda path: states.write_field(path, solved)
            self.state["origin"]["form"] = solved.form
        self.state["numbers"].append(frame.number)
        self.state["residuals"].append(frame.residuals)
        self.state["parts"] = sorted([*parts, *stored])
        for part, write in parts.items():
            suffix = ".vtu" if part in ("tets", states.FIELD) else ".vtp"
            (self.folder / part).mkdir(exist_ok=True)
            names = [(number, f"{part}/{frame_file(number, suffix)}") for number in self.state["numbers"]]
            write(self.folder / names[-1][1])
            files.write_pvd(self.folder / f"{part}.pvd", names)
        for name, value in (dict.fromkeys(self.state["scalars"], math.nan) | frame.scalars).items():
            # A scalar that earlier frames do not have is unknown there, for example if an effect has been added.
            unknown: list[float | None] = [None] * (len(self.state["numbers"]) - 1)
            self.state["scalars"].setdefault(name, unknown).append(value if math.isfinite(value) else None)
        self._write_state()
        self._log_progress(frame)

    def close(self, outcome: Outcome, **origin: Any) -> None:
        """Store the outcome, and further entries of the provenance, ``origin``."""
        self.state["origin"] |= origin
        cost = {"seconds": time.perf_counter() - self.begin} | outcome.cost
        self.state |= {"status": outcome.status, "message": outcome.message, "cost": cost}
        self._write_state()
        if outcome.status not in (*ENDED_EARLY, "stopped"):
            clear(self.folder)

    def _write_unknowns(self, frame: Frame) -> bool:
        """Write the unknowns of the tetrahedra. Returns False if the frame has none."""
        if self.rest.mesh is None or frame.state is None:
            return False
        if not self.frames:
            states.write_rest(self.folder, self.rest.mesh, self.rest.directions)
        states.write(self.folder, frame.number, frame.state)
        return True

    def _write_rest(self) -> None:
        """Write the rest state, which the frames of a solver without a surface do not contain."""
        (self.folder / "rest").mkdir(exist_ok=True)
        surface, fibres = self.rest.surface, self.rest.fibres
        files.write_surface(self.folder / "rest" / "surface.vtp", surface, surface.points)
        if fibres is not None:
            files.write_polylines(self.folder / "rest" / "fibres.vtp", fibres, fibres.points)

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
