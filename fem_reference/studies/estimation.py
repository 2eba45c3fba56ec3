"""The report's estimation techniques (chapter 3) on the fibres, attachments and surface of a case: error against parameters."""

import logging
from collections.abc import Iterable, Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.assessment.estimation import (
    AnswerChange,
    CurveError,
    DecompositionError,
    Estimation,
    FitError,
    HeightError,
)
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, enclosed_volume
from fem_reference.geometry import radial_basis
from fem_reference.geometry.curves import TECHNIQUES, Curve
from fem_reference.geometry.gaussian_surface import fit
from fem_reference.problems import muscle
from fem_reference.problems.setup import Setup
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.decompositions import answers, of_decompositions

log = logging.getLogger(__name__)

CASES = ("hip_flexion", "gluteus_maximus", "gluteus_medius", "iliacus_anatomical", "adductor_brevis")
KNOWN = (4, 6, 10, 20)  # points of a fibre
CENTRES, GAUSSIANS = (4, 9, 16, 25), (10, 30, 100)
_ALONG = 1000  # points at which a curve is looked at
_POLYNOMIAL = 3  # terms of a plane


def estimate(cases: Iterable[MuscleCase], store: Path | None = None) -> Estimation:
    """All techniques on all cases; with a ``store`` of runs also the reference's answers with each decomposition, at the quick size
    of each case.
    """
    curves, heights, fits, missing = list[CurveError](), list[HeightError](), list[FitError](), dict[str, str]()
    decompositions, changes = list[DecompositionError](), list[AnswerChange]()
    for case in cases:
        log.info("%s: curves, heights and surfaces", case.name)
        try:
            setup = muscle.setup(case)
        except InputError as error:
            missing[case.name] = str(error)
            continue
        curves += of_fibres(case.name, muscle.build(case, setup).fibres)
        heights += of_attachments(case.name, setup)
        fits += of_surface(case.name, setup)
        decompositions += of_decompositions(case, setup)
        if store is not None:
            changes += answers(casefile.read_muscle(case.name, case.quick) if case.quick else case, store)
    return Estimation(tuple(curves), tuple(heights), tuple(fits), missing, tuple(decompositions), tuple(changes))


def of_fibres(case: str, fibres: Polylines) -> Iterator[CurveError]:
    """Each technique on all fibres, of which so many points are known as leave two at least to compare with."""
    lines = [fibres.points[low:high] for low, high in pairwise(fibres.offsets)]
    for known in (count for count in KNOWN if all(len(line) >= count + 2 for line in lines)):
        for technique, (make, _) in TECHNIQUES.items():
            off = np.concatenate(
                [_beside(make(line[some]), line, some) for line in lines for some in [_spread(line, known)]]
            )
            yield CurveError(case, technique, known, float(np.sqrt(np.mean(off**2))), float(off.max()))


def _spread(line: Floats, known: int) -> Ints:
    """The indices (known,) of points of a ``line`` (n, 3) that are spread over it evenly, with both ends."""
    return np.rint(np.linspace(0, len(line) - 1, known)).astype(np.int64)


def _beside(curve: Curve, line: Floats, known: Ints) -> Floats:
    """The distances (k,) [mm] of the other points of a ``line`` (n, 3) from a curve."""
    away, _ = cKDTree(curve(np.linspace(0, 1, _ALONG))).query(np.delete(line, known, axis=0))
    return np.asarray(away)


def of_attachments(case: str, setup: Setup) -> Iterator[HeightError]:
    """Each choice of centres on each attached area with enough vertices."""
    for entry in setup.attached:
        points = setup.surface.points[entry.vertices]
        middle = points.mean(axis=0)
        flat = (points - middle) @ np.linalg.svd(points - middle, full_matrices=False)[2].T
        known, asked = flat[::2], flat[1::2]
        for count in (count for count in CENTRES if 2 * count <= len(known)):
            shape = np.sqrt(count) / float(np.ptp(flat[:, 0]))
            for choice, centres in _centres(known[:, :2], known[:, 2], count, shape):
                found = radial_basis.radial_sum(known[:, :2], known[:, 2], centres, shape, terms=_POLYNOMIAL)
                rms = float(np.sqrt(np.mean((found(asked[:, :2]) - asked[:, 2]) ** 2)))
                yield HeightError(case, entry.attachment, choice, count, rms, found.condition)


def _centres(points: Floats, heights: Floats, count: int, shape: float) -> Iterator[tuple[str, Floats]]:
    """The centres (count, 2) by each choice of the report's section 3.5.1."""
    yield "grid", radial_basis.grid_centres(points, count)
    yield "Halton", radial_basis.halton_centres(points, count)
    yield "greedy", radial_basis.greedy_centres(points, heights, count, shape, terms=_POLYNOMIAL)
    yield "features", radial_basis.feature_centres(points, heights, count)


def of_surface(case: str, setup: Setup) -> Iterator[FitError]:
    """The muscle's surface by Gaussians."""
    surface = setup.surface
    for count in GAUSSIANS:
        found = fit(surface, count).project(surface.points)
        off = np.linalg.norm(found - surface.points, axis=1)
        share = enclosed_volume(found, surface.triangles) / enclosed_volume(surface.points, surface.triangles)
        yield FitError(case, len(surface.points), count, float(np.sqrt(np.mean(off**2))), float(off.max()), share)
