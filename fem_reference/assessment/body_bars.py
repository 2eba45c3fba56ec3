"""Error bars of a body: by how much its states differ from those of a sharper solution, and how much more is left."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fem_reference.assessment.error_bars import SAFETY
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.runs.solved import Reached

# The error over what half the size of cells changes of it, where it is of first order: the least order there is away from rims of
# what is prescribed, where displacement goes with the root of the distance, whatever the element (docs/error_bars.md).
LEFT = 2.0


@dataclass(frozen=True, eq=False)
class BodyBars:
    """How far the states of a body at ``frames`` (f,) may be from those on ever finer cells of the same shape: ``points`` (f, n) [mm],
    ``energy`` (f,) [N mm], and by name of what is prescribed, or obstructs, the vectors ``forces`` (f,) [N] and ``moments`` (f,)
    [N mm]; NaN where nobody knows. ``displacement`` (f,) is the bar of the displacement over the displacement, both rms over the
    nodes; ``sharper``: what the sharper solution had.
    """

    frames: tuple[float, ...]
    points: Floats
    forces: dict[str, Floats]
    moments: dict[str, Floats]
    energy: Floats
    displacement: Floats
    sharper: str


def body_bars(states: tuple[Reached, ...], finer: tuple[Reached, ...], shared: Ints, sharper: str) -> BodyBars:
    """The bars of the ``states`` of a body.

    Parameters
    ----------
    states
        The rest state first.
    finer
        The states of the ``sharper`` solution, perhaps fewer.
    shared
        Which of its points those of the body (n,) are, -1 of one that it has not.
    sharper
        What it had otherwise, in words.

    """
    others = {state.frame: state for state in finer}
    pairs = [(state, others.get(state.frame)) for state in states]

    def bars(differences: Iterable[float | Floats | None], shape: tuple[int, ...] = ()) -> Floats:
        return np.array([np.full(shape, np.nan) if one is None else SAFETY * LEFT * one for one in differences])

    def vectors(kind: str) -> dict[str, Floats]:
        found = {}
        for name in getattr(states[0], kind):
            ends = [other and (getattr(one, kind)[name], getattr(other, kind)[name]) for one, other in pairs]
            found[name] = bars(end and float(np.linalg.norm(end[0] - end[1])) for end in ends)
        return found

    points = bars(
        (
            other and np.where(shared < 0, np.nan, np.linalg.norm(one.points - other.points[shared], axis=1))
            for one, other in pairs
        ),
        (len(shared),),
    )
    energy = bars(other and abs(one.scalars["energy"] - other.scalars["energy"]) for one, other in pairs)
    moved = np.array([np.linalg.norm(one.points - states[0].points) for one, _ in pairs])
    wrong = np.sqrt(np.nansum(points**2, axis=1))
    wrong[np.isnan(points).all(axis=1)] = np.nan
    share = np.divide(wrong, moved, out=np.where(wrong > 0, np.inf, wrong), where=moved > 0)
    frames = tuple(state.frame for state in states)
    return BodyBars(frames, points, vectors("forces"), vectors("moments"), energy, share, sharper)
