"""Bands of results due to uncertain parameters of a case, from runs of its reference on a Latin hypercube."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference.assessment import bands
from fem_reference.assessment.bands import Design, sampled
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.uncertainty import Band, Failure, Parameter, Uncertainty, place
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import MeasurementContext, change, described, find
from fem_reference.runs.key import made_with
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import judging, refinement
from fem_reference.studies.campaign import Workers, carry_out, shared_bench
from fem_reference.studies.unknowns import Unknowns, unknowns
from fem_reference.studies.variations import Trial

# The quantities that have a band if a case has them, in addition to the surface and forces.
QUANTITIES = ("volume.deviation", "fibre_length.mean", "moment_arm.mean", "joint_moment.moment")
SURFACE = ("surface_deviation", "rms")
FORCE = "force on "


def study(case: MuscleCase, store: Path, workers: Workers, runs: int, seed: int = 1) -> Uncertainty:
    """Compute bands of a case from a number of ``runs`` of its reference, with workers and a ``seed`` of the design.

    There are no bands if the case itself has no solution. Raises InputError if no parameter has a range.
    """
    varied = unknowns(case)
    case, parameters = varied.case.model_copy(update={"expect": ()}), varied.parameters()  # nothing is to be judged
    points = sampled(len(parameters), runs, seed)
    trials = [_trial(varied, parameters, point) for point in points]
    title, size = varied.whole.title, varied.whole.muscle.tet_size / 2**varied.whole.muscle.refinements
    own = parameters, varied.fixed(), 0, seed, (), ()
    empty = Uncertainty(varied.whole.name, title, size, *own, origin=made_with(str(workers)))
    with fenicsx.shared():
        reference = shared_bench(case, store).reference()
        if reference.outcome.status != "converged":
            said = f"the reference has the status {reference.outcome.status}: {reference.outcome.message}"
            return replace(empty, refused=said)
        comparison, lost = _nominal(case, reference, store, workers)
        made = carry_out(trials, store, workers)
    answered = [one.reached is not None for one in made]
    failed = [one for one in made if one.reached is None]
    design = Design(parameters, points[answered], runs)
    found = tuple(of_runs(comparison, design, [run for one in made if (run := one.reached) is not None]))
    known = [one.run.outcome.cost.get("seconds_processor", np.nan) for one in made if one.run]
    return replace(
        empty,
        runs=runs,
        failures=tuple(
            Failure({p.key: float(one.trial.changed[p.key]) for p in parameters}, *one.ended) for one in failed
        ),
        bands=found,
        placed=tuple(place(run.name, band, values) for run, band, values in _beside(comparison, found)),
        lost=lost,
        seconds=float(np.mean(known)) if known else np.nan,
    )


def _trial(varied: Unknowns, parameters: Sequence[Parameter], point: Floats) -> Trial:
    """The trial of the reference at a ``point`` (d,) of the design."""
    values = {one.key: one.value(float(at)) for one, at in zip(parameters, point, strict=True)}
    said = ", ".join(f"{one.title} {values[one.key]:.3g} {one.unit}".rstrip() for one in parameters)
    return Trial(varied.at(values), varied.whole.reference, "reference", "design", said, values)


def _nominal(case: MuscleCase, reference: Run, store: Path, workers: Workers) -> tuple[Comparison, dict[str, str]]:
    """The comparison of the case itself, with error bars, and, by name, the reasons why candidates did not reach all frames."""
    bench = shared_bench(case, store)
    bars = refinement.bars(bench, reference, model=False)
    made = carry_out([Trial(case, one, one.name) for one in case.candidate], store, workers)
    lost = {one.trial.name: ": ".join(one.ended) for one in made if one.reached is None}
    return judging.compare(bench, reference, [one.run for one in made if one.run], bars), lost


def of_runs(comparison: Comparison, design: Design, runs: Sequence[Run]) -> Iterator[Band]:
    """The band of each quantity that the case has, from those ``runs`` of the ``design`` that reached all frames."""
    whole = [complete(run, comparison.reference.numbers) for run in runs]
    context = comparison.context
    assert isinstance(context, MeasurementContext)  # the case is that of a muscle
    yield _surface(comparison, context, design, whole)
    measured = [change(run, context, {name.split(".")[0] for name in QUANTITIES}) for run in whole]
    for name in QUANTITIES:
        metric, statistic = name.split(".")
        nominal = find(comparison.changes["reference"], metric, statistic)
        if nominal is not None and np.isfinite(nominal.values).any():
            stated = described()[metric, statistic]
            empty = _empty(comparison, name, stated.curve or stated.label, stated.unit, nominal.values)
            found = [one.values for each in measured if (one := find(each, metric, statistic)) is not None]
            yield bands.of_values(replace(empty, bar=nominal.error_bars), design, _rows(found, nominal.values))
    for bone in context.bones:
        if bone.motion is not None and f"force_on_{bone.name}_x" in comparison.reference.scalars:
            own, *forces = (np.linalg.norm(run.force(bone.name), axis=1) for run in (comparison.reference, *whole))
            empty = _empty(comparison, f"{FORCE}{bone.name}", f"Force of the muscle on {bone.name}", "N", own)
            bars = comparison.error_bars
            bar = None if bars is None else bars.find("change", "force_on_bone", bone.name)
            yield bands.of_values(replace(empty, bar=None if bar is None else bar.values), design, _rows(forces, own))


def _rows(found: Sequence[Floats], like: Floats) -> Floats:
    """The values ``found`` of n runs as an array (n, f), even for n = 0; ``like`` (f,) has a value for each frame."""
    return np.array(found).reshape(len(found), len(like))


def _surface(comparison: Comparison, context: MeasurementContext, design: Design, runs: Sequence[Run]) -> Band:
    """The band of the rms distance of the surfaces of ``runs`` from that of the nominal result, averaged over the area."""
    reference, bars = comparison.reference, comparison.error_bars
    title, frames = "Distance of the surface from the nominal result, rms", len(reference.numbers)
    empty = _empty(comparison, ".".join(SURFACE), title, described()[SURFACE].unit, np.zeros(frames))
    bar = None if bars is None else bars.find("deviation", *SURFACE)
    weights = np.sqrt(context.areas / context.areas.sum())[:, None]
    products = np.zeros((frames, len(runs), len(runs)))
    for i in range(frames if runs else 0):
        moved = np.array([((run.positions[i] - reference.positions[i]) * weights).ravel() for run in runs])
        products[i] = moved @ moved.T
    return bands.of_field(replace(empty, bar=None if bar is None else bar.values, distance=True), design, products)


def _empty(comparison: Comparison, quantity: str, title: str, unit: str, nominal: Floats) -> Band:
    """A band that has no values yet except the result of the case (``nominal``)."""
    unknown = np.full(len(nominal), np.nan)
    return Band(quantity, title, unit, comparison.reference.numbers, nominal, unknown, unknown, unknown)


def _beside(comparison: Comparison, found: Sequence[Band]) -> Iterator[tuple[Run, Band, Floats]]:
    """Each candidate with each band that was not refused, and the candidate's values (f,) of the band's quantity."""
    for run in comparison.candidates:
        for band in found:
            metric, _, statistic = band.quantity.partition(".")
            measures = comparison.deviations[run.name] if band.distance else comparison.changes[run.name]
            measure = find(measures, metric, statistic)
            if measure is not None and not band.refused:
                yield run, band, measure.values
