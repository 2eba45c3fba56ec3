"""The runs that error bars are made of: coarser tetrahedra, and on these every other cause of numerical error halved."""

import hashlib
import logging
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import metrics, solvers
from fem_reference.assessment import differences, error_bars
from fem_reference.assessment.error_bars import SAFETY, ErrorBars, Pair
from fem_reference.effects import Effect
from fem_reference.effects.contact import Contact, among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.complete import complete
from fem_reference.runs.store import Run
from fem_reference.scenes.bones import Bone
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench
from fem_reference.studies.run_folders import without_states

log = logging.getLogger(__name__)

_EXACT = "exact attachments"
# The files that bars are made by, beside the metrics.
_MAKING = (differences.__file__, error_bars.__file__, __file__)

# A scene whose tetrahedra are refined has the coarse member of its pair in them, before the last refinement; another has a mesh of
# its own for it, larger by so much.
RATIO = 1.5
# Up to this share of the time of a reference its error bars are made without being asked for: a run on larger tetrahedra takes the
# share of the time that these are of the number.
CHEAP = 0.2


@dataclass(frozen=True)
class Variation:
    """The scene with one cause of numerical error halved (``changes`` of its records), by ``name``."""

    name: str
    changes: dict[str, Any]


def variations(scene: MuscleCase, settings: Record, *, pressed: bool = True) -> tuple[Variation, ...]:
    """What is varied apart from tetrahedra: of contact its stiffness and smoothing, and how well the distances to surfaces of bones
    are known and how far they are rounded, unless no bone ``pressed``; load steps, where the reference's ``settings`` have them,
    with drag or viscosity only: else a state does not depend on them.
    """
    found = []
    if among(scene.effects) is not None and pressed:
        found.append(Variation("contact stiffness", {"effect": _scaled(scene, "stiffness", 2.0)}))
        found.append(Variation("contact smoothing", {"effect": _scaled(scene, "smoothing", 0.5)}))
        if any(bone.surface for bone in scene.bone):
            found.append(Variation("distances to bones", {"bone": _closer(scene)}))
    if any("interval" in effect.needs for effect in scene.effects) and "largest_step" in solvers.trades(type(settings)):
        found.append(Variation("load steps", _finer_steps(scene, settings)))
    return tuple(found)


def _finer_steps(scene: MuscleCase, settings: Any) -> dict[str, Any]:
    """At most half the load steps: no step goes beyond a frame, so that ``frames.every`` bounds it as well."""
    largest = min(scene.frames.every, settings.largest_step or math.inf) / 2
    steps = {"first_step": settings.first_step / 2, "largest_step": largest}
    return {"reference": scene.reference.model_copy(update=steps)}


def _scaled(scene: MuscleCase, key: str, factor: float) -> tuple[Effect, ...]:
    """The effects of a scene, with this key of contact times ``factor``."""
    return tuple(
        effect.model_copy(update={key: factor * getattr(effect, key)}) if isinstance(effect, Contact) else effect
        for effect in scene.effects
    )


def _closer(scene: MuscleCase) -> tuple[Bone, ...]:
    """The bones of a scene, the distances to their surfaces known twice as well and half as round; closed forms are exact."""
    halved = ("distance_error", "distance_rounding")
    return tuple(
        bone.model_copy(update={key: getattr(bone, key) / 2 for key in halved}) if bone.surface else bone
        for bone in scene.bone
    )


def obtain(bench: Bench[Case], reference: Run, *, model: bool = True) -> ErrorBars | None:
    """The error bars of the ``reference`` of a bench: from runs in the store where they are, else solved now; stored beside it.
    With ``model``, also what exact attachments would change. None for a run that did not converge, and for one without an interior.
    """
    if reference.outcome.status != "converged" or reference.fibres is None or not reference.has_surface:
        log.info("error bar: none, of a reference that did not converge or has no interior")
        return None
    with fenicsx.shared():
        pair = _pair(bench.of_muscle(), reference, model)
    log.info("error bar: measuring the runs against each other")
    setup = bench.setup()
    bars = error_bars.error_bars(pair, MeasurementContext.of(reference, reference.fibres, setup.bones, setup.exempt))
    if reference.folder is not None:
        error_bars.save(bars, reference.folder, _of(reference))
    return bars


def offered(bench: Bench[Case], reference: Run) -> ErrorBars | None:
    """The error bars where nobody asked for them: those that are stored, or new ones where they cost less than a fifth of the
    reference; else None, as of what did not converge or has no interior.
    """
    found = stored(reference)
    if found is not None:
        return found
    if reference.outcome.status != "converged" or reference.fibres is None:
        return None
    own = bench.of_muscle()
    _, (fine, coarse) = _coarser(own.scene)
    count = 1 + len(_needed(own, reference))
    if count * (fine / coarse) ** 3 > CHEAP:
        return None
    log.info("error bar: made without being asked for, as it takes less than a fifth of the time")
    return obtain(bench, reference, model=False)


def stored(reference: Run) -> ErrorBars | None:
    """The error bars stored beside a reference run, None without any that are of this run and of these metrics."""
    if reference.folder is None:
        return None
    bars = error_bars.load(reference.folder, _of(reference))
    if bars is None and (reference.folder / error_bars.FILE).exists():
        log.info("%s: made by other metrics; --error-bar makes it anew", reference.folder / error_bars.FILE)
    return bars if bars is None or bars.numbers == reference.numbers else None


def _needed(bench: Bench[MuscleCase], reference: Run) -> tuple[Variation, ...]:
    """What has to be varied."""
    settings = bench.settings(bench.scene.reference, "reference")
    return variations(bench.scene, settings, pressed=_pressed(reference))


def _pressed(reference: Run) -> bool:
    """Whether a bone pressed: where none did, the stiffness of contact changes nothing."""
    area = reference.scalars.get("contact_area")
    return area is None or bool(np.nanmax(area) > 0)


def finer(bench: Bench[MuscleCase], reference: Run, ratio: float) -> MuscleCase:
    """The scene of a bench on tetrahedra of ``ratio`` times the size, with every other cause of error halved that its bars have."""
    scene, settings = bench.scene, bench.settings(bench.scene.reference, "reference")
    scene = scene.model_copy(
        update={"muscle": scene.muscle.model_copy(update={"tet_size": ratio * scene.muscle.tet_size})}
    )
    for i in range(len(_needed(bench, reference))):
        scene = scene.model_copy(update=variations(scene, settings, pressed=_pressed(reference))[i].changes)
    return scene


def _pair(bench: Bench[MuscleCase], reference: Run, model: bool) -> Pair:
    coarser, sizes = _coarser(bench.scene)
    varied = _needed(bench, reference)
    scenes = {f"tetrahedra of {sizes[1]:.3g} mm": coarser}
    scenes |= {entry.name: coarser.model_copy(update=entry.changes) for entry in varied}
    if model and any(entry.stiffness is not None for entry in coarser.attachment):
        attached = tuple(entry.model_copy(update={"stiffness": None}) for entry in coarser.attachment)
        scenes[_EXACT] = coarser.model_copy(update={"attachment": attached})
    # Newton's method takes less than quadratic time of the unknowns: what larger tetrahedra save is at least their number.
    seconds = reference.outcome.cost.get("seconds", 0.0) * (sizes[0] / sizes[1]) ** 3
    runs = {}
    for i, (name, changed) in enumerate(scenes.items()):
        left = seconds * (len(scenes) - i)
        log.info("error bar: run %d of %d, %s; about %.0f s for what is left", i + 1, len(scenes), name, left)
        try:
            runs[name] = _solved(bench, changed, name, reference)
        except InputError as error:
            if name != _EXACT:
                raise
            log.info("error bar: without what exact attachments would change: %s", error)
    coarse, *others = runs.values()
    if not _tets(coarse) < _tets(reference):
        got = " and ".join(f"{_tets(run):.0f}" for run in (reference, coarse))
        raise InputError(
            f"{bench.scene.place}: muscle.tet_size",
            f"meshes of {got} tetrahedra",
            "a size that coarser meshes differ from",
        )
    halved = {variation.name: run for variation, run in zip(varied, others, strict=False)}
    return Pair(reference, coarse, sizes, halved, runs.get(_EXACT), _safety(bench))


def _safety(bench: Bench[MuscleCase]) -> float:
    """That of a grid convergence index, and as much more as the tetrahedra, before they are refined, are larger than the radius of
    the smallest attachment: nested tetrahedra share its polygon, and their difference does not show what is wrong with that.
    """
    rest, radii = bench.setup(), [math.inf]
    for entry in rest.attached:
        area = attached_area(rest.surface, attached_shares(rest.surface, entry.vertices))
        radii.append(math.sqrt(area / math.pi))
    return SAFETY * max(1.0, bench.scene.muscle.tet_size / min(radii))


def _coarser(scene: MuscleCase) -> tuple[MuscleCase, tuple[float, float]]:
    """The scene with larger tetrahedra, and the sizes [mm] of its own and of these."""
    size, refinements = scene.muscle.tet_size, scene.muscle.refinements
    if refinements:
        muscle = scene.muscle.model_copy(update={"refinements": refinements - 1})
        sizes = (size / 2**refinements, size / 2 ** (refinements - 1))
    else:
        muscle = scene.muscle.model_copy(update={"tet_size": size * RATIO})
        sizes = (size, size * RATIO)
    return scene.model_copy(update={"muscle": muscle}), sizes


def _solved(bench: Bench[MuscleCase], scene: MuscleCase, name: str, reference: Run) -> Run:
    """The reference's run of a changed scene, over the frames of ``reference``."""
    other = Bench(scene, bench.store, bench.ranks)
    try:
        run = other.obtain(f"reference, {name}", without_states(scene.reference), "reference")
    except InputError as error:
        raise InputError(
            f"error bar, {name}", f"a scene that cannot be set up ({error})", "a finer reference"
        ) from error
    if run.outcome.status != "converged":
        log.info("error bar: %s: %s, %s", name, run.outcome.status, run.outcome.message)
    return complete(run, reference.numbers)


def _of(reference: Run) -> dict[str, str]:
    """What an error bar is good for: this run, measured by these metrics."""
    assert reference.folder is not None  # the caller asked
    return {"run": reference.folder.name, "metrics": _measuring_hash()}


@cache
def _measuring_hash() -> str:
    """A hash over the source files that measure the runs."""
    digest = hashlib.sha256()
    for path in (*sorted(Path(metrics.__file__).parent.glob("*.py")), *map(Path, _MAKING)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _tets(run: Run) -> float:
    """How many tetrahedra a run has, NaN where it does not say."""
    tets = run.origin.get("mesh", {}).get("tets")
    return tets if isinstance(tets, float | int) else math.nan
