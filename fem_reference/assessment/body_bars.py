"""Error bars of a body: by how much its states differ from those of a sharper solution, and how much more is left."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.assessment.error_bars import SAFETY
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.runs.store import Frame

# The error over what half the size of cells changes of it, where it is of first order: the least order there is away from rims of
# what is prescribed, where displacement goes with the root of the distance, whatever the element (docs/error_bars.md).
LEFT = 2.0


@dataclass(frozen=True, eq=False)
class BodyBars:
    """Error bars of a body at ``frames`` (f,): distances from its states on ever finer cells of the same shape: ``points`` (f, n)
    [mm], ``energy`` (f,) [N mm], and by name of what is prescribed, or obstructs, the vectors ``forces`` (f,) [N] and ``moments``
    (f,) [N mm]; NaN where nobody knows. ``displacement`` (f,) is the bar of the displacement over the displacement, both rms over
    the nodes; ``sharper``: what the sharper solution had.
    """

    frames: tuple[float, ...]
    points: Floats
    forces: dict[str, Floats]
    moments: dict[str, Floats]
    energy: Floats
    displacement: Floats
    sharper: str


def body_bars(states: tuple[Frame, ...], finer: tuple[Frame, ...], shared: Ints, sharper: str) -> BodyBars:
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
    there = {state.number: state for state in finer}
    pairs = [(state, _beside(state, there.get(state.number), shared)) for state in states]
    left = SAFETY * LEFT

    def vectors(kind: str) -> dict[str, Floats]:
        ends = {
            name: [[getattr(one, kind)[name] for one in pair] for pair in pairs] for name in getattr(states[0], kind)
        }
        return {name: left * np.linalg.norm(np.diff(ways, axis=1)[:, 0], axis=1) for name, ways in ends.items()}

    points = left * np.array([np.linalg.norm(one.points - other.points, axis=1) for one, other in pairs])
    energy = left * np.array([abs(one.scalars["energy"] - other.scalars["energy"]) for one, other in pairs])
    moved = np.array([np.linalg.norm(one.points - states[0].points) for one in states])
    wrong = np.sqrt(np.sum(np.where(shared < 0, 0.0, points) ** 2, axis=1))
    share = np.divide(wrong, moved, out=np.where(wrong > 0, np.inf, wrong), where=moved > 0)
    frames = tuple(state.number for state in states)
    return BodyBars(frames, points, vectors("forces"), vectors("moments"), energy, share, sharper)


def _beside(state: Frame, other: Frame | None, shared: Ints) -> Frame:
    """The ``other`` state at the points of ``state``, NaN where it has none or was not reached."""
    if other is None:
        blank: dict[str, Any] = {
            kind: {name: np.full(3, np.nan) for name in getattr(state, kind)} for kind in ("forces", "moments")
        }
        return replace(state, points=np.full_like(state.points, np.nan), scalars={"energy": np.nan}, **blank)
    return replace(other, points=np.where(shared[:, None] < 0, np.nan, other.points[shared]))
