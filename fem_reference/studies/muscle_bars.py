"""Error bars of several muscles solved together: in each further solution, one source of error is smaller in all muscles."""

import logging
from collections.abc import Iterable
from dataclasses import replace
from typing import cast

import numpy as np

from fem_reference.assessment.error_bars import ErrorBars, Pair
from fem_reference.problems.joining import called
from fem_reference.problems.muscles import MusclesProblem
from fem_reference.runs import store
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.scenes.muscles import MusclesCase
from fem_reference.studies import refinement
from fem_reference.studies.execution import Bench
from fem_reference.studies.variations import by_springs

log = logging.getLogger(__name__)


def check(bench: Bench[Case]) -> None:
    """Raise InputError if a case has to be solved but cannot have error bars, as it cannot be set up with larger tetrahedra."""
    if store.finished(bench.folder(bench.scene.reference, "reference")):
        return  # its error bars are computed next, which reports the problem at once
    if bench.scene.parts:
        refinement.coarser(cast("Bench[MusclesCase]", bench))
    else:
        refinement.coarser(bench.of_muscle())


def obtain(bench: Bench[Case], reference: Run, *, model: bool = True) -> dict[str, ErrorBars]:
    """The error bars of each muscle by name, from stored or new runs of all muscles; they are stored with the ``reference``.
    With ``model``, also the change due to exact attachments. Empty for a run that did not converge.
    """
    if reference.outcome.status != "converged":
        log.info("no error bars: the reference did not converge")
        return {}
    own, parts = cast("Bench[MusclesCase]", bench), bench.parts
    larger, ratio = refinement.coarser(own)
    springs = {name: by_springs(part.scene) for name, part in parts.items()}
    model = model and any(springs.values())
    found = refinement.solutions(own, reference, larger, refinement.LARGER, ratio, model=model)
    split = {name: other.by_muscle(run) for name, (other, run) in found.items()}
    fine, coarse, exact = own.by_muscle(reference), split.pop(refinement.LARGER), split.pop(refinement.EXACT, {})
    bars = dict[str, ErrorBars]()
    for name, part in parts.items():
        refinement.check_coarser(part, *(refinement.tets(one[name], called(name, "tets")) for one in (fine, coarse)))
        size = part.scene.muscle.tet_size / 2**part.scene.muscle.refinements
        varied = {cause: _parted(runs[name], fine[name], parts) for cause, runs in split.items()}
        safety = _safety(own, parts, name)
        pair = Pair(fine[name], coarse[name], (size, ratio * size), varied, exact.get(name), safety, springs[name])
        bars[name] = refinement.made(pair, part, reference.folder and reference.folder / name, reference)
    return bars


def _parted(run: Run, reference: Run, names: Iterable[str]) -> Run:
    """The ``run`` of a muscle, with zero force on each of the muscles ``names`` that only the ``reference`` can touch: with less
    smoothing, contact acts at shorter distances, and fewer muscles are near enough.
    """
    none = 0.0 * run.positions[:, 0, 0]  # NaN in frames that are not known
    kinds = [f"{kind}_on_{name}" for kind in ("force", "moment") for name in names]
    keys = {key for kind in kinds for key in vector_scalars(kind, np.zeros(3))}
    return replace(run, scalars=dict.fromkeys(keys & set(reference.scalars), none) | run.scalars)


def _safety(bench: Bench[MusclesCase], parts: dict[str, Bench[MuscleCase]], name: str) -> float:
    """The factor of safety of a muscle: the greatest of its own and those of muscles that it may touch, whose errors reach it."""
    problem = bench.problem()
    assert isinstance(problem, MusclesProblem)
    near = {name}.union(*(pair for pair in problem.pairs if name in pair))
    return max(refinement.safety(parts[one]) for one in near)


def bars(bench: Bench[Case], reference: Run, name: str) -> ErrorBars | None:
    """The error bars of the muscle ``name``: stored ones, else those that :func:`obtain` computes for all muscles."""
    return (stored(bench, reference) or obtain(bench, reference)).get(name)


def offered(bench: Bench[Case], reference: Run, name: str, *, asked: bool) -> ErrorBars | None:
    """The error bars of the muscle ``name`` (if empty, of the only muscle): new ones if ``asked`` for, else stored ones."""
    if not name:
        return refinement.offered(bench, reference, asked=asked)
    return (obtain if asked else stored)(bench, reference).get(name)


def stored(bench: Bench[Case], reference: Run) -> dict[str, ErrorBars]:
    """The error bars of each muscle that are stored with a reference; empty if those of any muscle are missing."""
    found = {name: refinement.stored(reference, name) for name in bench.parts}
    known = {name: one for name, one in found.items() if one is not None}
    return known if len(known) == len(found) else {}
