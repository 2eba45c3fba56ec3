"""The cost of a run: time per frame, number of reached frames."""

import numpy as np

from fem_reference.runs.store import Run


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
