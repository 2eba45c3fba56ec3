"""Messages between the caller and the process that solves: jobs and frames, and what a run goes on from."""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, fingerprint
from fem_reference.problems.body import Body
from fem_reference.problems.problem import Task
from fem_reference.runs.cut_off import CutOff
from fem_reference.runs.states import NodalState, read_arrays
from fem_reference.solvers.fenicsx.settings import BodySettings


@dataclass(frozen=True)
class Kept:
    """The ``folder`` in which the states of a run are kept, and ``frames`` among them: it can go on from the last, with the others
    for loads that come back. ``mesh``: its fingerprint.
    """

    folder: Path
    mesh: str
    frames: tuple[int, ...] = ()

    def place(self, frame: float) -> Path:
        """The file of a frame."""
        return self.folder / f"frame_{frame:04.0f}.npz"


def kept(cut_off: CutOff, body: Body) -> Kept:
    """The states to go on from; anything else that an earlier process left in the folder is removed."""
    whole = Kept(cut_off.folder.resolve(), fingerprint(body.mesh.points, body.mesh.cells))
    frames = tuple(number for number in cut_off.numbers if _is_of(whole, number))
    cut_off.folder.mkdir(exist_ok=True)
    for path in cut_off.folder.iterdir():
        if path not in {whole.place(number) for number in frames} and not path.name.startswith("layout_"):
            path.unlink()
    return Kept(whole.folder, whole.mesh, frames)


def _is_of(whole: Kept, number: int) -> bool:
    with suppress(InputError, ValueError, KeyError, TypeError, RecursionError):
        facts = json.loads(str(read_arrays(whole.place(number))["facts"]))
        return bool(facts["mesh"] == whole.mesh) and (whole.folder / facts["layout"]).is_file()
    return False


@dataclass(frozen=True, eq=False)
class Job:
    """A ``body`` and how to solve it; ``samples``: by name, the cell (n,) of each point and the points (n, 3) at rest whose
    positions are wanted. Of a muscle there are some; then forces at edges that its attachments share are divided between them.
    ``kept``: where states are kept, if they are.
    """

    task: ClassVar[Task] = "solve_body"

    body: Body
    settings: BodySettings
    samples: dict[str, tuple[Ints, Floats]] = field(default_factory=dict)
    kept: Kept | None = None


def stored_state(arrays: Mapping[str, Any]) -> NodalState | None:
    """The unknowns of the cells among the ``arrays`` of a frame, None where they were not asked for."""
    own = {name.removeprefix("state "): arrays[name] for name in arrays if name.startswith("state ")}
    return NodalState.of(own) if own else None
