"""Ladders of a study of accuracy against time: the reference and the candidates of a case, one setting varied at a time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from fem_reference import solvers
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.effects import Effect, make
from fem_reference.effects.contact import among
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.foundations.errors import InputError
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.scene_changes import on_tetrahedra, with_contact, with_distances

TETRAHEDRA, TRIANGLES = "tetrahedra", "triangles"
# Sizes of tetrahedra, in those of the case, at each number of refinements up to its own.
_SIZES = (2.0, 1.6, 1.25, 1.0)
# The reference's settings are varied on the mesh before the last refinement, or without one on tetrahedra so much larger.
_COARSER = 1.6
_REFINED = {0: "not refined", 1: "refined once", 2: "refined twice"}
_STIFFNESSES, _DISTANCES = (0.1, 0.3, 3.0), (10.0, 3.0, 0.3)


@dataclass(frozen=True)
class Trial:
    """A run to be made: of a ``scene`` by ``choice``, called ``name``; what was varied (``knob``) to what (``value``), and the
    scene's keys that were ``changed``, as scene files write them.
    """

    scene: MuscleCase
    choice: SolverChoice
    name: str
    knob: str = ""
    value: str = ""
    changed: dict[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """Its name in lines of progress."""
        return f"{self.name}, {self.knob} = {self.value}" if self.knob else f"{self.name}, as it is"


def reference_trials(case: MuscleCase) -> Iterator[Trial]:
    """The reference of a case on other tetrahedra; and on coarse ones with each setting varied that its solver says trades
    accuracy for time, and with contact stiffer and softer.
    """
    whole = Trial(case, case.reference, "reference")
    yield whole
    yield from _sizes(whole)
    size, refinements = case.muscle.tet_size, case.muscle.refinements
    base = _on(whole, size, refinements - 1) if refinements else _on(whole, _COARSER * size, 0)
    yield from _settings(base)
    yield from _contact(base)


def candidate_trials(case: MuscleCase, surfaces: Mapping[str, MuscleCase]) -> Iterator[Trial]:
    """The candidates of a case, and those that Table 5.1 has on every scene: as they are, with each setting varied that
    their solver says trades accuracy for time, and on other meshes; ``surfaces``: by what they are called, the case on
    other triangles.
    """
    known = list[dict[str, Any]]()
    for candidate in (*case.candidate, *(one for row in solver_kinds() for one in row.candidate)):
        offer = solvers.find(candidate.solver, candidate.name)
        settings = {"solver": candidate.solver} | candidate.settings
        if offer.moves == "nothing" or settings in known:
            continue
        known.append(settings)
        whole = Trial(case, candidate, candidate.name)
        yield whole
        yield from _settings(whole)
        if offer.moves == "tetrahedra":
            yield from _sizes(whole)
        elif offer.moves == "surface":
            for text, other in surfaces.items():
                yield Trial(other, candidate, candidate.name, TRIANGLES, text, {TRIANGLES: text})


def _sizes(whole: Trial) -> Iterator[Trial]:
    """A trial on other tetrahedra."""
    own = whole.scene.muscle
    for count in range(own.refinements + 1):
        for factor in _SIZES:
            if (count, factor) != (own.refinements, 1.0):
                yield _on(whole, factor * own.tet_size, count)


def _on(whole: Trial, size: float, refinements: int) -> Trial:
    scene = on_tetrahedra(whole.scene, tet_size=size, refinements=refinements)
    changed = {"muscle.tet_size": f"{size:.6g} mm", "muscle.refinements": refinements}
    value = f"{size / 2**refinements:.3g} mm"
    if whole.scene.muscle.refinements:
        value += f", {_REFINED.get(refinements, f'refined {refinements} times')}"
    return Trial(scene, whole.choice, whole.name, TETRAHEDRA, value, changed)


def _settings(base: Trial) -> Iterator[Trial]:
    """A trial with each setting of its solver at each step of its ladder but the one that it has."""
    own = solvers.settings(base.choice, base.name)
    for key, values in solvers.trades(type(own)).items():
        for value in values:
            if value not in (getattr(own, key), base.choice.settings.get(key)):
                choice = base.choice.model_copy(update={key: value})
                text = f"{value:.3g}" if isinstance(value, float) else str(value)
                varied = replace(base, choice=choice, knob=key, value=text + _beside(base))
                yield _with_other_volume(varied, text, base) if key == "element" else varied


def _with_other_volume(varied: Trial, text: str, base: Trial) -> Trial:
    """The trial as it is where its element suits the effects; else the same energy of the volume with a pressure, or without."""
    effects = list(varied.scene.effects)
    found = [one for one in effects if isinstance(one, Incompressible | IncompressiblePenalty)]
    if _suits(varied.choice, varied.scene.effects) or len(found) != 1:
        return varied
    name, how = "incompressible_penalty", "a penalty"
    if isinstance(found[0], IncompressiblePenalty):
        name, how = "incompressible", "a pressure"
    i = effects.index(found[0])
    effects[i] = make(name, bulk=found[0].bulk)
    if not _suits(varied.choice, tuple(effects)):
        return varied
    changed = varied.changed | {f"effect[{i}].name": name}
    scene = varied.scene.model_copy(update={"effect": tuple(effects)})
    return replace(varied, scene=scene, changed=changed, value=f"{text}, volume by {how}{_beside(base)}")


def _suits(choice: SolverChoice, effects: tuple[Effect, ...]) -> bool:
    try:
        solvers.check(choice.solver, solvers.settings(choice, choice.solver), effects, choice.solver)
    except InputError:
        return False
    return True


def _contact(base: Trial) -> Iterator[Trial]:
    """Contact stiffer and softer, the distances to bones known better and less well; nothing where there is no contact."""
    scene = base.scene
    contact = among(scene.effects)
    if contact is None:
        return
    for factor in _STIFFNESSES:
        stiffness, key = factor * contact.stiffness, f"effect[{scene.effects.index(contact)}].stiffness"
        stiffer = with_contact(scene, stiffness=stiffness)
        yield _changed(base, stiffer, "contact stiffness", f"{stiffness:.3g} MPa/mm", key)
    if known := [bone.distance_error for bone in scene.bone if bone.surface]:
        for factor in _DISTANCES:
            other, text = with_distances(scene, factor, "distance_error"), f"{factor * max(known):.3g} mm"
            yield _changed(base, other, "error of distances to bones", text, "bone[*].distance_error")


def _changed(base: Trial, case: MuscleCase, knob: str, value: str, key: str) -> Trial:
    """The trial ``base`` with another value in its scene."""
    return replace(base, scene=case, knob=knob, value=value + _beside(base), changed=base.changed | {key: value})


def _beside(base: Trial) -> str:
    """The difference of a trial from its case, before anything else is varied."""
    return f" ({base.knob} = {base.value})" if base.knob else ""
