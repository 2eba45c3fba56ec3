"""Runs over all frames of a case: frames that they did not reach are not-a-number."""

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
