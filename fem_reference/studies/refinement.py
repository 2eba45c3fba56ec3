"""Runs for error bars: on coarser tetrahedra, and on these with one other source of numerical error halved at a time."""

import hashlib
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from fem_reference import metrics, solvers
from fem_reference.assessment import differences, error_bars, force_bars, neighbours, run_checks, second_check
from fem_reference.assessment.error_bars import SAFETY, BodyBars, ErrorBars, Pair
from fem_reference.effects import touching
from fem_reference.effects.contact import among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Ints
from fem_reference.foundations.records import Record
from fem_reference.geometry.sectors import attached_area, attached_shares
from fem_reference.io import files
from fem_reference.metrics import context_of
from fem_reference.problems.body import Body
from fem_reference.problems.finer import finer as on_finer_cells
from fem_reference.runs import views
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import DrivenCase, MuscleCase
from fem_reference.scenes.muscles import exactly_attached
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import (
    Vary,
    by_springs,
    on_larger,
    on_tetrahedra,
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
# tetrahedra larger by this factor.
RATIO = 1.5
# Without a request, error bars are computed only if they take at most this share of the reference's time, as estimated.
CHEAP = 0.2

# A quadratic element has as many unknowns on the same cells as a linear one on cells of half the size, and does not lock.
_QUADRATIC = {"P1": "P2", "P1/P1": "P2/P1", "Q1": "Q2", "Q1/P0": "Q2/Q1"}


def variations[C: DrivenCase](
    case: C, settings: Record, *, pressed: bool = True, touched: bool = True
) -> dict[str, Vary[C]]:
    """Changes, by name, each of which halves a source of numerical error other than tetrahedra: compliance and smoothing of contact
    with bones, if any ``pressed``, and of muscles with themselves or each other, if any ``touched``; error and rounding of
    distances to bones; load steps, if the ``settings`` have them and a state depends on them: with drag, viscosity or friction.
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
    With ``model``, also the change by exact attachments. None for a run that did not converge or has no interior.
    """
    if reference.outcome.status != "converged" or reference.fibres is None or not reference.has_surface:
        log.info("no error bars: the reference did not converge or has no interior")
        return None
    own = bench.of_muscle()
    with fenicsx.shared():
        pair = _pair(own, reference, model)
    return made(pair, own, reference.folder, reference)


def made(pair: Pair, bench: Bench[MuscleCase], folder: Path | None, reference: Run) -> ErrorBars:
    """The error bars of a ``pair`` of runs of the muscle of a bench; stored in a ``folder``, if given, for ``reference``."""
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
    _, (fine, coarse) = coarser(own.scene)
    count = 1 + len(needed(own, reference))
    if count * (fine / coarse) ** 3 > CHEAP:
        return None
    log.info("error bar: computed without a request, as it takes less than a fifth of the time")
    return obtain(bench, reference, model=False)


def stored(reference: Run, muscle: str = "") -> ErrorBars | None:
    """The error bars stored with a reference run, of one ``muscle`` of several; None without bars of this run and metrics."""
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
    """The scene of a bench on tetrahedra of ``ratio`` times the size, with every other source of error in its bars halved."""
    scene = on_larger(bench.scene, ratio)
    for vary in needed(bench, reference).values():
        scene = vary(scene)
    return scene


def _pair(bench: Bench[MuscleCase], reference: Run, model: bool) -> Pair:
    base, sizes = coarser(bench.scene)
    larger, springs = f"tetrahedra of {sizes[1]:.3g} mm", by_springs(base)
    found = solutions(bench, reference, {larger: base}, sizes[1] / sizes[0], model=model and springs)
    runs = {name: run for name, (_, run) in found.items()}
    coarse, exact = runs.pop(larger), runs.pop(EXACT, None)
    check_coarser(bench, tets(reference), tets(coarse))
    return Pair(reference, coarse, sizes, runs, exact, safety(bench), springs)


def solutions[C: DrivenCase](
    bench: Bench[C], reference: Run, larger: dict[str, C], ratio: float, *, model: bool
) -> dict[str, tuple[Bench[C], Run]]:
    """Benches and runs, by name: of the scene on ``larger`` tetrahedra, of ``ratio`` times the size; of this scene with each other
    source of error halved; and, with ``model``, of this scene with exact attachments, NaN if it cannot be set up.
    """
    ((first, base),) = larger.items()
    scenes = larger | {name: vary(base) for name, vary in needed(bench, reference).items()}
    if model:
        scenes[EXACT] = exactly_attached(base)
    # The time falls at least in proportion to the number of tetrahedra.
    seconds = reference.outcome.cost.get("seconds", 0.0) / ratio**3
    found = {}
    for i, (name, changed) in enumerate(scenes.items()):
        left = seconds * (len(scenes) - i)
        log.info("error bar: run %d of %d, %s; about %.0f s left", i + 1, len(scenes), name, left)
        try:
            found[name] = _solved(bench, changed, name, reference)
        except InputError as error:
            if name != EXACT:
                raise
            log.warning("error bar: the change by exact attachments is not known: %s", error)
            found[name] = found[first][0], complete(found[first][1], reference.numbers, trusted=False)
    return found


def check_coarser(bench: Bench[MuscleCase], fine: float, coarse: float) -> None:
    """Raise InputError unless the number of ``coarse`` tetrahedra is below that of ``fine`` ones."""
    if not coarse < fine:
        got = f"meshes of {fine:.0f} and {coarse:.0f} tetrahedra"
        raise InputError(f"{bench.scene.place}: muscle.tet_size", got, "a size that can be coarsened")


def safety(bench: Bench[MuscleCase]) -> float:
    """The factor of safety: that of a grid convergence index, times the ratio of the size of the unrefined tetrahedra to the radius
    of the smallest attachment if it is above 1. Nested tetrahedra share the polygonal outline of an attachment, so their
    difference does not show its error.
    """
    surface, attached = bench.setup().surface, bench.setup().attached
    areas = [attached_area(surface, attached_shares(surface, entry.vertices)) for entry in attached]
    radius = math.sqrt(min(areas, default=math.inf) / math.pi)
    return SAFETY * max(1.0, bench.scene.muscle.tet_size / radius)


def coarser(case: MuscleCase) -> tuple[MuscleCase, tuple[float, float]]:
    """The case with larger tetrahedra, and the sizes [mm] of its own and of the larger tetrahedra."""
    size, refinements = case.muscle.tet_size, case.muscle.refinements
    if refinements:
        return on_tetrahedra(case, refinements=refinements - 1), (size / 2**refinements, size / 2 ** (refinements - 1))
    return on_larger(case, RATIO), (size, size * RATIO)


@contextmanager
def reported(name: str) -> Iterator[None]:
    """A context in which an InputError names the run for error bars that could not be set up."""
    try:
        yield
    except InputError as error:
        got, want = f"a scene that cannot be set up ({error})", "a finer reference"
        raise InputError(f"error bar, {name}", got, want) from error


def _solved[C: DrivenCase](bench: Bench[C], case: C, name: str, reference: Run) -> tuple[Bench[C], Run]:
    """The bench of a changed scene, and its run over the frames of ``reference``: NaN if not reached or if the run is denied."""
    other = Bench(case, bench.store, bench.ranks)
    with reported(name):
        run = other.obtain(f"reference, {name}", without_states(case.reference), "reference")
    if run.outcome.status != "converged":
        log.info("error bar: %s: %s, %s", name, run.outcome.status, run.outcome.message)
    known = second_check.trusted(other.problem, run)  # type: ignore[arg-type]  # a driven case is of muscles
    return other, complete(run, reference.numbers, trusted=known)


def _of(reference: Run) -> dict[str, str]:
    """The identity of error bars: this run, measured by these metrics."""
    assert reference.folder is not None  # the caller has checked this
    return {"run": reference.folder.name, "metrics": _measuring_hash()}


@cache
def _measuring_hash() -> str:
    """A hash over the source files by which runs are measured."""
    paths = (*sorted(Path(metrics.__file__).parent.glob("*.py")), *MAKING)
    return hashlib.sha256(b"".join(path.read_bytes() for path in paths)).hexdigest()[:16]


def tets(run: Run, fact: str = "tets") -> float:
    """The number of tetrahedra of a run by the name of the ``fact``, NaN if it is not stated."""
    found = run.origin.get("mesh", {}).get(fact)
    return found if isinstance(found, float | int) else math.nan


def body_bars(solved: Run) -> BodyBars | None:
    """The error bars of a run by :func:`solve_body`; None if that did not converge."""
    if solved.outcome.status != "converged":
        log.info("no error bars: the body did not converge")
        return None
    settings, body = solved.settings, solved.body
    assert isinstance(settings, fenicsx.BodySettings)  # FEniCSx solved the body
    assert body is not None
    other, shared, changes, sharper = sharper_problem(body, settings)
    log.info("error bars: solving with %s", sharper)
    found = second_check.confirmed_body(other, fenicsx.solve_body(other, settings.model_copy(update=changes)))
    if found.outcome.status != "converged":
        log.info("error bars: with %s: %s, %s", sharper, found.outcome.status, found.outcome.message)
    states = () if found.outcome.status == "denied" else found.states
    bars = error_bars.body_bars(solved.states, states, shared, sharper)
    log.info("error bars: that of the displacement is %.2g %% at the last frame", 100 * bars.displacement[-1])
    return bars


def sharper_problem(
    body: Body, settings: fenicsx.BodySettings
) -> tuple[Body, Ints, dict[str, float | str | None], str]:
    """A more accurate problem: its body, the indices in it of the points of ``body``, changed settings, and changes in words."""
    changes, said = dict[str, float | str | None](store_state=False), ""
    # In all other cases a state does not depend on load steps.
    if body.rubs or any("interval" in effect.needs for effect in body.effects):
        largest = min(settings.largest_step or np.inf, float(np.diff(body.frames).max(initial=settings.first_step)))
        changes |= {"first_step": settings.first_step / 2, "largest_step": largest / 2}
        said = " and load steps of half the length"
    quadratic = _QUADRATIC.get(settings.element)
    if quadratic is not None:
        changes |= {"element": quadratic, "quadrature_degree": None}
        return body, np.arange(len(body.mesh.points)), changes, f"{quadratic} on the same cells{said}"
    return *on_finer_cells(body), changes, f"{settings.element} on cells of half the size{said}"
