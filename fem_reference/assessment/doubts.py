"""Reasons to doubt a reference, from its own run, in words."""

import numpy as np

from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.runs.store import Run

_LOW = 0.1  # det F, below which a state is hardly valid


def doubts(reference: Run) -> list[str]:
    """Reasons to doubt a reference: it did not reach all frames, is unstable, nearly turned inside out, left the range of its
    laws, or lost energy.
    """
    said = list[str]() if reference.outcome.status == "converged" else [str(reference.outcome.status)]
    modes = reference.scalars.get("negative_modes")
    unstable = 0 if modes is None else int((np.nan_to_num(modes) > 0).sum())
    if unstable:
        said.append(f"unstable equilibrium in {unstable} of {len(reference.numbers)} frames")
    smallest = [np.nanmin(values) for name, values in reference.scalars.items() if name.startswith("min_det_F")]
    if smallest and min(smallest) < _LOW:
        said.append(f"det F falls to {float(min(smallest)):#.3g}")
    outside = np.nan_to_num(reference.scalars.get("outside_law", np.zeros(0))) > 0
    if outside.any():
        where = f"in {int(outside.sum())} of {len(outside)} frames, first in {reference.numbers[int(outside.argmax())]}"
        said.append(f"cells are outside the range that a law is meant for {where}: see Provenance")
    gaps = np.nan_to_num(reference.scalars.get("energy_gap", np.zeros(0)))
    if (np.abs(gaps) > ENERGY_GAP).any():
        most = int(np.argmax(np.abs(gaps)))
        said.append(
            f"{100 * gaps[most]:.3g} % of the energy without work at frame {reference.numbers[most]}: the body jumped, or the load "
            "steps are too large to tell (largest_step)"
        )
    return said
