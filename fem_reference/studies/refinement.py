"""Runs for error bars: on coarser tetrahedra, and on these with one other source of numerical error halved at a time."""

import hashlib
import logging
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from fem_reference import metrics, solvers
from fem_reference.assessment import differences, error_bars, force_bars, neighbours, run_checks, second_check
from fem_reference.assessment.error_bars import SAFETY, ErrorBars, Pair
from fem_reference.effects import touching
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record
from fem_reference.foundations.threads import in_threads
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.io import files
from fem_reference.metrics import context_of
from fem_reference.runs import store, views
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import DrivenCase, MuscleCase
from fem_reference.scenes.muscles import exactly_attached, muscles_of, with_muscles
from fem_reference.solvers.fenicsx.processes import installed
from fem_reference.solvers.fenicsx.resources import available
from fem_reference.solvers.fenicsx.session import Session, session, shared
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import (
    Vary,
    by_springs,
    on_larger,
    with_contact,
    with_distances,
    with_half_steps,
    without_states,
)

log = logging.getLogger(__name__)

LARGER, EXACT = "larger tetrahedra", "exact attachments"
# Files, besides the metrics, whose code computes error bars or rejects the runs that they come from.
_OF_BARS = [
    str(one.__file__) for one in (differences, error_bars, force_bars, views, second_check, run_checks, neighbours)
]
MAKING = (*map(Path, _OF_BARS), *map(Path(__file__).with_name, ("muscle_bars.py", "refinement.py", "variations.py")))

# The coarse run of a scene with refined tetrahedra omits the last refinement; that of any other scene has its own mesh, with
# tetrahedra larger by the first of these factors with which it can be set up.
RATIOS = (1.5, 1.25)
_AT_ONCE = 2  # the number of runs for error bars that are solved at once, if there are enough cores and memory
# Without a request, error bars are computed only if their estimated time is at most this fraction of the reference's time.
CHEAP = 0.2


def variations[C: DrivenCase](
    case: C, settings: Record, *, pressed: bool = True, touched: bool = True
) -> dict[str, Vary[C]]:
    """Changes, by name, each of which halves a source of numerical error other than tetrahedra: compliance and smoothing of contact
    with bones (if ``pressed``) and of muscles with themselves or each other (if ``touched``); error and rounding of distances to
    bones; load steps, if the ``settings`` have them and a state depends on them: with drag, viscosity or friction.
    """
    found, bones = dict[str, Vary[C]](), among(case.effects) if pressed else None
    of_muscles = touching.among(case.effects) if touched else None
    named = (("contact", bones), ("contact between muscles" if case.parts else "contact with itself", of_muscles))
    laws = [(name, law) for name, law in named if law is not None]
    for name, law in laws:
        found[f"{name} stiffness"] = partial(with_contact, kind=type(law), stiffness=2 * law.stiffness)
        found[f"{name} smoothing"] = partial(with_contact, kind=type(law), smoothing=law.smoothing / 2)
    if bones is not None and any(bone.surface for bone in case.bone):
        found["distances to bones"] = lambda one: with_distances(one, 0.5, "distance_error", "distance_rounding")
    rubs = any(law.friction is not None for _, law in laws)
    timed = any("interval" in effect.needs for effect in case.effects)
    if (timed or rubs) and "largest_step" in solvers.trades(type(settings)):
        found["load steps"] = with_half_steps(case, settings)
    return found


def obtain(bench: Bench[Case], reference: Run, *, model: bool = True) -> ErrorBars | None:
    """The error bars of the ``reference`` of a bench, from runs in the store or solved now; they are stored with the reference.
    With ``model``, also the change due to exact attachments. None for a run that did not converge or has no interior.
    """
    if reference.outcome.status != "converged" or reference.fibres is None or not reference.has_surface:
        log.info("no error bars: the reference did not converge or has no interior")
        return None
    own = bench.of_muscle()
    pair = _pair(own, reference, model)
    return made(pair, own, reference.folder, reference)


def made(pair: Pair, bench: Bench[MuscleCase], folder: Path | None, reference: Run) -> ErrorBars:
    """The error bars from a ``pair`` of runs of the muscle of a bench. They are stored in ``folder``, if it is given."""
    log.info("error bar: comparing the runs")
    context = context_of(bench.setup(), pair.fine)
    bars = error_bars.error_bars(pair, context)
    bars = replace(bars, bars=(*bars.bars, *force_bars.force_bars(pair, context)))
    if folder is not None:
        files.make_folder(folder)
        error_bars.save(bars, folder, _of(reference))
    return bars


def bars(bench: Bench[Case], reference: Run, *, model: bool = True) -> ErrorBars | None:
    """The error bars that are stored with a reference, else those that :func:`obtain` makes."""
    return stored(reference) or obtain(bench, reference, model=model)


def offered(bench: Bench[Case], reference: Run, *, asked: bool) -> ErrorBars | None:
    """Error bars: new ones if ``asked`` for; else stored ones, or new ones that cost less than a fifth of the reference."""
    if asked:
        return obtain(bench, reference)
    found = stored(reference)
    if found is not None or reference.outcome.status != "converged" or reference.fibres is None:
        return found
    own = bench.of_muscle()
    if not own.scene.muscle.refinements or (1 + len(needed(own, reference))) / 2**3 > CHEAP:
        return None
    log.info("error bar: computed without a request, as it takes less than a fifth of the time")
    return obtain(bench, reference, model=False)


def stored(reference: Run, muscle: str = "") -> ErrorBars | None:
    """The error bars stored with a reference run, for one ``muscle`` if it has several; None if the current metrics made none."""
    if reference.folder is None:
        return None
    folder = reference.folder / muscle
    bars = error_bars.load(folder, _of(reference))
    if bars is None and (folder / error_bars.FILE).exists():
        log.info("%s: made by other metrics; --error-bar computes it again", folder / error_bars.FILE)
    return bars if bars is None or bars.numbers == reference.numbers else None


def needed[C: DrivenCase](bench: Bench[C], reference: Run) -> dict[str, Vary[C]]:
    """The variations that can change a reference: those of contact only if there was contact."""
    areas = [reference.scalars.get(f"{name}_area") for name in ("contact", "touching")]
    pressed, touched = (area is None or bool(np.nanmax(area) > 0) for area in areas)
    settings = bench.settings(bench.scene.reference, "reference")
    return variations(bench.scene, settings, pressed=pressed, touched=touched)


def finer[C: DrivenCase](bench: Bench[C], reference: Run, ratio: float) -> C:
    """The scene of a bench on tetrahedra of ``ratio`` times the size, with every other source of numerical error halved."""
    scene = on_larger(bench.scene, ratio)
    for vary in needed(bench, reference).values():
        scene = vary(scene)
    return scene


def _pair(bench: Bench[MuscleCase], reference: Run, model: bool) -> Pair:
    (larger, ratio), muscle = coarser(bench), bench.scene.muscle
    size, springs = muscle.tet_size / 2**muscle.refinements, by_springs(bench.scene)
    sizes, name = (size, ratio * size), f"tetrahedra of {ratio * size:.3g} mm"
    found = solutions(bench, reference, larger, name, ratio, model=model and springs)
    runs = {name: run for name, (_, run) in found.items()}
    coarse, exact = runs.pop(name), runs.pop(EXACT, None)
    check_coarser(bench, tets(reference), tets(coarse))
    return Pair(reference, coarse, sizes, runs, exact, safety(bench), springs)


def solutions[C: DrivenCase](
    bench: Bench[C], reference: Run, larger: Bench[C], first: str, ratio: float, *, model: bool
) -> dict[str, tuple[Bench[C], Run]]:
    """Benches and runs, by name: of the case on ``larger`` tetrahedra, under the name ``first``; of the same case with each of the
    other sources of error halved; and, with ``model``, of the same case with exact attachments, NaN if it cannot be set up.

    ``ratio``: the size of the larger tetrahedra divided by the size of those of the ``reference``.
    """
    base = larger.scene
    scenes = {first: base} | ({EXACT: exactly_attached(base)} if model else {})
    scenes |= {name: vary(base) for name, vary in needed(bench, reference).items()}
    larger.ranks, count = _at_once(bench, reference)
    # The time falls at least in proportion to the number of tetrahedra.
    seconds = reference.outcome.cost.get("seconds", 0.0) / ratio**3 / count

    def solved(numbered: tuple[int, str], own: Session | None) -> tuple[Bench[C], Run] | None:
        i, name = numbered
        left = seconds * (len(scenes) - i)
        log.info("error bar: run %d of %d, %s; about %.0f s left", i + 1, len(scenes), name, left)
        try:
            with shared(own):
                other = larger if name == first else Bench(scenes[name], bench.store, larger.ranks)
                return _solved(other, name, reference)
        except InputError as error:
            if name != EXACT:
                raise
            log.warning("error bar: the change due to exact attachments is not known: %s", error)
            return None

    numbered = list(enumerate(scenes))
    if count == 1:
        with shared():
            runs = tuple(solved(one, None) for one in numbered)
    else:
        runs = in_threads(
            solved, numbered, count * [partial(session, larger.ranks or 1) if installed() else nullcontext]
        )
    known = {name: run for name, run in zip(scenes, runs, strict=True) if run}
    other, coarse = known[first]
    return {name: (other, complete(coarse, reference.numbers, trusted=False)) for name in scenes} | known


def _at_once[C: DrivenCase](bench: Bench[C], reference: Run) -> tuple[int | None, int]:
    """The ranks of each run for error bars, and the number of runs at a time for which there are cores and memory; no run
    needs more memory than the ``reference``.
    """
    asked = getattr(bench.settings(bench.scene.reference, "reference"), "ranks", None)
    cores = len(os.sched_getaffinity(0)) // (asked or 1)
    fit = available() / reference.outcome.cost.get("peak_memory_mb", 1.0)
    count = _AT_ONCE if min(cores, fit) >= _AT_ONCE else 1
    return (asked or 1 if count > 1 else bench.ranks), count


def check_coarser(bench: Bench[MuscleCase], fine: float, coarse: float) -> None:
    """Raise InputError unless the number of ``coarse`` tetrahedra is below that of ``fine`` ones."""
    if not coarse < fine:
        got = f"meshes of {fine:.0f} and {coarse:.0f} tetrahedra"
        raise InputError(f"{bench.scene.place}: muscle.tet_size", got, "a size that can be coarsened")


def safety(bench: Bench[MuscleCase]) -> float:
    """The factor of safety: that of a grid convergence index, times the ratio of the size of the unrefined tetrahedra to the radius
    of the smallest attachment, if this ratio is above 1. Nested meshes share the polygonal outline of an attachment, so the
    difference of their results does not show the error of this outline.
    """
    surface, attached = bench.setup().surface, bench.setup().attached
    areas = [attached_area(surface, attached_shares(surface, entry.vertices)) for entry in attached]
    radius = math.sqrt(min(areas, default=math.inf) / math.pi)
    return SAFETY * max(1.0, bench.scene.muscle.tet_size / radius)


def coarser[C: DrivenCase](bench: Bench[C]) -> tuple[Bench[C], float]:
    """A bench of the case with larger tetrahedra in every muscle, and the ratio of the sizes: the same for all, as errors of one
    muscle reach its neighbours. If all meshes are refined, omit the last refinement. Raises InputError if no case can be set up.
    """
    case, failed = bench.scene, list[InputError]()
    if all(one.refinements for one in muscles_of(case)):
        unrefined = with_muscles(case, lambda one: {"refinements": one.refinements - 1})
        return Bench(unrefined, bench.store, bench.ranks), 2.0
    for ratio in RATIOS:
        larger = on_larger(case, ratio)
        other = Bench(larger, bench.store, bench.ranks)
        try:
            if not store.finished(other.folder(larger.reference, "reference")):
                other.problem()
            return other, ratio
        except InputError as error:
            log.info("error bar: tetrahedra %g times as large cannot be set up: %s", ratio, error)
            failed.append(error)
    with reported(LARGER):
        raise failed[0]


@contextmanager
def reported(name: str) -> Iterator[None]:
    """A context in which an InputError names the run for error bars that could not be set up."""
    try:
        yield
    except InputError as error:
        got, want = f"a scene that cannot be set up ({error})", "a finer reference"
        raise InputError(f"error bar, {name}", got, want) from error


def _solved[C: DrivenCase](other: Bench[C], name: str, reference: Run) -> tuple[Bench[C], Run]:
    """The bench of a changed scene, and its run over the frames of ``reference``; NaN if not reached or not trusted."""
    case = other.scene
    # For several muscles the second check needs states, to check curved facets.
    choice = case.reference if case.parts else without_states(case.reference)
    with reported(name):
        run = other.obtain(f"reference, {name}", choice, "reference")
    if run.outcome.status != "converged":
        log.info("error bar: %s: %s, %s", name, run.outcome.status, run.outcome.message)
    known = second_check.trusted(other.problem, run)  # type: ignore[arg-type]  # a driven case is of muscles
    return other, complete(run, reference.numbers, trusted=known)


def _of(reference: Run) -> dict[str, str]:
    """The identity of error bars: the run, and the metrics by which it was measured."""
    assert reference.folder is not None  # the caller has checked this
    return {"run": reference.folder.name, "metrics": _measuring_hash()}


@cache
def _measuring_hash() -> str:
    """A hash over the source files by which runs are measured."""
    paths = (*sorted(Path(metrics.__file__).parent.glob("*.py")), *MAKING)
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def tets(run: Run, fact: str = "tets") -> float:
    """The number of tetrahedra of a run, as stated under the name ``fact``; NaN if it is not stated."""
    found = run.origin.get("mesh", {}).get(fact)
    return found if isinstance(found, float | int) else math.nan
