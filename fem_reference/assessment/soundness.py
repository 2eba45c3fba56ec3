"""Reasons why the frames of a candidate are unusable although every number is finite. Such a candidate is not ranked."""

import numpy as np

from fem_reference.foundations.mesh import Floats, diagonal, enclosed_volume
from fem_reference.geometry.distance import outer_windings
from fem_reference.runs.store import Run

# Limits of the ratio of the enclosed volume to that in the reference: below the first the body has collapsed, above the second it
# has exploded. The lowest ratio of the shipped solvers is 0.8.
_LEAST, _MOST = 0.5, 2.0
# The maximum distance of a vertex from the reference, as a multiple of the size of the body.
_FARTHEST = 1.0
# The maximum fraction of triangles that are inside out, in excess of the fraction in the reference.
_TURNED = 0.05
# A vertex is stuck if it moves by less than the first fraction of the body's size, but by more than the second in the reference.
_STILL, _MOVES = 1e-6, 1e-2


def unsound(run: Run, reference: Run) -> str:
    """The first reason why the frames of a ``run`` are unusable, with its frame; empty if there is none, or if the run does not
    have the surface of the reference. Only frames that both runs reached are judged.
    """
    if not run.has_surface or run.positions.shape != reference.positions.shape:
        return ""  # a run of lines, or of another surface
    if run.outcome.status == "converged" and not np.isfinite(run.positions).all(axis=(1, 2)).any():
        return "unknown: every frame has values that are not numbers"
    both = np.isfinite(run.positions + reference.positions).all(axis=(1, 2))
    for i in np.flatnonzero(both):
        if why := _of_frame(run, run.positions[i], reference.positions[i]):
            return f"{why} in frame {run.numbers[i]}"
    return _stuck(run.positions[both], reference.positions[both]) if both.any() else ""


def _of_frame(run: Run, mine: Floats, truth: Floats) -> str:
    """The reason in a frame, from positions (n, 3) [mm] in the run (``mine``) and the reference (``truth``); empty if none."""
    triangles, size = run.surface.triangles, diagonal(run.surface.points)
    away = float(np.linalg.norm(mine - truth, axis=1).max())
    if not away <= _FARTHEST * size:
        return f"exploded: a vertex of a body of {size:.3g} mm is {away:.3g} mm from the reference"
    share = enclosed_volume(mine, triangles) / enclosed_volume(truth, triangles)
    if not _LEAST <= share <= _MOST:
        return f"{'exploded' if share > 1 else 'collapsed'}: {share:.3g} times the volume of the reference"
    turned = _inside_out(run, mine) - _inside_out(run, truth)
    return f"inside out: {100 * turned:.3g} % of the surface" if turned > _TURNED else ""


def _inside_out(run: Run, points: Floats) -> float:
    return float(np.mean(outer_windings(run.surface.moved_to(points)) < 0))


def _stuck(mine: Floats, truth: Floats) -> str:
    """The reason if vertices never move although they move in the reference, as happens if a solver drops elements."""
    size = diagonal(truth[0])
    moved, wanted = (np.linalg.norm(one - one[0], axis=2).max(axis=0) / size for one in (mine, truth))
    stuck = (moved < _STILL) & (wanted > _MOVES)
    if not stuck.any():
        return ""
    most = wanted[stuck].max() * size
    return f"stuck: {stuck.sum()} vertices never move, although they move by up to {most:.3g} mm in the reference"
