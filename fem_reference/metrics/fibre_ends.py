"""Distances of the ends of fibres in a run from the points to which bones would carry them, independent of the reference.

The end of a fibre at an attachment moves with its bone. A fibre from a file may end near the attached area without reaching it.
Such a fibre does not follow the bone, and differs in length and moment arm from fibres that reach the area. In a run without
fibres, points that its surface carries are measured. :func:`fem_reference.problems.fibre_ends.attached_ends` gives the attachment
of an end.
"""

import numpy as np

from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.metrics.fibre_length import fibre_points
from fem_reference.problems.fibre_ends import ends_of
from fem_reference.runs.store import Run

_TITLE = "Distance of fibre ends from bones"
STATISTICS = {
    "mean": Statistic("mm", _TITLE, "mean", local=True),
    "max": Statistic(
        "mm", _TITLE, "worst end", curve=f"{_TITLE}, worst end", shown={"curve": 22}, local=True, lone=True
    ),
}
OF, AGAINST = "lines", "itself"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, _reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """``mean`` and ``max``: over the ends of all fibres, the mean and the maximum of ``|x(X) - x_bone(X)|`` [mm], the distance
    between an end and the point to which its bone moves the end's rest position. A tendon between the end and the bone makes no
    difference. A muscle without attachments has no such measures.
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
