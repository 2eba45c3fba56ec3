"""On ten scenes at random ``effects = "auto"`` leaves out what does not matter, and nothing that does."""

import importlib.util
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
import random_scenes

from fem_reference import solvers
from fem_reference.assessment import error_bars
from fem_reference.assessment.error_bars import SAFETY, Pair
from fem_reference.assessment.omissions import MEASURES, verdict
from fem_reference.effects import Effect
from fem_reference.effects.contact import Contact, among
from fem_reference.metrics import MeasurementContext, measure
from fem_reference.problems import of_case
from fem_reference.problems.estimates import Decision
from fem_reference.problems.muscle import Problem
from fem_reference.runs.store import Frame, Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies.cost import known

SEEDS = range(1, 11)
SIZES = (5.0, 10.0)  # of tetrahedra [mm], of which the latter are for error bars
# The mesh of a bar is not graded towards its ends: errors of order 1 are three times those of order 2 that differ by as much
# between these sizes.
UNGRADED = 3.0
# By how much estimates may be wrong where what they estimate matters.
FACTOR = 5.0


@pytest.fixture(scope="module")
def fem():
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    with fenicsx.shared():
        yield


def problem(scene: MuscleCase, size: float) -> Problem:
    """A scene with all effects that it lists, of tetrahedra of a ``size``."""
    muscle = scene.muscle.model_copy(update={"tet_size": size})
    scene = scene.model_copy(update={"choice": "listed", "muscle": muscle})
    return of_case.problem(scene, of_case.setup(scene))


def solved(scene: MuscleCase, built: Problem, left_out: Iterable[Effect] = ()) -> Run:
    """The run of a scene with some effects left out."""
    effects = tuple(one for one in built.effects if one not in tuple(left_out))
    built, frames = replace(built, effects=effects, skin=built.skin if among(effects) else None), list[Frame]()
    outcome = fenicsx.solve(built, solvers.settings(scene.reference, "reference"), frames.append)
    assert outcome.status == "converged", outcome.message
    stacks = [np.stack([getattr(frame, part) for frame in frames]) for part in ("surface", "fibres")]
    areas = {"contact_area": np.array([frame.scalars.get("contact_area", 0.0) for frame in frames])}
    numbers = tuple(frame.number for frame in frames)
    return Run("one", "fenicsx", outcome, numbers, built.surface, stacks[0], built.fibres, stacks[1], areas)


def changes(run: Run, whole: Run, context: MeasurementContext) -> dict[str, float]:
    names = dict.fromkeys(name.split(".")[0] for name in MEASURES)
    found = {
        f"{one.metric}.{one.statistic}": float(np.abs(one.values).max()) for one in measure(run, whole, context, names)
    }
    return {name: found[name] for name in MEASURES}


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.usefixtures("fem")
def test_what_is_left_out_does_not_matter_and_what_is_kept_does(seed: int, tmp_path) -> None:
    """Contact that presses nothing counts as left out: it is in no equation."""
    scene = random_scenes.scene(tmp_path / "scene", seed)
    found = [one for one in of_case.explained(scene) if one.indicator is not None]
    built = problem(scene, SIZES[0])
    whole = solved(scene, built)
    context = MeasurementContext.of(whole, whole.fibres, built.bones, built.exempt)
    pair = Pair(whole, solved(scene, problem(scene, SIZES[1])), SIZES, {}, safety=SAFETY * UNGRADED)
    bars = known(error_bars.error_bars(pair, context))
    left = [one.effect for one in found if not acts(one, whole)]
    if any(not isinstance(one, Contact) for one in left):
        assert verdict(changes(solved(scene, built, left), whole, context), bars) != "matters", left
    for one in found:
        if acts(one, whole):
            change = changes(solved(scene, built, [one.effect]), whole, context)
            assert verdict(change, bars) != "does not matter", one
            surface = change["surface_deviation.rms"]
            if surface > bars["surface_deviation.rms"]:
                assert surface / FACTOR < one.indicator.estimate < FACTOR * surface, one


def acts(one: Decision, whole: Run) -> bool:
    return one.needed and (not isinstance(one.effect, Contact) or whole.scalars["contact_area"].max() > 0)
