"""Error bars of the force on each bone and of its moment about the origin, as magnitudes of vectors.

They follow the same rule as the bars of ``joint_moment``. The difference between two runs is the magnitude of the difference of
their vectors, so the bar is not too small where a component crosses zero. Two bones between which a muscle is in balance have
the same bars.
"""

import numpy as np

from fem_reference.assessment.differences import together, typical
from fem_reference.assessment.error_bars import SPREAD, TETRAHEDRA, VARIATION, ErrorBar, Pair
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import MeasurementContext, as_surface, at_rest, measure
from fem_reference.runs.contents import vector_names
from fem_reference.runs.store import Run

_UNITS = {"force": "N", "moment": "N mm"}


def force_bars(pair: Pair, context: MeasurementContext) -> tuple[ErrorBar, ...]:
    """The error bars of ``force_on_bone`` and ``moment_on_bone`` of the reference, for each bone; empty if no force is known."""
    moved = _apart(at_rest(pair.fine), pair.fine, context)
    others = {TETRAHEDRA: (pair.coarse, pair.fine)} | {name: (run, pair.coarse) for name, run in pair.varied.items()}
    apart = {name: _apart(*runs, context) for name, runs in others.items()}
    bars = []
    for kind, unit in _UNITS.items():
        left = dict.fromkeys(others, VARIATION) | {TETRAHEDRA: pair.share("joint_moment", kind)}
        for bone in vector_names(pair.fine.scalars, "force_on_"):
            parts = dict[str, Floats]()
            for name, runs in others.items():
                size = _length(kind, bone, *runs)
                parts[name] = left[name] * typical(size, apart[name], moved if name == TETRAHEDRA else None)
            bar = together(parts, np.ones(len(moved), bool))
            # The change if the springs of this muscle are distributed differently, and the change with exact attachments of this
            # muscle or of a neighbour.
            known = [SPREAD * _length(kind, bone, pair.fine)] if pair.springs else []
            known += [] if pair.exact is None else [_length(kind, bone, pair.exact, pair.coarse)]
            model = np.maximum.reduce(known) if known else None
            bars.append(ErrorBar("change", f"{kind}_on_bone", bone, unit, *bar, model))
    return tuple(bars)


def _apart(run: Run, other: Run, context: MeasurementContext) -> Floats:
    """The rms distance (f,) [mm] between the surfaces of two runs."""
    found = measure(as_surface(run), as_surface(other), context, ["surface_deviation"])
    return next(one.values for one in found if one.statistic == "rms")


def _length(kind: str, bone: str, run: Run, other: Run | None = None) -> Floats:
    """The magnitude (f,) of the force or moment on a ``bone`` in a ``run``, or of its difference from that in another run."""
    vectors = [one.force(bone) if kind == "force" else one.moment(bone) for one in (run, other) if one is not None]
    return np.asarray(np.linalg.norm(vectors[0] - (vectors[1] if other else 0.0), axis=1))
