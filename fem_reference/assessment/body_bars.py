"""Error bars of a body: the differences of its states from a more accurate solution, and an estimate of the rest."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.assessment.error_bars import SAFETY
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.runs.store import Frame

# The error over its change when the cell size is halved, for order 1: the least order away from rims of constraints, where the
# displacement goes with the square root of the distance, for any element (docs/error_bars.md).
LEFT = 2.0


@dataclass(frozen=True, eq=False)
class BodyBars:
    """Error bars of a body at ``frames`` (f,): distances from its states on ever finer cells of the same shape. ``points`` (f, n)
    [mm], ``energy`` (f,) [N mm], and by name of each constraint or bone the vectors ``forces`` (f,) [N] and ``moments`` (f,)
    [N mm]; NaN where unknown. ``displacement`` (f,) is the bar of the displacement over the displacement, both rms over the
    nodes; ``sharper`` describes the more accurate solution.
    """

    frames: tuple[float, ...]
    points: Floats
    forces: dict[str, Floats]
    moments: dict[str, Floats]
    energy: Floats
    displacement: Floats
    sharper: str


def body_bars(states: tuple[Frame, ...], finer: tuple[Frame, ...], shared: Ints, sharper: str) -> BodyBars:
    """The bars of the ``states`` of a body, the rest state first, from the ``finer`` states of a more accurate solution, which may
    be fewer. ``shared`` (n,): the number of each point of the body in that solution, -1 for a point that it lacks; ``sharper``:
    its differences in numerics, in words.
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
