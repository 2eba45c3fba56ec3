"""Decompositions of a muscle into fibres (report 6.1.2) against each other: direction, length, points outside, crossings, and
the answer of the reference with each.
"""

import logging
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fem_reference import effects
from fem_reference.assessment.estimation import AnswerChange, DecompositionError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface
from fem_reference.geometry.fibres import NearestLine
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.metrics import context_of
from fem_reference.problems import anatomy, muscle
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.fibres import Chmd, Fibres, KohoutKukacka, Traced
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import refinement
from fem_reference.studies.cost import greatest, known
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

LAPLACE = "Laplace field"
# The statistics of an answer that fibres may change, and the law of fibres in a case without one: that of hip_flexion.
ANSWERS = (
    "surface_deviation.rms",
    "surface_deviation.max",
    "fibre_length.max",
    "volume.deviation",
    "joint_moment.force",
)
PULL = {"stress": "300 kPa", "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.0, "linear_from": 1.4}
COUNT, CONTOURS = 20, 20
NEAR = 0.2  # two fibres that are nearer [mm] between their ends cross
_ENDS = 0.1  # of a fibre, at either end, where attachments bring fibres together
_ALONG = 400  # points at which a fibre is looked at
_OUTSIDE = 1e-3  # a point is outside the surface from here on [mm]


def of_decompositions(case: MuscleCase, rest: Setup) -> Iterator[DecompositionError]:
    """Each source of fibres of a case against the Laplace field's and, where a file has some, against those."""
    found = {
        name: anatomy.lines_of(one, rest.surface, partial(muscle.filled, one, rest))[0]
        for name, one in variants(case).items()
    }
    for against in (LAPLACE, "file"):
        for source in (name for name in found if against in found and name != against):
            yield compared(case.name, rest.surface, (source, found[source]), (against, found[against]))


def answers(case: MuscleCase, store: Path) -> Iterator[AnswerChange]:
    """The reference's answer on a case with each source of fibres, beside that with the Laplace field's and its error bars. Lengths
    are those of the Laplace field's lines, carried by each surface.
    """
    # Candidates may not fit other fibres.
    alone = case.model_copy(update={"candidate": ()})
    scenes = variants(alone if any("fibre" in one.needs for one in case.effects) else _pulling(alone))
    if LAPLACE not in scenes:
        return
    log.info("%s: the reference with fibres of the Laplace field", case.name)
    bench = Bench(scenes.pop(LAPLACE), store)
    base = bench.reference()
    bars = refinement.bars(bench, base, model=False) if base.outcome.status == "converged" else None
    for source, scene in scenes.items():
        log.info("%s: the reference with fibres by %s", case.name, source)
        run, found = Bench(scene, store).reference(), dict[str, float]()
        if base.outcome.status == run.outcome.status == "converged":
            context = context_of(bench.setup(), base)
            found = greatest(_carrying(run), _carrying(base), context, {name.split(".")[0] for name in ANSWERS})
        picked = ({name: values[name] for name in ANSWERS if name in values} for values in (found, known(bars)))
        yield AnswerChange(case.name, source, LAPLACE, run.outcome.status, *picked)


def _pulling(case: MuscleCase) -> MuscleCase:
    """The case with fibres that resist stretch."""
    return case.model_copy(update={"effect": (*case.effects, effects.make("fibre_passive", **PULL))})


def _carrying(run: Run) -> Run:
    """The run without fibres of its own: its surface carries those that are measured."""
    return replace(run, fibres=None, fibre_positions=None)


def variants(case: MuscleCase) -> dict[str, MuscleCase]:
    """The case with each source of fibres that it can have."""
    ends = list(case.fibres.ends.values()) or [one.name for one in case.attachment][:2]
    found: dict[str, Fibres] = {}
    if len(ends) == 2:
        start, end = ends
        found[LAPLACE] = Fibres(traced=Traced(count=COUNT, start=start, end=end))
        template = KohoutKukacka(count=COUNT, start=start, end=end, contours=CONTOURS, template="parallel")
        found["Kohout and Kukacka"] = Fibres(kohout_kukacka=template)
    if (given := case.fibres.polylines) is not None:
        found["CHMD"] = Fibres(chmd=Chmd(count=COUNT, heads=(given,)))
        found["file"] = case.fibres
    return {name: case.model_copy(update={"fibres": fibres}) for name, fibres in found.items()}


def compared(
    case: str, surface: Surface, one: tuple[str, Polylines], other: tuple[str, Polylines]
) -> DecompositionError:
    """Named fibres ``one`` beside the ``other`` in the ``surface`` of a muscle."""
    (source, lines), (against, known) = one, other
    middles, along = NearestLine(known).segments
    directions = NearestLine(lines)(np.zeros(len(middles), np.int64), middles)
    angles = np.degrees(np.arccos(np.clip(np.abs(np.einsum("ij,ij->i", directions, along)), 0, 1)))
    return DecompositionError(
        *(case, source, against),
        median=float(np.median(angles)),
        most=float(np.quantile(angles, 0.95)),
        length=float(lines.lengths().mean() / known.lengths().mean()),
        outside=float((signed_distances(lines.points, surface) > _OUTSIDE).mean()),
        crossings=crossings(lines),
    )


def crossings(lines: Polylines) -> int:
    """The number of pairs of lines that come nearer than 0.2 mm to each other between their ends."""
    inner = [_inner(lines.points[low:high]) for low, high in pairwise(lines.offsets)]
    numbers: Ints = np.repeat(np.arange(len(inner)), _ALONG)
    near = cKDTree(np.concatenate(inner)).query_pairs(NEAR, output_type="ndarray")
    pairs = np.sort(numbers[near], axis=1)
    return len(np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0))


def _inner(line: Floats) -> Floats:
    """Points (400, 3) along a ``line`` (k, 3) without its ends."""
    at = np.linspace(_ENDS, 1 - _ENDS, _ALONG) * (len(line) - 1)
    return np.stack([np.interp(at, np.arange(len(line)), line[:, axis]) for axis in range(3)], axis=1)
