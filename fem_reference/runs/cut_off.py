"""Runs that were cut off: which frames of them are stored, and the folder in which a solver keeps what it needs to go on."""

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
from fem_reference.runs.contents import Contents, RunJson

FOLDER = "restart"
# Killed with the process that stores it, or alone: for want of memory or room, say.
ENDED_EARLY = ("running", "crashed")


@dataclass(frozen=True)
class CutOff:
    """The kept part of a run: the ``numbers`` of its stored frames, none of one that begins, and the ``folder`` that its solver may
    use until it ends.
    """

    folder: Path
    numbers: tuple[int, ...]


def stored(folder: Path, identity: RunJson) -> RunJson | None:
    """The run.json of a run in ``folder`` that was cut off and can go on as the one of ``identity``, if there is one."""
    place = folder / "run.json"
    with suppress(InputError):
        state = texts.read_json(place, "a run")
        if not isinstance(state, dict) or state.get("status") not in ENDED_EARLY or not (folder / FOLDER).is_dir():
            return None
        if not state.get("numbers"):
            return None
        whole = parse(Contents, state | {"status": "crashed"}, f"{place}: run")
        wanted = json.loads(json.dumps(identity))
        same = (whole.solver, list(whole.frames)) == (wanted["solver"], wanted["frames"])
        if wanted["origin"].get("settings", {}).get("store_state") and "state" not in whole.parts:
            return None  # its frames lack what is asked for
        if same and whole.origin.versions == wanted["origin"].get("versions", {}):
            for part in folder.rglob(".*"):  # what was being written
                part.unlink()
            return state | {"status": "running", "message": "", "cost": {}}
    return None


def truncate(state: RunJson, number: float) -> None:
    """Take the frames from ``number`` on, which are solved again, out of a ``state`` as run.json has it."""
    kept = sum(stored < number for stored in state["numbers"])
    state["numbers"], state["residuals"] = state["numbers"][:kept], state.get("residuals", [])[:kept]
    state["scalars"] = {name: values[:kept] for name, values in state["scalars"].items()} if kept else {}


def places(folder: Path, number: float) -> tuple[Floats, Floats | None]:
    """Positions [mm] of the surface (n, 3) and of the points of the tets (k, 3), if there are any, in a stored frame of the run in
    ``folder``.
    """
    tets = folder / "tets" / f"frame_{number:04d}.vtu"
    surface = files.read_surface(folder / "surface" / f"frame_{number:04d}.vtp", 1.0).points
    return surface, files.read_points(tets) if tets.is_file() else None


def pass_on(folder: Path, to: Path) -> None:
    """Let the run of the folder ``to`` go on from what is kept of the stopped one in ``folder``, unless there is one already."""
    if (folder / FOLDER).is_dir() and not to.exists():
        with tempfile.TemporaryDirectory(dir=to.parent) as new:
            copy = shutil.copytree(folder, Path(new) / to.name)
            state = texts.read_json(copy / "run.json", "a run")
            (copy / "run.json").write_text(json.dumps(state | {"status": "running"}), encoding="utf-8")
            copy.rename(to)
    clear(folder)


def clear(folder: Path) -> None:
    """Remove what a solver kept in the ``folder`` of a run that has come to its end."""
    shutil.rmtree(folder / FOLDER, ignore_errors=True)
