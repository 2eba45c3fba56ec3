"""Comparison of error bars with true errors, which come from finer solutions (smaller tetrahedra, stiffer contact)."""

from collections.abc import Iterable
from functools import partial
from itertools import chain
from pathlib import Path

from fem_reference.assessment.claims import CLAIMED, FINER, Claim, Claims, claimed
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.metrics import MeasurementContext, as_surface, change, context_of, measure
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import refinement
from fem_reference.studies.campaign import each
from fem_reference.studies.execution import Bench

CASES = (
    "hip_flexion",
    "gluteus_maximus",
    "gluteus_medius",
    "gluteus_medius_anatomical",
    "adductor_brevis",
    "iliacus_anatomical",
)


def stake(scenes: Iterable[MuscleCase], store: Path) -> Claims:
    """The claims for the reference of each of ``scenes``: each is an error bar paired with the true error. Runs that are not in
    ``store`` are solved.
    """
    named = {scene.name: scene for scene in scenes}
    found, missing = each(named, partial(_of, store=store))
    why = "its reference, or the finer solution, did not reach all frames"
    missing |= {name: why for name, claims in found.items() if not claims}
    muscles = {name: named[name].muscle for name, claims in found.items() if claims}
    sizes = {name: one.tet_size / 2**one.refinements for name, one in muscles.items()}
    pairs = {name: (size, FINER * size) for name, size in sizes.items()}
    return Claims(tuple(chain(*found.values())), pairs, missing)


def _of(case: MuscleCase, store: Path) -> list[Claim]:
    bench = Bench(case, store)
    reference = bench.reference()
    bars = refinement.bars(bench, reference)
    if bars is None:
        return []
    finer = Bench(refinement.finer(bench, reference, FINER), store)
    run = complete(finer.obtain("finer", case.reference, "reference"), reference.numbers)
    if reference.fibres is None or run.outcome.status != "converged":
        return []
    return claims_of(case.name, bars, (reference, run), context_of(bench.setup(), reference))


def claims_of(case: str, bars: ErrorBars, runs: tuple[Run, Run], context: MeasurementContext) -> list[Claim]:
    """The claims of the first run: its error ``bars`` of changes from rest and of deviations, each paired with the true error,
    the difference from the second, more accurate run.
    """
    names = dict.fromkeys(metric for metric, _ in CLAIMED)
    changes = [change(one, context, names) for one in runs]
    surfaces = [as_surface(one) for one in runs]
    deviations = [measure(surfaces[0], one, context, names) for one in surfaces]
    return [*claimed(case, "change", bars, *changes), *claimed(case, "deviation", bars, *deviations)]
