"""Jobs for the worker process, and the stored states from which a run continues."""

import json
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, fingerprint
from fem_reference.problems.body import Body
from fem_reference.runs.contents import frame_file
from fem_reference.runs.states import read_arrays
from fem_reference.runs.writer import CutOff
from fem_reference.solvers.fenicsx.settings import BodySettings


@dataclass(frozen=True)
class Kept:
    """The ``folder`` with the stored states of a run, and the ``frames`` stored in it. The run can continue from the last frame,
    and reuse the earlier ones when the same loads return. ``mesh``: the fingerprint of the mesh.
    """

    folder: Path
    mesh: str
    frames: tuple[int, ...] = ()

    def place(self, frame: float) -> Path:
        """The file of a frame."""
        return self.folder / frame_file(frame, ".npz")


def kept(cut_off: CutOff, body: Body) -> Kept:
    """The states from which a run continues; all other files in the folder are removed. There are none if contact depends on
    its history (``Body.remembers``), which is not stored.
    """
    whole = Kept(cut_off.folder.resolve(), fingerprint(body.mesh.points, body.mesh.cells))
    frames = tuple(number for number in cut_off.numbers if not body.remembers and _is_of(whole, number))
    cut_off.folder.mkdir(exist_ok=True)
    for path in cut_off.folder.iterdir():
        if path not in {whole.place(number) for number in frames}:
            path.unlink()
    return Kept(whole.folder, whole.mesh, frames)


def _is_of(whole: Kept, number: int) -> bool:
    with suppress(InputError, ValueError, KeyError, TypeError, RecursionError):
        facts = json.loads(str(read_arrays(whole.place(number))["facts"]))
        return bool(facts["mesh"] == whole.mesh)
    return False


@dataclass(frozen=True, eq=False)
class Job:
    """A ``body`` and how to solve it.

    ``samples``: by name, the cells (n,) and the rest positions (n, 3) of points whose positions are requested. Only a muscle has
    samples; forces at edges shared by attachments are then divided between the attachments. ``kept``: stored states, or None.
    Raises InputError if stable states are to be followed with friction or with contact along the points' own normals, as negative
    modes are not counted then.
    """

    body: Body
    settings: BodySettings
    samples: dict[str, tuple[Ints, Floats]] = field(default_factory=dict)
    kept: Kept | None = None

    def __post_init__(self) -> None:
        if not self.body.has_energy and self.settings.follow == "stable":
            got = f'"stable" with {"friction" if self.body.rubs else "contact along own normals"}'
            raise InputError("follow", got, '"equilibrium", as negative modes are not counted then')
