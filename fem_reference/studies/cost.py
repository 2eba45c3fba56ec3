"""Accuracy against time on a case: runs of its reference and candidates with varied settings, each compared with the truth."""

import logging
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fem_reference import metrics, solvers
from fem_reference.assessment.claims import Claim
from fem_reference.assessment.cost_study import CaseStudy, Study, load
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.assessment.fronts import COSTS, LOAD, Point
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import MeasurementContext, context_of, in_tables, measure
from fem_reference.runs.key import made_with
from fem_reference.runs.store import Run, complete, seconds_per_frame
from fem_reference.scenes.case import COMMAND
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies import refinement
from fem_reference.studies.campaign import Made, Workers, carry_out, each
from fem_reference.studies.execution import Bench
from fem_reference.studies.features import features
from fem_reference.studies.true_errors import claims_of
from fem_reference.studies.variations import TETRAHEDRA, Trial, candidate_trials, carried, reference_trials, resample

log = logging.getLogger(__name__)

# The metrics of every point of the study; the joint moment is computed only for solvers that provide forces.
METRICS = (*in_tables(), "joint_moment")
# Surface solvers also run on surfaces with 4**power times as many triangles; these surfaces are stored with the runs.
_POWERS = (-1, 1)
_MOST_TRIANGLES = 20_000  # with more triangles a run takes minutes, which would be most of a study's time
SURFACES = "surfaces"
FILE = "study.json"
# The number of coarser runs of the reference, starting with the finest, whose error bars are compared with true errors.
_CLAIMING = 4


def study(scenes: Iterable[MuscleCase], store: Path, workers: Workers, only: Collection[str] = ()) -> Study:
    """Study each of ``scenes``, and solve runs that are missing from ``store``. If ``only`` names solvers, study only these."""
    cases, missing = each({scene.name: scene for scene in scenes}, lambda case: _of(case, store, workers, only))
    return Study(tuple(cases.values()), missing, made_with(str(workers)))


def stored(folder: Path) -> list[CaseStudy]:
    """Read the studies inside ``folder``, one for each case, preferably from the folder that is named after the case.

    Points of further studies with the same truth, such as those of a user's own solver, are added. Raises InputError if there is no
    study.
    """
    known = [(study, path.parent.name) for path in sorted(folder.glob(f"*/{FILE}")) for study in load(path)]
    found = dict[str, CaseStudy]()
    for study, _ in sorted(known, key=lambda one: one[0].case != one[1]):
        found[study.case] = _with_points(found.get(study.case, study), study)
    if not found:
        want = "a folder with studies: fem-reference study CASE makes one"
        raise InputError("--out", f'"{folder}", which has no study', want)
    return list(found.values())


def _with_points(study: CaseStudy, other: CaseStudy) -> CaseStudy:
    """The ``study`` of a case with the points that only the ``other`` study has, if both have the same known truth."""
    if not study.truth_key or study.truth_key != other.truth_key:
        return study
    own = {(point.name, str(point.choice)) for point in study.points}
    more = tuple(point for point in other.points if (point.name, str(point.choice)) not in own)
    return replace(study, points=study.points + more)


def _of(case: MuscleCase, store: Path, workers: Workers, only: Collection[str]) -> CaseStudy:
    bench = Bench(case, store)
    log.info("%s: the truth", case.name)
    truth = bench.reference()
    if truth.outcome.status != "converged" or truth.fibres is None:
        raise InputError(case.place, f"a reference with status {truth.outcome.status}", "one that reaches all frames")
    bars = refinement.bars(bench, truth, model=False)
    context, own = context_of(bench.setup(), truth), case.reference.solver
    triangles = len(truth.surface.triangles)
    trials = list(reference_trials(case)) if not only or own in only else []
    if not only or set(only) - {own}:
        others = {
            f"{4.0**power:g} times": resample(case, bench.setup(), power, store / SURFACES)
            for power in _POWERS
            if power < 0 or 4**power * triangles <= _MOST_TRIANGLES
        }
        trials += [one for one in candidate_trials(case, others) if not only or one.choice.solver in only]
    made = carry_out(trials, store, workers)
    points = list[Point]()
    for i, one in enumerate(made):
        log.info("measuring run %d of %d: %s", i + 1, len(made), one.trial.label)
        points.append(_point(one, truth, context))
    size = case.muscle.tet_size / 2**case.muscle.refinements
    return CaseStudy(
        case=case.name,
        title=case.title,
        truth=f"its reference on tetrahedra of {size:.3g} mm",
        points=tuple(points),
        units=metrics.units(),
        bars=known(bars),
        claims=_claims(made, truth, context, store),
        triangles=triangles,
        travel=context.travel,
        features=features(case, bench.setup()),
        truth_key="" if truth.folder is None else truth.folder.name,
    )


def known(bars: ErrorBars | None) -> dict[str, float]:
    """The maximum error bar over frames by ``metric.statistic``, for each statistic of a deviation."""
    if bars is None:
        return {}
    worst = {f"{bar.metric}.{bar.statistic}": bar.worst.value for bar in bars.of_deviations}
    return {name: value for name, value in worst.items() if math.isfinite(value)}


def _point(one: Made, truth: Run, context: MeasurementContext) -> Point:
    trial, run = one.trial, one.run
    choice = {"solver": trial.choice.solver, **settings_of(trial)} | ({"scene": trial.changed} if trial.changed else {})
    found = ({}, {}) if run is None else (errors(run, truth, context), costs(run))
    solver = trial.name if trial.choice.solver == COMMAND else trial.choice.solver
    named = trial.scene.name, solver, trial.name, trial.knob, trial.value
    return Point(*named, choice, *one.ended, *found)


def settings_of(trial: Trial) -> dict[str, object]:
    """The settings of a trial that differ from the defaults of its solver and, for a program, the hash of the program."""
    given = trial.choice.settings
    try:
        own = solvers.settings(trial.choice, trial.name)
        computed = {name: getattr(own, name) for name in type(own).model_computed_fields}
    except InputError:  # the trial failed for this reason
        return given
    fields = {key: field for key, field in type(own).model_fields.items() if not field.exclude}
    changed = {key: value for key, value in given.items() if key in fields and getattr(own, key) != fields[key].default}
    return changed | computed


def greatest(run: Run, truth: Run, context: MeasurementContext, names: Collection[str]) -> dict[str, float]:
    """The maximum magnitude over frames of each deviation of a ``run`` from the ``truth``, by ``metric.statistic``, for the metrics
    in ``names``; NaN if a value is NaN.
    """
    found = measure(complete(run, truth.numbers), truth, context, names)
    return {f"{one.metric}.{one.statistic}": float(np.abs(one.values).max()) for one in found}


def errors(run: Run, truth: Run, context: MeasurementContext) -> dict[str, float]:
    """The maximum deviations of a ``run`` from the ``truth``; empty for an unfinished run and for the truth itself."""
    if run.outcome.status != "converged" or run.folder == truth.folder:
        return {}
    found = greatest(carried(complete(run, truth.numbers), truth.surface), truth, context, METRICS)
    return {name: value for name, value in found.items() if math.isfinite(value)}


def costs(run: Run) -> dict[str, float]:
    """The known costs of a run: those in ``COSTS``, and the seconds of each phase."""
    cost = run.outcome.cost
    seconds = seconds_per_frame(run)
    found = {name: value for name, value in cost.items() if name in (*COSTS, LOAD) or name.startswith("seconds_")}
    # A program states its time per frame number; there may be several frame numbers between two frames of the scene.
    return found | ({} if seconds is None else {"seconds_per_frame": seconds})


def _claims(made: Sequence[Made], truth: Run, context: MeasurementContext, store: Path) -> tuple[Claim, ...]:
    """Error bars of runs of the reference on coarser meshes, with the differences of these runs from the truth."""
    found = list[Claim]()
    on_tetrahedra = [one for one in made if (one.trial.name, one.trial.knob) == ("reference", TETRAHEDRA)]
    members = [(one.trial, run) for one in on_tetrahedra if (run := one.reached) is not None]
    for trial, run in members[-_CLAIMING:]:
        log.info("error bars of %s", trial.label)
        bars = refinement.bars(Bench(trial.scene, store), run, model=False)
        if bars is not None:
            found += claims_of(f"{trial.scene.name}, {trial.value}", bars, (run, truth), context)
    return tuple(found)
