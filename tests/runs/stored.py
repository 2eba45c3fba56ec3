"""Runs that tests store: one of two frames, and one of three that was cut off."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.problem import AtRest
from fem_reference.runs.key import versions
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from fem_reference.studies.execution import Bench

SECONDS = 1320.0  # that the stored run took: 22 minutes

SURFACE = shapes.sphere(1, 10.0)
FIBRES = Polylines(np.array([[0.0, 0, -9], [0, 0, 0], [0, 0, 9], [1, 0, -5], [1, 0, 5]]), np.array([0, 3, 5]))
MESH = shapes.box((1, 1, 1), (5, 5, 5))
SHIFT = np.array([0.5, 0, 0])
IDENTITY = {"name": "reference", "solver": "test", "origin": {"case": "none"}, "frames": (0, 5)}
CUT_OFF = {"name": "one", "solver": "test", "origin": {"versions": {"numpy": "2"}}, "frames": (0, 5, 10)}


def write(folder: Path, *, close: bool = True) -> Path:
    """A run of two frames in ``folder``, with all that a muscle has."""
    writer = Writer(folder, IDENTITY, AtRest(SURFACE, FIBRES, MESH))
    for number in (0, 5):
        shift = np.array([0.1 * number, 0, 0])
        scalars, residuals = {"energy": 2.0 * number}, (1.0, 0.1) if number else ()
        places = SURFACE.points + shift, FIBRES.points + shift, MESH.points + shift
        writer.add(Frame(number, *places, scalars, "well", residuals=residuals))
    if close:
        writer.close(Outcome("converged", "done", {"newton_iterations": 7.0}))
    return folder


def begun(folder: Path, frames: int = 2, status: str | None = None) -> Writer:
    """A run of which some frames are stored, and something is kept to go on from."""
    writer = Writer(folder, CUT_OFF, AtRest(SURFACE))
    for number in CUT_OFF["frames"][:frames]:  # type: ignore[index]
        writer.add(Frame(number, SURFACE.points + number, scalars={"energy": 1.0 * number}))
    writer.cut_off.folder.mkdir()
    (writer.cut_off.folder / "kept.npz").touch()
    if status is not None:
        writer.close(Outcome(status, "so"))  # type: ignore[arg-type]
    return writer


def store_run(place: Path, bench: Bench, numbers: tuple[int, ...], kept: tuple[int, ...]) -> None:
    """The run of a reference that does not move, with the states of the frames ``kept``."""
    rest, mesh = bench.setup().surface, shapes.box((2, 2, 4), (10, 10, 40))
    fibres = Polylines(np.column_stack([np.full((8, 2), 5.0), [1, 5, 10, 20, 2, 3, 4, 8]]), [0, 4, 8])
    origin = {"scene": bench.scene.key, "versions": versions()}
    identity = {"name": "reference", "solver": "fenicsx", "frames": numbers, "origin": origin}
    writer = Writer(place, identity, AtRest(rest, fibres, mesh, np.tile([0.0, 0, 1], (len(mesh.tets), 1))))
    state = NodalState(np.zeros((len(mesh.tets), 10, 3)), np.zeros((len(mesh.tets), 4)), np.zeros((0, 0, 3)))
    for number in numbers:
        frame = Frame(number, rest.points, fibres.points, mesh.points)
        writer.add(replace(frame, state=state) if number in kept else frame)
    writer.close(Outcome("converged", "", {"seconds": SECONDS}))
