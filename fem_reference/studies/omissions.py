"""Changes of results when each effect of a scene or each optional feature of a solver is left out in turn, and when all are."""

import logging
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from fem_reference import effects, metrics, solvers
from fem_reference.assessment.omissions import MEASURES, Ablation, CaseOmissions, Omission
from fem_reference.effects import Effect, Energy, Load, Ramped, in_situ
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.metrics import MeasurementContext, context_of
from fem_reference.problems import of_case
from fem_reference.problems.body import ELEMENTS
from fem_reference.runs.key import made_with
from fem_reference.runs.store import Run
from fem_reference.scenes.case import MACHINE_ONLY, SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies import refinement
from fem_reference.studies.campaign import Made, Workers, carry_out, shared_bench
from fem_reference.studies.cost import greatest, known
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import Trial

log = logging.getLogger(__name__)

# A run with a part left out may take ``LIMIT`` times as long as the complete run, plus a time [s] to compile a new form.
LIMIT, COMPILING = 2.0, 60.0


@dataclass(frozen=True)
class LeftOut:
    """A part of a trial to leave out: ``effects``, ``features`` of the solver and, with ``support``, support by contact at rest."""

    effects: dict[str, Effect]
    features: tuple[str, ...] = ()
    support: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """The names of everything left out."""
        return *self.effects, *self.features, *(["support of contact"] if self.support else [])


def study(case: MuscleCase, store: Path, workers: Workers) -> CaseOmissions:
    """Run the reference and the candidates of a case, complete and with each part left out. Runs in ``store`` are reused."""
    with fenicsx.shared():
        if workers == Workers():
            _warm_up(case, store)
        wholes = carry_out(_wholes(case), store, workers)
        parted = [(whole, part) for whole in wholes if whole.reached for part in parts(whole.trial)]
        others = carry_out([_limited(without(whole.trial, part), whole) for whole, part in parted], store, workers)
        bench, truth = shared_bench(case, store), wholes[0].reached
        context = None if truth is None or truth.fibres is None else context_of(bench.setup(), truth)
        bars, unknown = _bars(bench, truth)
    ablations = []
    for whole in wholes:
        made = [(part, other) for (own, part), other in zip(parted, others, strict=True) if own is whole]
        ablations.append(_ablation(whole, made, context))
    units = {name: unit for name, unit in metrics.units().items() if name in MEASURES}
    return CaseOmissions(case.name, case.title, tuple(ablations), units, bars, unknown, made_with(str(workers)))


def is_material(effect: Effect) -> bool:
    """True for the material itself, which cannot be left out: an isotropic energy that is stored and always acts."""
    return isinstance(effect, Energy) and effect.stored and not effect.needs and not isinstance(effect, Ramped)


def name_of(effect: Effect) -> str:
    """The name of an effect in scene files. If the effect acts on a part of the surface or in a region, this is added."""
    name = effects.name_of(effect)
    name += f" on {effect.on}" if isinstance(effect, Load) else ""
    return name + (f" in {region}" if (region := effects.region_of(effect)) else "")


def features(choice: SolverChoice, place: str) -> tuple[str, ...]:
    """The optional features of a solver that a ``choice`` uses: its settings whose default is None, except settings that trade
    accuracy for time or affect only the time.
    """
    record = solvers.find(choice.solver, place).settings
    optional = {key for key, entry in record.model_fields.items() if entry.default is None}
    optional -= {*solvers.trades(record), *MACHINE_ONLY}
    return tuple(key for key, value in choice.settings.items() if value is not None and key in optional)


def parts(whole: Trial) -> tuple[LeftOut, ...]:
    """The parts that can be left out of a trial, each by itself, and all of them together.

    If the solver simulates effects, the parts are the effects of the scene except its material; otherwise they are the features of
    the solver. An elastic effect always remains. Tension at rest is left out together with everything that it balances: effects
    that act at the first frame, and the support by bones.
    """
    if not solvers.takes_effects(whole.choice.solver):
        found = features(whole.choice, whole.name)
        return *(LeftOut({}, (key,)) for key in found), *([LeftOut({}, found)] if len(found) > 1 else [])
    scene = whole.scene
    named = {name_of(effect): effect for effect in scene.effects if not is_material(effect)}
    every = [_with_rest(scene, {name: effect}, named) for name, effect in named.items()]
    every += [all_of_it] if (all_of_it := _with_rest(scene, named, named)) not in every and named else []
    return tuple(part for part in every if any(isinstance(one, Energy) and one.stored for one in _kept(scene, part)))


def _with_rest(case: MuscleCase, some: dict[str, Effect], named: dict[str, Effect]) -> LeftOut:
    """The part with ``some`` of the ``named`` effects and, if these include tension at rest, with everything that it balances."""
    if in_situ.among(some.values()) is None:
        return LeftOut(some)
    first, contact = case.frames.first, among(case.effects)
    acting = {name: one for name, one in named.items() if isinstance(one, Ramped) and one.amount(first) != 0}
    return LeftOut(some | acting, support=contact is not None and contact.support is not None)


def without(whole: Trial, part: LeftOut) -> Trial:
    """The trial with a part left out, and with an element that suits the remaining effects."""
    kept, choice, instead = _kept(whole.scene, part), whole.choice, dict[str, Any]()
    scene = whole.scene.model_copy(update={"effect": kept}) if part.effects else whole.scene
    element = getattr(solvers.settings(choice, whole.name), "element", None) if part.effects else None
    if element is not None and (other := fitting(element, kept)) != element:
        instead["element"] = other
    given = {key: value for key, value in dict(choice).items() if key not in part.features}
    choice = type(choice).model_validate(given | instead)
    return Trial(scene, choice, whole.name, "without", " and ".join(part.names), instead)


def _kept(case: MuscleCase, part: LeftOut) -> tuple[Effect, ...]:
    """The effects that remain without a part."""
    kept = tuple(effect for effect in case.effects if effect not in part.effects.values())
    contact = among(kept) if part.support else None
    return tuple(one.model_copy(update={"support": None}) if one is contact else one for one in kept)


def fitting(element: str, effects: Sequence[Effect]) -> str:
    """The element with the cells and the displacement degree of ``element``, with a pressure if and only if an effect needs it."""
    kind, degree, pressure = ELEMENTS[element]
    brings = any("pressure" in effect.unknowns for effect in effects)
    if (pressure is not None) == brings:
        return element
    others = ((name, one) for name, one in ELEMENTS.items() if one[:2] == (kind, degree))
    return next((name for name, one in others if (one[2] is not None) == brings))


def _wholes(case: MuscleCase) -> list[Trial]:
    """The complete trials: the reference, and the candidates that have a part to leave out."""
    trials = [Trial(case, candidate, candidate.name) for candidate in case.candidate]
    moving = (one for one in trials if solvers.find(one.choice.solver, one.name).moves != "nothing")
    return [Trial(case, case.reference, "reference"), *(one for one in moving if parts(one))]


def _warm_up(case: MuscleCase, store: Path) -> None:
    """Solve the first frames with each candidate and discard the results, so that compilation does not count in measured times."""
    bench = shared_bench(case, store)
    for trial in _wholes(case)[1:]:
        if solvers.takes_effects(trial.choice.solver):
            continue
        offer = solvers.find(trial.choice.solver, trial.name)
        with suppress(InputError, MissingSoftware):  # the measured run reports these
            settings = bench.settings(trial.choice, trial.name)
            offer.require(settings)
            built: Any = bench.given(offer, settings)
            offer.solve(replace(built, frames=built.frames[:2]), settings, lambda _: None)


def _limited(trial: Trial, whole: Made) -> Trial:
    """The ``trial`` with a time limit that depends on the cost of the ``whole`` run, if the solver has such a setting."""
    settings = solvers.settings(whole.trial.choice, whole.trial.name)
    if whole.run is None or "time_limit" not in type(settings).model_fields:
        return trial
    seconds = LIMIT * whole.run.outcome.cost.get("seconds", 0.0) + COMPILING
    limit = min(seconds, getattr(settings, "time_limit", None) or math.inf)
    return replace(trial, choice=trial.choice.model_copy(update={"time_limit": f"{limit:.6g} s"}))


def _bars(bench: Bench[MuscleCase], truth: Run | None) -> tuple[dict[str, float], str]:
    """The maximum error bar of the reference over frames, by statistic; and the reason if there are no error bars."""
    if truth is None:
        return {}, "the reference did not reach all frames"
    try:
        found = known(refinement.bars(bench, truth, model=False))
    except InputError as error:
        log.info("no error bars: %s", error)
        return {}, str(error)
    found = {name: found[name] for name in MEASURES if name in found}
    return found, "" if found else "the reference has none"


def _ablation(one: Made, others: Sequence[tuple[LeftOut, Made]], context: MeasurementContext | None) -> Ablation:
    trial = one.trial
    takes_effects = solvers.takes_effects(trial.choice.solver)
    there = tuple(map(name_of, trial.scene.effects)) if takes_effects else features(trial.choice, trial.name)
    found = []
    for part, other in others:
        changed = {} if context is None or one.run is None else changes(other, one.run, context)
        predicted = _predicted(trial.scene, part) if takes_effects else {}
        found.append(replace(_omission(other, part.names), changes=changed, predicted=predicted))
    named = {name for part in parts(trial) for name in part.names}
    kept = tuple(name for name in there if name not in named)
    return Ablation(trial.name, trial.choice.solver, kept, _omission(one, ()), tuple(found))


def _omission(one: Made, left_out: tuple[str, ...]) -> Omission:
    """The outcome of a run and its cost."""
    costs = dict(one.run.outcome.cost) if one.run else {}
    return Omission(left_out, *one.ended, costs=costs, instead=one.trial.changed)


def _predicted(case: MuscleCase, part: LeftOut) -> dict[str, float]:
    """The displacement of the surface due to an omitted effect, estimated by its indicator; empty unless exactly one is omitted."""
    if len(part.effects) != 1:
        return {}
    (left_out,) = part.effects.values()
    (found,) = (one.indicator for one in of_case.explained(case) if one.effect is left_out)
    return {"surface_deviation.rms": found.estimate} if found else {}


def changes(one: Made, whole: Run, context: MeasurementContext) -> dict[str, float]:
    """The maximum difference over frames from the run ``whole``, by ``metric.statistic``. Empty if the run of ``one`` is unfinished
    or a difference is not finite.
    """
    if one.reached is None:
        return {}
    found = greatest(one.reached, whole, context, {name.split(".")[0] for name in MEASURES})
    wanted = {name: found[name] for name in MEASURES if name in found}
    return wanted if all(map(math.isfinite, wanted.values())) else {}
