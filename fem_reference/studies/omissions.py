"""What it changes to leave out each effect of a scene in turn, or each optional feature of a solver, and all of them."""

import logging
import math
import os
import platform
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import metrics, solvers
from fem_reference.assessment.omissions import MEASURES, Ablation, CaseOmissions, Omission
from fem_reference.effects import Effect, Energy, Load, Ramped
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.version import __version__
from fem_reference.metrics import MeasurementContext, measure
from fem_reference.problems import of_case
from fem_reference.problems.body import ELEMENTS
from fem_reference.runs.complete import complete
from fem_reference.runs.key import versions
from fem_reference.runs.store import Run
from fem_reference.scenes.case import MACHINE_ONLY, SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import refinement
from fem_reference.studies.campaign import Made, Workers, carry_out, shared_bench
from fem_reference.studies.cost import known
from fem_reference.studies.execution import Bench
from fem_reference.studies.ladders import Trial

log = logging.getLogger(__name__)

# A run with something left out may take so many times as long as the whole, and the time [s] to compile a form that is new.
LIMIT, COMPILING = 2.0, 60.0


@dataclass(frozen=True)
class Part:
    """What is left out of a trial: of its scene the ``effects``, of its choice of a solver the ``features``; each by name."""

    effects: dict[str, Effect]
    features: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """What is left out, by name."""
        return *self.effects, *self.features


def study(scene: MuscleCase, store: Path, workers: Workers) -> CaseOmissions:
    """The reference and the candidates of a scene, whole and with each thing left out that can be; runs are in ``store``, solved
    where that was not done before.
    """
    with fenicsx.shared():
        if workers == Workers():
            _warm_up(scene, store)
        wholes = carry_out([Trial(scene, *entry) for entry in _choices(scene)], store, workers)
        reference = wholes[0]
        trials = {one.trial.name: _omissions(one) for one in wholes if _is_there(one)}
        made = iter(carry_out([trial for _, trial in _listed(trials)], store, workers))
        without = {name: [(part, next(made)) for part, _ in entries] for name, entries in trials.items()}
        bench = shared_bench(scene, store)
        context = None if not _is_there(reference) else _context(bench, _run(reference))
        bars, unknown = _bars(bench, reference)
    ablations = tuple(_ablation(one, without.get(one.trial.name, []), context) for one in wholes)
    together = "one after the other" if workers == Workers() else f"{workers.count} at once"
    machine = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, runs {together}"
    return CaseOmissions(
        scene.name,
        scene.title,
        ablations,
        {name: unit for name, unit in metrics.units().items() if name in MEASURES},
        bars,
        unknown,
        {"fem_reference": __version__, "machine": machine, **versions()},
    )


def is_material(effect: Effect) -> bool:
    """Whether an effect is the material itself, which cannot be left out: an isotropic energy that is stored and always acts."""
    return isinstance(effect, Energy) and effect.stored and not effect.needs and not isinstance(effect, Ramped)


def name_of(effect: Effect) -> str:
    """What scene files call an effect, and where it acts if it does so on a part of the surface only."""
    name = type(effect).__module__.rpartition(".")[2]
    return f"{name} on {effect.on}" if isinstance(effect, Load) else name


def features(choice: SolverChoice, place: str) -> tuple[str, ...]:
    """The optional features that a choice of a solver has: keys whose default is None, but those that trade accuracy for time or
    change the time alone.
    """
    record = solvers.find(choice.solver, place).settings
    optional = {key for key, entry in record.model_fields.items() if entry.default is None}
    optional -= {*solvers.trades(record), *MACHINE_ONLY}
    return tuple(key for key, value in choice.settings.items() if value is not None and key in optional)


def parts(scene: MuscleCase, choice: SolverChoice, place: str) -> tuple[Part, ...]:
    """What can be left out of a choice of a solver: each effect of the scene but its material where the solver simulates them,
    else each feature of its own; and all of them, where there are several. Something elastic is left in any case.
    """
    if not solvers.takes_effects(choice.solver):
        found = features(choice, place)
        return *(Part({}, (key,)) for key in found), *([Part({}, found)] if len(found) > 1 else [])
    named = {name_of(effect): effect for effect in scene.effects if not is_material(effect)}
    every = [Part({name: effect}) for name, effect in named.items()] + ([Part(named)] if len(named) > 1 else [])
    return tuple(part for part in every if any(isinstance(one, Energy) and one.stored for one in _left(scene, part)))


def without(whole: Trial, part: Part) -> Trial:
    """The trial with a part left out, by an element that suits what is left."""
    left, choice, instead = _left(whole.scene, part), whole.choice, dict[str, Any]()
    scene = whole.scene.model_copy(update={"effect": left}) if part.effects else whole.scene
    element = getattr(solvers.settings(choice, whole.name), "element", None) if part.effects else None
    if element is not None and (other := fitting(element, left)) != element:
        instead["element"] = other
    kept = {key: value for key, value in dict(choice).items() if key not in part.features}
    choice = type(choice).model_validate(kept | instead)
    return Trial(scene, choice, whole.name, "without", " and ".join(part.names), instead)


def _left(scene: MuscleCase, part: Part) -> tuple[Effect, ...]:
    return tuple(effect for effect in scene.effects if effect not in part.effects.values())


def fitting(element: str, effects: Sequence[Effect]) -> str:
    """The element with the cells and the displacement of ``element`` that has a pressure if and only if an effect brings it."""
    kind, degree, pressure = ELEMENTS[element]
    brings = any("pressure" in effect.unknowns for effect in effects)
    if (pressure is not None) == brings:
        return element
    others = ((name, one) for name, one in ELEMENTS.items() if one[:2] == (kind, degree))
    return next((name for name, one in others if (one[2] is not None) == brings))


def _choices(scene: MuscleCase) -> list[tuple[SolverChoice, str]]:
    """The reference, and the candidates of which something can be left out."""
    found = [
        (candidate, candidate.name)
        for candidate in scene.candidate
        if solvers.find(candidate.solver, candidate.name).moves != "nothing" and parts(scene, candidate, candidate.name)
    ]
    return [(scene.reference, "reference"), *found]


def _warm_up(scene: MuscleCase, store: Path) -> None:
    """Solve the first frames with each candidate, and keep nothing: what is then measured in this process is compiled, and its
    processor time is that of solving.
    """
    bench = shared_bench(scene, store)
    for choice, name in _choices(scene)[1:]:
        offer = solvers.find(choice.solver, name)
        if not solvers.takes_effects(choice.solver):
            with suppress(InputError, MissingSoftware):  # of which its run says more
                settings = bench.settings(choice, name)
                offer.require(settings)
                built: Any = bench.given(offer, settings)
                offer.solve(replace(built, frames=built.frames[:2]), settings, lambda _: None)


def _is_there(one: Made) -> bool:
    return one.run is not None and one.run.outcome.status == "converged"


def _run(one: Made) -> Run:
    assert one.run is not None  # the caller asked
    return one.run


def _omissions(one: Made) -> list[tuple[Part, Trial]]:
    """Each part of a trial that can be left out, with the trial without it, which has a time limit."""
    trial, found = one.trial, list[tuple[Part, Trial]]()
    for part in parts(trial.scene, trial.choice, trial.name):
        other = without(trial, part)
        found.append((part, replace(other, choice=other.choice.model_copy(update=_limit(one)))))
    return found


def _limit(one: Made) -> dict[str, str]:
    """The setting by which a run with something left out gives up, where its solver can."""
    settings = solvers.settings(one.trial.choice, one.trial.name)
    if "time_limit" not in type(settings).model_fields:
        return {}
    seconds = LIMIT * _run(one).outcome.cost.get("seconds", 0.0) + COMPILING
    return {"time_limit": f"{min(seconds, getattr(settings, 'time_limit', None) or math.inf):.6g} s"}


def _listed(trials: Mapping[str, list[tuple[Part, Trial]]]) -> list[tuple[Part, Trial]]:
    return [entry for entries in trials.values() for entry in entries]


def _context(bench: Bench[MuscleCase], truth: Run) -> MeasurementContext | None:
    if truth.fibres is None:
        return None
    return MeasurementContext.of(truth, truth.fibres, bench.setup().bones, bench.setup().exempt)


def _bars(bench: Bench[MuscleCase], reference: Made) -> tuple[dict[str, float], str]:
    """The error bars of the reference, the greatest over the frames; and why there are none."""
    if not _is_there(reference):
        return {}, "the reference did not reach all frames"
    truth = _run(reference)
    try:
        found = known(refinement.stored(truth) or refinement.obtain(bench, truth, model=False))
    except InputError as error:
        log.info("no error bars: %s", error)
        return {}, str(error)
    found = {name: found[name] for name in MEASURES if name in found}
    return found, "" if found else "the reference has none"


def _ablation(one: Made, omitted: Sequence[tuple[Part, Made]], context: MeasurementContext | None) -> Ablation:
    trial = one.trial
    takes_effects = solvers.takes_effects(trial.choice.solver)
    there = tuple(map(name_of, trial.scene.effects)) if takes_effects else features(trial.choice, trial.name)
    found = []
    for part, other in omitted:
        changes = {} if context is None else _changes(other, _run(one), context)
        predicted = _predicted(trial.scene, part) if takes_effects else {}
        found.append(replace(_omission(other, part.names), changes=changes, predicted=predicted))
    named = {name for part in parts(trial.scene, trial.choice, trial.name) for name in part.names}
    kept = tuple(name for name in there if name not in named)
    return Ablation(trial.name, trial.choice.solver, kept, _omission(one, ()), tuple(found))


def _predicted(scene: MuscleCase, part: Part) -> dict[str, float]:
    """What the indicator of an effect says of how far the surface moves by it, where that alone is left out."""
    if len(part.effects) != 1:
        return {}
    (left_out,) = part.effects.values()
    (found,) = (one.indicator for one in of_case.explained(scene) if one.effect is left_out)
    return {"surface_deviation.rms": found.estimate} if found else {}


def _omission(one: Made, left_out: tuple[str, ...]) -> Omission:
    """How a run ended and what it cost."""
    if one.run is None:
        return Omission(left_out, "refused", one.failure, instead=one.trial.changed)
    outcome = one.run.outcome
    return Omission(left_out, outcome.status, outcome.message, costs=dict(outcome.cost), instead=one.trial.changed)


def _changes(one: Made, whole: Run, context: MeasurementContext) -> dict[str, float]:
    """By ``metric.statistic``, the greatest magnitude over the frames of the change from the ``whole``; nothing of a run that did
    not reach every frame, or where one is no number.
    """
    if not _is_there(one):
        return {}
    names = dict.fromkeys(name.split(".")[0] for name in MEASURES)
    found = {
        f"{entry.metric}.{entry.statistic}": float(np.abs(entry.values).max())
        for entry in measure(complete(_run(one), whole.numbers), whole, context, names)
    }
    wanted = {name: found[name] for name in MEASURES if name in found}
    return wanted if all(map(math.isfinite, wanted.values())) else {}
