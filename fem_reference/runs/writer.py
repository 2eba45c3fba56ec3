"""Runs written to disk while they are solved, frame by frame.

Files are written atomically; ``run.json`` after the frame files that it names. A run with status ``running`` was cut off or
crashed; it is not read as a result, and continues where its solver can.
"""

import json
import logging
import math
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fem_reference.io import files
from fem_reference.problems.problem import NOTHING, AtRest
from fem_reference.runs import cut_off, states
from fem_reference.runs.contents import FORMAT, RunJson, frame_file
from fem_reference.runs.cut_off import CutOff
from fem_reference.runs.store import Frame, Outcome

log = logging.getLogger(__name__)

# Between the first and the last frame, progress is reported at most once in this time [s].
QUIET = 1.0


class Writer:
    """Writes one run into ``folder``. It first empties the folder, except for a run that was cut off and can continue. ``add``
    each frame, then ``close``. A frame that is already stored replaces the stored one and all after it.
    """

    def __init__(self, folder: Path, identity: RunJson, rest: AtRest = NOTHING) -> None:
        """``identity``: ``name``, ``solver``, ``origin`` and ``frames`` (the requested numbers), as in run.json; ``rest``: the
        shapes that its frames move.
        """
        self.folder, self.rest = folder, rest
        self.state: RunJson = {"format": FORMAT, **identity, "status": "running", "message": "", "numbers": []}
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
        """The stored part, for a solver that can continue."""
        return CutOff(self.folder / cut_off.FOLDER, self.frames)

    @property
    def frames(self) -> tuple[int, ...]:
        """The numbers of the stored frames."""
        return tuple(self.state["numbers"])

    def add(self, frame: Frame) -> None:
        """Store a frame: its files first, then the index files and run.json."""
        cut_off.truncate(self.state, frame.number)
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
            unknown: list[float | None] = [None] * (len(self.state["numbers"]) - 1)  # for effects added since
            self.state["scalars"].setdefault(name, unknown).append(value if math.isfinite(value) else None)
        self._write_state()
        self._log_progress(frame)

    def close(self, outcome: Outcome, **origin: Any) -> None:
        """Store the outcome, and further facts on the ``origin``."""
        self.state["origin"] |= origin
        cost = {"seconds": time.perf_counter() - self.begin} | outcome.cost
        self.state |= {"status": outcome.status, "message": outcome.message, "cost": cost}
        self._write_state()
        if outcome.status not in (*cut_off.ENDED_EARLY, "stopped"):
            cut_off.clear(self.folder)

    def _write_unknowns(self, frame: Frame) -> bool:
        """The unknowns of the tets, if the frame has them."""
        if self.rest.mesh is None or frame.state is None:
            return False
        if not self.frames:
            states.write_rest(self.folder, self.rest.mesh, self.rest.directions)
        states.write(self.folder, frame.number, frame.state)
        return True

    def _write_rest(self) -> None:
        """Write the rest state, which is not the first frame of a solver without a surface."""
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
