"""Ladders of a study of accuracy against time: the reference and the candidates of a case, one setting varied at a time."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from fem_reference import solvers
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.effects.contact import among
from fem_reference.problems.body import ELEMENTS
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase

# Sizes of tetrahedra, in those of the case, at each number of refinements up to its own.
_SIZES = (2.0, 1.6, 1.25, 1.0)
# The reference's settings are varied on the mesh before the last refinement, or without one on tetrahedra so much larger.
_COARSER = 1.6
_RESIDUALS = (1e-2, 1e-4, 1e-6)
_DEGREES = (2, 3, 6)
_STIFFNESSES, _DISTANCES, _STEPS = (0.1, 0.3, 3.0), (10.0, 3.0, 0.3), (2.0, 0.5, 0.25)
_RECORDED = "recorded"


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
        """What progress calls it."""
        return f"{self.choice.solver}, {self.knob} = {self.value}" if self.knob else f"{self.name}, as it is"


def reference_trials(scene: MuscleCase) -> Iterator[Trial]:
    """The reference of a scene on other tetrahedra, and on coarse ones with each other cause of error larger and smaller."""
    yield Trial(scene, scene.reference, "reference")
    size, refinements = scene.muscle.tet_size, scene.muscle.refinements
    for count in range(refinements + 1):
        for factor in _SIZES:
            if (count, factor) != (refinements, 1.0):
                yield _on(
                    scene,
                    factor * size,
                    count,
                    "tetrahedra",
                    f"{factor * size / 2**count:.3g} mm, refined {count} times",
                )
    base = _on(scene, size, refinements - 1) if refinements else _on(scene, _COARSER * size, 0)
    element = str(scene.reference.settings.get("element", "P2/P1"))
    for other in (name for name, (kind, _, _) in ELEMENTS.items() if kind == "tetrahedron" and name != element):
        yield _with(base, "element", other)
    for residual in _RESIDUALS:
        yield _with(base, "residual", residual)
    for degree in _DEGREES:
        yield _with(base, "quadrature_degree", degree)
    for factor in _STEPS:
        yield _with(base, "largest_step", factor * scene.frames.every)
    yield from _contact_trials(base)


def _contact_trials(base: Trial) -> Iterator[Trial]:
    """Contact stiffer and softer, the distances to bones known better and less well; nothing where there is no contact."""
    contact = among(base.scene.effects)
    if contact is None:
        return
    i = base.scene.effects.index(contact)
    for factor in _STIFFNESSES:
        stiffness = factor * contact.stiffness
        effects = list(base.scene.effects)
        effects[i] = contact.model_copy(update={"stiffness": stiffness})
        yield _changed(
            base, {"effect": tuple(effects)}, "contact stiffness", f"{stiffness:.3g} MPa/mm", f"effect[{i}].stiffness"
        )
    if any(bone.surface for bone in base.scene.bone):
        for factor in _DISTANCES:
            bones = tuple(
                bone.model_copy(update={"distance_error": factor * bone.distance_error}) if bone.surface else bone
                for bone in base.scene.bone
            )
            error = factor * max(bone.distance_error for bone in base.scene.bone if bone.surface)
            yield _changed(
                base, {"bone": bones}, "error of distances to bones", f"{error:.3g} mm", "bone[*].distance_error"
            )


def _on(scene: MuscleCase, size: float, refinements: int, knob: str = "tetrahedra", value: str = "") -> Trial:
    muscle = scene.muscle.model_copy(update={"tet_size": size, "refinements": refinements})
    changed = {"muscle.tet_size": f"{size:.6g} mm", "muscle.refinements": refinements}
    return Trial(scene.model_copy(update={"muscle": muscle}), scene.reference, "reference", knob, value, changed)


def _with(base: Trial, key: str, value: Any) -> Trial:
    """The trial ``base`` with another setting of its solver."""
    choice = base.choice.model_copy(update={key: value})
    text = f"{value:.3g}" if isinstance(value, float) else str(value)
    return Trial(base.scene, choice, base.name, key, text, base.changed)


def _changed(base: Trial, update: Mapping[str, Any], knob: str, value: str, key: str) -> Trial:
    """The trial ``base`` with another value in its scene."""
    return Trial(
        base.scene.model_copy(update=dict(update)), base.choice, base.name, knob, value, base.changed | {key: value}
    )


def candidate_trials(scene: MuscleCase) -> Iterator[Trial]:
    """The candidates of a scene, and those that Table 5.1 has on every scene: as they are, and with each setting varied that their
    solver says trades accuracy for time.
    """
    known = list[dict[str, Any]]()
    for candidate in (*scene.candidate, *(one for row in solver_kinds() for one in row.candidate)):
        settings = {"solver": candidate.solver} | candidate.settings
        if candidate.solver == _RECORDED or settings in known:
            continue
        known.append(settings)
        yield Trial(scene, candidate, candidate.name)
        for key, values in solvers.trades(solvers.find(candidate.solver, candidate.name).settings).items():
            for value in values:
                choice = candidate.model_copy(update={key: value})
                yield Trial(scene, choice, candidate.name, key, str(value), {})
