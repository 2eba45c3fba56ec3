"""Variations of a case: single changes, and the trials of a study, which vary one setting at a time."""

import hashlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.effects import Effect, make
from fem_reference.effects.contact import Contact, among
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.foundations.records import Record
from fem_reference.geometry.coarsening import resampled
from fem_reference.geometry.distance import distances
from fem_reference.geometry.extension import Extension
from fem_reference.io import files
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Run
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import DrivenCase, MuscleCase, VertexList
from fem_reference.scenes.muscles import with_muscles

TETRAHEDRA, TRIANGLES = "tetrahedra", "triangles"
# Sizes of tetrahedra relative to that of the case; each is combined with every number of refinements up to that of the case.
_SIZES = (2.0, 1.6, 1.25, 1.0)
# Settings of the reference are varied on the mesh before its last refinement or, if it is not refined, on tetrahedra larger by
# this factor.
_COARSER = 1.6
_REFINED = {0: "not refined", 1: "refined once", 2: "refined twice"}
_STIFFNESSES, _DISTANCES = (0.1, 0.3, 3.0), (10.0, 3.0, 0.3)
type Vary[C] = Callable[[C], C]


def on_tetrahedra[C: DrivenCase](case: C, **changes: float) -> C:
    """The case with other values of ``tet_size`` [mm] or ``refinements`` for each of its muscles."""
    return with_muscles(case, lambda _: changes)


def on_larger[C: DrivenCase](case: C, ratio: float) -> C:
    """The case with tetrahedra ``ratio`` times as large in each of its muscles."""
    return with_muscles(case, lambda one: {"tet_size": ratio * one.tet_size})


def with_contact[C: DrivenCase](case: C, kind: type[Effect] = Contact, **changes: float) -> C:
    """The case with other parameters of its contact. The ``kind`` of effect is contact with bones, by default, or contact of
    muscles with themselves or each other.
    """
    effects = (one.model_copy(update=changes) if isinstance(one, kind) else one for one in case.effect)
    return case.model_copy(update={"effect": tuple(effects)})


def by_springs(case: MuscleCase) -> bool:
    """True if any attachment has springs."""
    return any(entry.stiffness is not None for entry in case.attachment)


def with_distances[C: DrivenCase](case: C, factor: float, *keys: str) -> C:
    """The case with ``keys`` of its bones, which control the accuracy of distances, multiplied by ``factor``. Only bones with a
    surface are changed, as distances to analytic shapes are exact.
    """
    bones = (
        bone.model_copy(update={key: factor * getattr(bone, key) for key in keys}) if bone.surface else bone
        for bone in case.bone
    )
    return case.model_copy(update={"bone": tuple(bones)})


def with_half_steps[C: DrivenCase](case: C, settings: Record) -> Vary[C]:
    """A function that changes a case to load steps of at most half the length. As a step ends at each frame, ``frames.every`` also
    limits the length of the steps of ``case``. ``settings``: those of its reference.
    """
    own = settings.model_dump()
    largest = min(case.frames.every, own["largest_step"] or math.inf) / 2
    halved = {"first_step": own["first_step"] / 2, "largest_step": largest}
    return lambda one: one.model_copy(update={"reference": one.reference.model_copy(update=halved)})


def without_states(choice: SolverChoice) -> SolverChoice:
    """The ``choice`` for a run that is only measured, in which the reference does not store its states."""
    return choice.model_copy(update={"store_state": False}) if choice.solver == "fenicsx" else choice


def resample(case: MuscleCase, setup: Setup, power: int, folder: Path) -> MuscleCase:
    """The case on a surface with ``4**power`` times as many triangles.

    The files of the new surface are written into a folder in ``folder`` that is named after their contents. A vertex is attached
    if the nearest vertex of the original surface is attached.
    """
    surface = resampled(setup.surface, power)
    named = hashlib.sha256(surface.points.tobytes() + surface.triangles.tobytes()).hexdigest()[:16]
    place = (folder / named).absolute()
    place.mkdir(parents=True, exist_ok=True)
    files.write_surface(place / "surface.vtp", surface, surface.points)
    nearest = nearest_vertices(setup.surface, surface.points)
    attachments = []
    for entry, attached in zip(case.attachment, setup.attached, strict=True):
        path = place / f"{entry.name}.csv"
        vertices = np.flatnonzero(np.isin(nearest, attached.vertices))
        files.write_text(path, "".join(f"{vertex}\n" for vertex in vertices))
        listed = {"vertices": VertexList(file=str(path)), "within": None, "outline": None}
        attachments.append(entry.model_copy(update=listed))
    muscle = case.muscle.model_copy(update={"surface": str(place / "surface.vtp"), "unit": 1.0})
    # No scene file names these surfaces, so they may be in any folder.
    return case.model_copy(update={"muscle": muscle, "attachment": tuple(attachments), "from_file": False})


def nearest_vertices(surface: Surface, points: Floats) -> Floats:
    """The vertex (n,) near each of ``points`` (n, 3): of the nearest triangle, the corner with the largest barycentric weight."""
    found = distances(points, surface)
    corners = surface.triangles[found.triangle]
    return np.asarray(np.take_along_axis(corners, found.barycentric.argmax(axis=1)[:, None], axis=1)[:, 0])


def carried(run: Run, surface: Surface) -> Run:
    """A ``run`` on another surface, transferred to the vertices of ``surface`` by the extension that also moves fibres."""
    if len(run.surface.points) == len(surface.points) and np.allclose(run.surface.points, surface.points):
        return run
    extension = Extension.to(surface.points, run.surface)
    positions = np.stack([extension.apply(moved) for moved in run.positions])
    return replace(run, surface=surface, positions=positions)


@dataclass(frozen=True)
class Trial:
    """A run that is to be made: a ``scene``, a ``choice`` of solver and a ``name``. One key (``knob``) may have been varied to a
    ``value``; ``changed`` holds the changed keys of the scene, as scene files write them.
    """

    scene: MuscleCase
    choice: SolverChoice
    name: str
    knob: str = ""
    value: str = ""
    changed: dict[str, Any] = field(default_factory=dict)

    @property
    def label(self) -> str:
        """The name of the trial in progress messages."""
        return f"{self.name}, {self.knob} = {self.value}" if self.knob else f"{self.name}, as it is"

    def varied(self, knob: str, value: str, **changes: Any) -> "Trial":
        """A copy of the trial with ``changes`` to its fields, and with a new ``knob`` and ``value``. A previous knob is appended to
        the value in brackets.
        """
        beside = f" ({self.knob} = {self.value})" if self.knob else ""
        return replace(self, knob=knob, value=value + beside, **changes)


def reference_trials(case: MuscleCase) -> Iterator[Trial]:
    """Trials of the reference of a case: unchanged, on other tetrahedra, and, on a coarse mesh, with other settings and contact."""
    whole = Trial(case, case.reference, "reference")
    yield whole
    yield from _sizes(whole)
    size, refinements = case.muscle.tet_size, case.muscle.refinements
    base = _on(whole, size, refinements - 1) if refinements else _on(whole, _COARSER * size, 0)
    yield from _settings(base)
    yield from _contact(base)


def candidate_trials(case: MuscleCase, surfaces: Mapping[str, MuscleCase]) -> Iterator[Trial]:
    """Trials of the candidates of a case and of the candidates that Table 5.1 has for every scene: with their own settings, with
    other values of each setting that trades accuracy for time, and on other meshes. ``surfaces``: the case on other triangles, by
    name.
    """
    known = list[dict[str, Any]]()
    for candidate in (*case.candidate, *solvers.in_table()):
        offer = solvers.find(candidate.solver, candidate.name)
        settings = {"solver": candidate.solver} | candidate.settings
        if offer.moves == "nothing" or settings in known:
            continue
        known.append(settings)
        moves = offer.moved(solvers.settings(candidate, candidate.name))
        whole = Trial(case, candidate, candidate.name)
        yield whole
        yield from _settings(whole)
        if moves == "tetrahedra":
            yield from _sizes(whole)
        elif moves == "surface":
            for text, other in surfaces.items():
                yield Trial(other, candidate, candidate.name, TRIANGLES, text, {TRIANGLES: text})


def _sizes(whole: Trial) -> Iterator[Trial]:
    """Trials on other tetrahedra."""
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
    """A trial for each listed value of each setting, except the present value and values that other settings exclude."""
    own = solvers.settings(base.choice, base.name)
    for key, values in solvers.trades(type(own)).items():
        for value in values:
            if value not in (getattr(own, key), base.choice.settings.get(key)):
                choice = base.choice.model_copy(update={key: value})
                try:
                    solvers.settings(choice, base.name)
                except InputError:
                    continue
                text = f"{value:.3g}" if isinstance(value, float) else str(value)
                yield _by_element(base, choice, text) if key == "element" else base.varied(key, text, choice=choice)


def _by_element(base: Trial, choice: SolverChoice, text: str) -> Trial:
    """The trial with another element. If the element does not suit the effects, the pressure field of the incompressible effect is
    replaced by a penalty, or the reverse.
    """
    plain, effects = base.varied("element", text, choice=choice), list(base.scene.effects)
    found = [one for one in effects if isinstance(one, Incompressible | IncompressiblePenalty)]
    if len(found) != 1 or _suits(choice, base.scene.effects):
        return plain
    exact = isinstance(found[0], Incompressible)
    name, how = ("incompressible_penalty", "a penalty") if exact else ("incompressible", "a pressure")
    i = effects.index(found[0])
    effects[i] = make(name, bulk=found[0].bulk)
    if not _suits(choice, tuple(effects)):
        return plain
    scene = base.scene.model_copy(update={"effect": tuple(effects)})
    changed = base.changed | {f"effect[{i}].name": name}
    return base.varied("element", f"{text}, volume by {how}", choice=choice, scene=scene, changed=changed)


def _suits(choice: SolverChoice, effects: tuple[Effect, ...]) -> bool:
    try:
        solvers.check(choice.solver, solvers.settings(choice, choice.solver), effects, choice.solver)
    except InputError:
        return False
    return True


def _contact(base: Trial) -> Iterator[Trial]:
    """Trials with stiffer and softer contact, and with more and less accurate distances to bones; none without contact."""
    scene = base.scene
    contact = among(scene.effects)
    if contact is None:
        return
    for factor in _STIFFNESSES:
        stiffness, key = factor * contact.stiffness, f"effect[{scene.effects.index(contact)}].stiffness"
        stiffer, text = with_contact(scene, stiffness=stiffness), f"{stiffness:.3g} MPa/mm"
        yield base.varied("contact stiffness", text, scene=stiffer, changed=base.changed | {key: text})
    if known := [bone.distance_error for bone in scene.bone if bone.surface]:
        for factor in _DISTANCES:
            other, text = with_distances(scene, factor, "distance_error"), f"{factor * max(known):.3g} mm"
            changed = base.changed | {"bone[*].distance_error": text}
            yield base.varied("error of distances to bones", text, scene=other, changed=changed)
