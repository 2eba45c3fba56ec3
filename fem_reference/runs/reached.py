"""The frames of a case that a run reached: their number, their time, and not-a-number for all others."""

from dataclasses import replace

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.runs.store import Run


def complete(run: Run, numbers: tuple[int, ...]) -> Run:
    """The run over exactly the frames ``numbers``; frames that were not reached are not-a-number, so they never pass."""
    if run.numbers == numbers:
        return run
    rows = [run.numbers.index(number) if number in run.numbers else None for number in numbers]

    def pick(values: Floats) -> Floats:
        blank = np.full(values.shape[1:], np.nan)
        return np.stack([blank if row is None else values[row] for row in rows])

    return replace(
        run,
        numbers=numbers,
        positions=pick(run.positions),
        fibre_positions=None if run.fibre_positions is None else pick(run.fibre_positions),
        scalars={name: pick(values) for name, values in run.scalars.items()},
        fields={name: pick(values) for name, values in run.fields.items()},
    )


def seconds_per_frame(run: Run) -> float | None:
    """Time [s] to solve one reached frame after the first; None where the run was computed elsewhere and no time is given.

    ``seconds_solve`` is a solver's own time without compiling and writing; without it the whole wall time counts.
    """
    cost = run.outcome.cost
    seconds = cost.get("seconds_solve", cost.get("seconds"))
    solved = reached(run) - 1
    if run.solver == "recorded":
        each = cost.get("seconds_per_frame")  # per frame number
        return None if each is None else each * (run.numbers[-1] - run.numbers[0]) / max(len(run.numbers) - 1, 1)
    if seconds is None or solved < 1:
        return None
    return seconds / solved


def reached(run: Run) -> int:
    """The number of frames with positions of the surface, or of the fibres where there is no surface."""
    positions = run.positions if run.has_surface or run.fibre_positions is None else run.fibre_positions
    return int(np.isfinite(positions).all(axis=(1, 2)).sum())
