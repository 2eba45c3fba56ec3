"""The runs that the error bar of a reference is made of: coarser tetrahedra, and every other cause of numerical error halved."""

import hashlib
import logging
import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

from fem_reference import study
from fem_reference.bones import Bone
from fem_reference.effects import Effect
from fem_reference.effects.contact import Contact, among
from fem_reference.errors import InputError
from fem_reference.execution import Bench, complete
from fem_reference.metrics import Yardstick
from fem_reference.runs import Run
from fem_reference.scene import Scene
from fem_reference.solvers import fenicsx
from fem_reference.study import ErrorBars, Ladder

log = logging.getLogger(__name__)

# From one size of tetrahedra to the next. Smaller ratios drown in what meshes differ by anyway; with larger ones the coarsest
# mesh would no longer carry the attachments.
RATIO = 1.25
# Meshes whose sizes differ by less tell no order.
_LEAST_RATIO = 1.08


@dataclass(frozen=True)
class Variation:
    """The scene with one cause of numerical error halved (``changes`` of its records), by ``name``."""

    name: str
    changes: dict[str, Any]


def variations(scene: Scene, settings: Any) -> tuple[Variation, ...]:
    """What is varied apart from tetrahedra: load steps, where the reference's ``settings`` have them, and with contact its
    stiffness and smoothing, and how well the distances to surfaces of bones are known and how far they are rounded.
    """
    steps = hasattr(settings, "largest_step")
    found = [Variation("load steps", _finer_steps(scene, settings))] if steps else []
    if among(scene.effects) is not None:
        found.append(Variation("contact stiffness", {"effect": _scaled(scene, "stiffness", 2.0)}))
        found.append(Variation("contact smoothing", {"effect": _scaled(scene, "smoothing", 0.5)}))
        if any(bone.surface for bone in scene.bone):
            found.append(Variation("distances to bones", {"bone": _closer(scene)}))
    return tuple(found)


def _finer_steps(scene: Scene, settings: Any) -> dict[str, Any]:
    """At most half the load steps: no step goes beyond a frame, so that ``frames.every`` bounds it as well."""
    largest = min(scene.frames.every, settings.largest_step or math.inf) / 2
    steps = {"first_step": settings.first_step / 2, "largest_step": largest}
    return {"reference": scene.reference.model_copy(update=steps)}


def _scaled(scene: Scene, key: str, factor: float) -> tuple[Effect, ...]:
    """The effects of a scene, with this key of contact times ``factor``."""
    return tuple(
        effect.model_copy(update={key: factor * getattr(effect, key)}) if isinstance(effect, Contact) else effect
        for effect in scene.effects
    )


def _closer(scene: Scene) -> tuple[Bone, ...]:
    """The bones of a scene, the distances to their surfaces known twice as well and half as round; closed forms are exact."""
    halved = ("distance_error", "distance_rounding")
    return tuple(
        bone.model_copy(update={key: getattr(bone, key) / 2 for key in halved}) if bone.surface else bone
        for bone in scene.bone
    )


def obtain(bench: Bench, reference: Run) -> ErrorBars | None:
    """The error bars of the ``reference`` of a bench: from runs in the store where they are, else solved now; stored beside it.
    None for a run that did not converge, and for one without an interior.
    """
    if reference.outcome.status != "converged" or reference.fibres is None or not reference.has_surface:
        log.info("error bar: none, of a reference that did not converge or has no interior")
        return None
    with fenicsx.shared():
        ladder = _ladder(bench, reference)
    log.info("error bar: measuring the runs against each other")
    bars = study.error_bars(ladder, Yardstick.of(reference, reference.fibres, bench.setup().bones, bench.setup().free))
    if reference.folder is not None:
        study.save(bars, reference.folder, _of(reference))
    return bars


def stored(reference: Run) -> ErrorBars | None:
    """The error bars stored beside a reference run, None without any that are of this run and of these metrics."""
    if reference.folder is None:
        return None
    bars = study.load(reference.folder, _of(reference))
    if bars is None and (reference.folder / study.FILE).exists():
        log.info("%s: made by other metrics; --error-bar makes it anew", reference.folder / study.FILE)
    return bars if bars is None or bars.numbers == reference.numbers else None


def _ladder(bench: Bench, reference: Run) -> Ladder:
    scene, size = bench.scene, bench.scene.muscle.tet_size
    sizes = (size, size * RATIO, size * RATIO**2)
    settings = bench.settings(scene.reference, "reference")
    varied = variations(scene, settings)
    # Newton's method in less than quadratic time of the unknowns: a cubed ratio is at most what coarser tetrahedra save.
    spent = reference.outcome.cost.get("seconds", 0.0)
    seconds = [spent / RATIO**3, *[spent / RATIO**6] * (1 + len(varied))]
    names = [f"tetrahedra of {wanted:.3g} mm" for wanted in sizes[1:]] + [variation.name for variation in varied]
    coarsest = _resized(scene, sizes[2])
    scenes = [_resized(scene, sizes[1]), coarsest]
    scenes += [coarsest.model_copy(update=variation.changes) for variation in varied]
    made = []
    for i, (name, changed) in enumerate(zip(names, scenes, strict=True)):
        left = sum(seconds[i:])
        log.info("error bar: run %d of %d, %s; at most about %.0f s for what is left", i + 1, len(names), name, left)
        made.append(_solved(bench, changed, name, reference))
    medium, coarse, *others = made
    runs = (reference, medium, coarse)
    lengths = tuple(_length(run) for run in runs)
    if any(large < _LEAST_RATIO * small for small, large in pairwise(lengths)):
        got = f"meshes of {', '.join(str(int(run.origin['mesh']['tets'])) for run in runs)} tetrahedra"
        raise InputError(f"{scene.place}: muscle.tet_size", got, "a size that coarser meshes differ from")
    finer = {variation.name: run for variation, run in zip(varied, others, strict=True)}
    return Ladder(runs, sizes, lengths, finer)  # type: ignore[arg-type]


def _solved(bench: Bench, scene: Scene, name: str, reference: Run) -> Run:
    """The reference's run of a changed scene, over the frames of ``reference``."""
    other = Bench(scene, bench.store.parent, bench.ranks)
    try:
        run = other.obtain(f"reference, {name}", scene.reference, "reference")
    except InputError as error:
        raise InputError(
            f"error bar, {name}", f"a scene that cannot be set up ({error})", "a finer reference"
        ) from error
    if run.outcome.status != "converged":
        log.info("error bar: %s: %s, %s", name, run.outcome.status, run.outcome.message)
    return complete(run, reference.numbers)


def _resized(scene: Scene, size: float) -> Scene:
    return scene.model_copy(update={"muscle": scene.muscle.model_copy(update={"tet_size": size})})


def _length(run: Run) -> float:
    """How large the tetrahedra of a run are [mm]: the cube root of their mean volume."""
    mesh = run.origin["mesh"]
    return float((mesh["volume_mm3"] / mesh["tets"]) ** (1 / 3))


def _of(reference: Run) -> dict[str, str]:
    """What an error bar is good for: this run, measured by these metrics."""
    assert reference.folder is not None  # the caller asked
    return {"run": reference.folder.name, "metrics": _measuring_hash()}


@cache
def _measuring_hash() -> str:
    """A hash over the source files that measure the runs."""
    root = Path(__file__).parent
    digest = hashlib.sha256()
    for path in (*sorted((root / "metrics").glob("*.py")), root / "study.py", Path(__file__)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
