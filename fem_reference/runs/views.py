"""Frames and runs of a single muscle, extracted from a run of several muscles.

In a run of several muscles, the scalars of each muscle begin with the name of the muscle.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.problems.joining import Span, called
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.runs.store import Frame, Run

# The beginnings of the names of scalars for all muscles together, which are omitted for a single muscle.
_OF_ALL = (
    "volume_ratio",
    "energy",
    "force_",
    "moment_",
    "net_",
    "attachment_error_",
    "stress_",
    "load_",
    "touching_pressure of ",
)


def frame_of(frame: Frame, span: Span, others: tuple[str, ...]) -> Frame:
    """The part of a ``frame`` of several muscles that belongs to one of them, whose name and indices are in ``span``.

    ``others``: the names of the other muscles. A force that another muscle exerts on this muscle has the name of the other muscle.
    """
    assert frame.surface is not None  # frames of the reference have a surface
    assert frame.fibres is not None
    forces, moments = (
        {own: vector for key, vector in some.items() if (own := _own(key, span.name, others))}
        for some in (frame.forces, frame.moments)
    )
    if (state := frame.state) is not None:
        before = state.before[span.cells] if len(state.before) else state.before
        displacement, pressure = state.displacement[span.cells], state.pressure[span.cells]
        state = replace(state, before=before, displacement=displacement, pressure=pressure)
    return replace(
        frame,
        surface=frame.surface[span.vertices],
        fibres=frame.fibres[span.fibres],
        points=frame.points[span.points],
        state=state,
        forces=forces,
        moments=moments,
    )


def force_between(name: str, other: str) -> str:
    """The key of the force that the muscle ``name`` exerts on the muscle ``other``."""
    return f"{called(name, 'free')} on {called(other, 'free')}"


def _own(key: str, name: str, others: tuple[str, ...]) -> str:
    """The key, in the run of the muscle ``name`` alone, of the force ``key``; empty if this force does not act on the muscle."""
    for other in others:
        if key == force_between(other, name):
            return other
    return key.removeprefix(f"{name} ") if key.startswith(f"{name} ") and not key.endswith(" free") else ""


def beside(runs: Mapping[str, Run]) -> dict[str, Run]:
    """The ``runs`` of muscles by name, all with the same frames, with the runs of the other muscles in the field ``others``."""
    return {
        name: replace(run, others={other: one for other, one in runs.items() if other != name})
        for name, run in runs.items()
    }


def run_of(run: Run, problem: MusclesProblem, name: str) -> Run:
    """The run, in memory, of the muscle ``name`` as a part of the ``run`` of several muscles."""
    span, own = next(one for one in problem.spans if one.name == name), problem.problems[name]
    begin = f"{name}."
    scalars: dict[str, Floats] = {
        key: values for key, values in run.scalars.items() if "." not in key and not key.startswith(_OF_ALL)
    }
    scalars |= {key.removeprefix(begin): values for key, values in run.scalars.items() if key.startswith(begin)}
    lines = run.fibre_positions
    return replace(
        run,
        surface=own.surface,
        positions=np.asarray(run.positions[:, span.vertices]),
        fibres=own.fibres,
        fibre_positions=None if lines is None else np.asarray(lines[:, span.fibres]),
        scalars=scalars,
        folder=None,
        states=(),
    )
