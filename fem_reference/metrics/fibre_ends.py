"""Distances of the ends of fibres from where their bones take them; of the run alone, independent of the reference.

An end of a fibre at an attachment moves with its bone. Where fibres end beside the attached area, as given ones may, the muscle
leaves them behind, and their lengths and moment arms are not those of fibres that reach the bone. A run without fibres is measured
on points that its surface carries. The attachment of an end is that of
:func:`fem_reference.problems.fibre_ends.attached_ends`.
"""

import numpy as np

from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.metrics.fibre_length import fibre_points
from fem_reference.problems.fibre_ends import ends_of
from fem_reference.runs.store import Run

_TITLE = "Ends of fibres off their bones"
STATISTICS = {
    "mean": Statistic("mm", _TITLE, "mean", local=True),
    "max": Statistic(
        "mm", _TITLE, "worst end", curve=f"{_TITLE}, worst end", shown={"curve": 22}, local=True, lone=True
    ),
}
OF, AGAINST = "lines", "itself"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, _reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """``mean`` and ``max`` over the ends of all fibres of ``|x(X) - x_bone(X)|`` [mm]: the place of an end less that to which the
    pose of its bone takes its rest position, also where a tendon continues to the bone. Nothing where the muscle is not attached.
    """
    if context.ends is None:
        return ()
    points, own = fibre_points(run, context), run.fibres
    rest = ends_of(context.fibres if own is None or own.points.shape != context.fibres.points.shape else own)
    off = np.array(
        [
            context.ends.off(ends_of(context.fibres, at), rest, number)
            for number, at in zip(run.numbers, points, strict=True)
        ]
    ).reshape(len(run.numbers), -1)
    worst = np.argmax(np.where(np.isnan(off), np.inf, off), axis=1)
    where = [context.ends.named(*divmod(int(end), 2)) for end in worst]
    return measures("fibre_ends", {"mean": off.mean(axis=1), "max": off.max(axis=1)}, where)
