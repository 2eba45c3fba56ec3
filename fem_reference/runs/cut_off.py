"""Runs that were cut off: their stored frames, and the folder with the state from which a solver continues."""

import json
import shutil
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import parse
from fem_reference.io import files, texts
from fem_reference.runs.contents import Contents, RunJson, frame_file

FOLDER = "restart"
# Killed with the process that stores it, or alone, for example for lack of memory or disk space.
ENDED_EARLY = ("running", "crashed")


@dataclass(frozen=True)
class CutOff:
    """The kept part of a run: the ``numbers`` of its stored frames, empty for a new run, and the ``folder`` that its solver may
    use until it ends.
    """

    folder: Path
    numbers: tuple[int, ...]


def stored(folder: Path, identity: RunJson) -> RunJson | None:
    """The run.json of a run in ``folder`` that was cut off and can continue as the one of ``identity``, if there is one."""
    place = folder / "run.json"
    with suppress(InputError):
        state = texts.read_json(place, "a run")
        if not isinstance(state, dict) or state.get("status") not in ENDED_EARLY or not state.get("numbers"):
            return None
        if not (folder / FOLDER).is_dir():
            return None
        whole = parse(Contents, state | {"status": "crashed"}, f"{place}: run")
        wanted = json.loads(json.dumps(identity))
        same = (whole.solver, list(whole.frames)) == (wanted["solver"], wanted["frames"])
        if wanted["origin"].get("settings", {}).get("store_state") and "state" not in whole.parts:
            return None  # its frames lack requested parts
        if same and whole.origin.versions == wanted["origin"].get("versions", {}):
            for part in folder.rglob(".*"):  # incomplete files
                part.unlink()
            return state | {"status": "running", "message": "", "cost": {}}
    return None


def truncate(state: RunJson, number: float) -> None:
    """Remove the frames from ``number`` on, which are solved again, from a ``state`` as in run.json."""
    kept = sum(stored < number for stored in state["numbers"])
    state["numbers"], state["residuals"] = state["numbers"][:kept], state.get("residuals", [])[:kept]
    state["scalars"] = {name: values[:kept] for name, values in state["scalars"].items()} if kept else {}


def places(folder: Path, number: float) -> tuple[Floats, Floats | None]:
    """Positions [mm] of the surface (n, 3) and of the points of the tets (k, 3), if any, in a stored frame of the run in
    ``folder``.
    """
    tets = folder / "tets" / frame_file(number, ".vtu")
    surface = files.read_surface(folder / "surface" / frame_file(number, ".vtp"), 1.0).points
    return surface, files.read_points(tets) if tets.is_file() else None


def pass_on(folder: Path, to: Path) -> None:
    """Let the run of the folder ``to`` continue from the kept part of the stopped one in ``folder``, unless it has its own."""
    if (folder / FOLDER).is_dir() and not to.exists():
        with tempfile.TemporaryDirectory(dir=to.parent) as new:
            copy = shutil.copytree(folder, Path(new) / to.name)
            state = texts.read_json(copy / "run.json", "a run")
            (copy / "run.json").write_text(json.dumps(state | {"status": "running"}), encoding="utf-8")
            copy.rename(to)
    clear(folder)


def clear(folder: Path) -> None:
    """Remove the restart files of a finished run from its ``folder``."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)
