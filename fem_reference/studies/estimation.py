"""Errors of the report's estimation techniques (chapter 3) on the fibres, attachments and surface of a case.

The decompositions of a muscle into fibres (report 6.1.2) are also compared with each other: their directions, lengths, points
outside the muscle and crossings, and the result of the reference with each decomposition.
"""

import logging
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fem_reference import effects
from fem_reference.assessment.estimation import (
    AnswerChange,
    CurveError,
    DecompositionError,
    Estimation,
    FitError,
    HeightError,
    RodError,
)
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, enclosed_volume
from fem_reference.geometry import radial_basis
from fem_reference.geometry.curves import TECHNIQUES, Curve
from fem_reference.geometry.fibres import NearestLine
from fem_reference.geometry.gaussian_surface import fit
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.metrics import as_surface, context_of
from fem_reference.problems import anatomy, muscle
from fem_reference.problems.setup import Setup
from fem_reference.scenes.fibres import Chmd, Fibres, KohoutKukacka, Traced
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import cost, refinement
from fem_reference.studies.campaign import each
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

CASES = ("hip_flexion", "gluteus_maximus", "gluteus_medius", "iliacus_anatomical", "adductor_brevis")
KNOWN = (4, 6, 10, 20)  # numbers of known points of a fibre
CENTRES, GAUSSIANS = (4, 9, 16, 25), (10, 30, 100)
_ALONG = 1000  # the number of sample points of a curve
_POLYNOMIAL = 3  # the number of polynomial terms: those of a plane
LAPLACE = "Laplace field"
# The statistics that may change with the fibres, and the fibre law that a case without one receives: that of hip_flexion.
ANSWERS = (
    "surface_deviation.rms",
    "surface_deviation.max",
    "fibre_length.max",
    "volume.deviation",
    "joint_moment.force",
)
PULL = {"stress": "300 kPa", "p1": 0.05, "p2": 6.6, "optimal_stretch": 1.0, "linear_from": 1.4}
COUNT, CONTOURS, AROUND = 20, 20, 12
NEAR = 0.2  # [mm]: two fibres cross if they come nearer than this to each other away from their ends
_ENDS = 0.1  # the fraction of a fibre that is left out at either end, where attachments bring fibres together
_SAMPLED = 400  # the number of sample points of a fibre
_SAMPLES = 20_000  # the number of random points in the box around a muscle
_OUTSIDE = 1e-3  # [mm]: a point counts as outside the surface beyond this distance


def estimate(cases: Iterable[MuscleCase], store: Path | None = None) -> Estimation:
    """Apply all techniques to all cases; with a ``store``, also solve the reference with each decomposition into fibres."""
    named = {case.name: case for case in cases}
    setups, missing = each(named, muscle.setup)
    curves, heights, fits = list[CurveError](), list[HeightError](), list[FitError]()
    decompositions, changes, rods = list[DecompositionError](), list[AnswerChange](), list[RodError]()
    for case, setup in ((named[name], setup) for name, setup in setups.items()):
        log.info("%s: curves, heights and surfaces", case.name)
        fibres = muscle.build(case, setup).fibres
        curves += of_fibres(case.name, fibres)
        rods.append(of_rods(case.name, setup.surface, fibres))
        heights += of_attachments(case.name, setup)
        fits += of_surface(case.name, setup)
        decompositions += of_decompositions(case, setup)
        if store is not None:
            changes += answers(case, store)
    measured = tuple(curves), tuple(heights), tuple(fits)
    return Estimation(*measured, missing, tuple(decompositions), tuple(changes), tuple(rods))


def of_fibres(case: str, fibres: Polylines) -> Iterator[CurveError]:
    """Errors of each technique over all fibres, for each number of known points that leaves two or more others on every fibre."""
    lines = [fibres.points[low:high] for low, high in pairwise(fibres.offsets)]
    for known in (count for count in KNOWN if all(len(line) >= count + 2 for line in lines)):
        for technique, (make, _) in TECHNIQUES.items():
            off = np.concatenate([_off(line, known, make) for line in lines])
            yield CurveError(case, technique, known, float(np.sqrt(np.mean(off**2))), float(off.max()))


def _off(line: Floats, count: int, make: Callable[[Floats], Curve]) -> Floats:
    """Distances (k,) [mm] between a curve and those points of a ``line`` (n, 3) that the curve does not use. The curve is made by
    ``make`` from ``count`` evenly spread points of the line.
    """
    known = np.rint(np.linspace(0, len(line) - 1, count)).astype(np.int64)
    away, _ = cKDTree(make(line[known])(np.linspace(0, 1, _ALONG))).query(np.delete(line, known, axis=0))
    return np.asarray(away)


def of_attachments(case: str, setup: Setup) -> Iterator[HeightError]:
    """Errors of height functions with each choice of centres, on each attached area with enough vertices."""
    for entry in setup.attached:
        flat = _flat(setup.surface.points[entry.vertices])
        for count in (count for count in CENTRES if 2 * count <= len(flat[::2])):
            # Lengths are in radii of the Gaussians, so that condition numbers do not depend on the unit of length.
            places, heights = flat[:, :2] * np.sqrt(count) / float(np.ptp(flat[:, 0])), flat[:, 2]
            known, asked = places[::2], places[1::2]
            for choice, centres in _centres(known, heights[::2], count):
                found = radial_basis.radial_sum(known, heights[::2], centres, 1.0, terms=_POLYNOMIAL)
                rms = float(np.sqrt(np.mean((found(asked) - heights[1::2]) ** 2)))
                yield HeightError(case, entry.attachment, choice, count, rms, found.condition)


def _flat(points: Floats) -> Floats:
    """Points (n, 3) of an area relative to their mean, in the principal axes of the area (the last is normal to it), and sorted
    along the first axis.

    The result does not depend on the axes of the scene or the order of the points: third moments along the axes are made positive.
    """
    away = points - points.mean(axis=0)
    flat = away @ np.linalg.svd(away, full_matrices=False)[2].T
    flat *= np.where((flat**3).sum(axis=0) < 0, -1, 1)
    return np.asarray(flat[np.argsort(flat[:, 0], kind="stable")])


def _centres(points: Floats, heights: Floats, count: int) -> Iterator[tuple[str, Floats]]:
    """The name and the centres (count, 2) of each choice in the report's section 3.5.1."""
    yield "grid", radial_basis.grid_centres(points, count)
    yield "Halton", radial_basis.halton_centres(points, count)
    yield "greedy", radial_basis.greedy_centres(points, heights, count, 1.0, terms=_POLYNOMIAL)
    yield "features", radial_basis.feature_centres(points, heights, count)


def of_surface(case: str, setup: Setup) -> Iterator[FitError]:
    """Errors of the muscle's surface fitted by different numbers of Gaussians."""
    surface = setup.surface
    for count in GAUSSIANS:
        found = fit(surface, count).project(surface.points)
        off = np.linalg.norm(found - surface.points, axis=1)
        share = enclosed_volume(found, surface.triangles) / enclosed_volume(surface.points, surface.triangles)
        yield FitError(case, len(surface.points), count, float(np.sqrt(np.mean(off**2))), float(off.max()), share)


def of_rods(case: str, surface: Surface, fibres: Polylines) -> RodError:
    """Errors of rods along ``fibres`` as a model of the muscle's volume, at random points of the box around rods and muscle."""
    volume = enclosed_volume(surface.points, surface.triangles)
    radius = float(np.sqrt(volume / (np.pi * fibres.lengths().sum())))
    lines = np.concatenate([_along(fibres.points[low:high]) for low, high in pairwise(fibres.offsets)])
    corners = np.concatenate([surface.points, lines - radius, lines + radius])
    low, high = corners.min(axis=0), corners.max(axis=0)
    points = np.random.default_rng(0).uniform(low, high, (_SAMPLES, 3))
    covered = cKDTree(lines).query(points, distance_upper_bound=radius)[0] <= radius
    own = signed_distances(points, surface) < 0
    united = covered.mean() * float(np.prod(high - low)) / volume
    outside = float((covered & ~own).sum() / covered.sum())
    return RodError(case, len(fibres), radius, float(covered[own].mean()), outside, max(0.0, 1 - united))


def of_decompositions(case: MuscleCase, rest: Setup) -> Iterator[DecompositionError]:
    """Differences of each source of fibres from the Laplace field and, if the case has fibres in a file, from those fibres."""
    found = {
        name: anatomy.lines_of(one, rest.surface, partial(muscle.filled, one, rest))[0]
        for name, one in variants(case).items()
    }
    for against in (LAPLACE, "file"):
        for source in (name for name in found if against in found and name != against):
            yield compared(case.name, rest.surface, (source, found[source]), (against, found[against]))


def answers(case: MuscleCase, store: Path) -> Iterator[AnswerChange]:
    """Changes of the reference's result if the fibres of the Laplace field are replaced by those of each other source, with the
    error bars of the result for the Laplace field. Fibre lengths are always those of the lines of the Laplace field, carried along
    by each surface.
    """
    # Candidates are removed, as other fibres may not suit them.
    alone = case.model_copy(update={"candidate": ()})
    if not any("fibre" in one.needs for one in case.effects):
        alone = alone.model_copy(update={"effect": (*case.effects, effects.make("fibre_passive", **PULL))})
    scenes = variants(alone)
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
            found = cost.greatest(as_surface(run), as_surface(base), context, {name.split(".")[0] for name in ANSWERS})
        picked = ({name: values[name] for name in ANSWERS if name in values} for values in (found, cost.known(bars)))
        yield AnswerChange(case.name, source, LAPLACE, run.outcome.status, *picked)


def variants(case: MuscleCase) -> dict[str, MuscleCase]:
    """The case with each source of fibres that it can have."""
    ends = list(case.fibres.ends.values()) or [one.name for one in case.attachment][:2]
    found: dict[str, Fibres] = {}
    if len(ends) == 2:
        start, end = ends
        found[LAPLACE] = Fibres(traced=Traced(count=COUNT, start=start, end=end))
        template = KohoutKukacka(count=COUNT, start=start, end=end, contours=CONTOURS, template="parallel")
        found["Kohout and Kukacka"] = Fibres(kohout_kukacka=template)
        found["CHMD"] = Fibres(chmd=Chmd(count=COUNT, around=Traced(count=AROUND, start=start, end=end)))
    if (given := case.fibres.polylines) is not None:
        found["CHMD of the file"] = Fibres(chmd=Chmd(count=COUNT, heads=(given,)))
        found["file"] = case.fibres
    return {name: case.model_copy(update={"fibres": fibres}) for name, fibres in found.items()}


def compared(
    case: str, surface: Surface, one: tuple[str, Polylines], other: tuple[str, Polylines]
) -> DecompositionError:
    """Compare fibres ``one`` with the fibres ``other`` inside the ``surface`` of a muscle; both come with their names."""
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
    """The number of pairs of lines that come nearer than ``NEAR`` to each other away from their ends."""
    inner = [_along(lines.points[low:high], _ENDS) for low, high in pairwise(lines.offsets)]
    numbers: Ints = np.repeat(np.arange(len(inner)), _SAMPLED)
    near = cKDTree(np.concatenate(inner)).query_pairs(NEAR, output_type="ndarray")
    pairs = np.sort(numbers[near], axis=1)
    return len(np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0))


def _along(line: Floats, left_out: float = 0.0) -> Floats:
    """Sample points (400, 3) along a ``line`` (k, 3), without the fraction ``left_out`` at either end."""
    at = np.linspace(left_out, 1 - left_out, _SAMPLED) * (len(line) - 1)
    return np.stack([np.interp(at, np.arange(len(line)), line[:, axis]) for axis in range(3)], axis=1)
