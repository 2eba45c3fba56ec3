"""Split of the error of a solver with tetrahedra into parts due to effects left out, its law, its mesh and its convergence.

Each intermediate reference changes one more thing: first, effects that the solver lacks are left out; then its law is used; then
its linear tetrahedra are used.
"""

import math
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fem_reference.effects import Effect, Energy, find, make, moduli, name_of, names, regions_named
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import diagonal, vertex_areas
from fem_reference.metrics import rms
from fem_reference.runs.store import Run
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench

# Effects of a case that the law of a solver replaces.
LAW = ("neo_hooke", "incompressible", "incompressible_penalty", "mooney_rivlin")
PARTS = ("left out", "law", "mesh", "convergence")
# The shear modulus, as a fraction of the bulk modulus, that is added to a law without shear stiffness at rest, whose equilibrium is
# not unique. It displaces the end of a bar by 0.02 mm in a rotation of 1 rad; with a tenth of it, Newton's method may not converge.
_WEAK = 1e-4


@dataclass(frozen=True)
class Split:
    """The ``parts`` of an error and its ``total`` (``surface_deviation.rms``), as root mean squares [mm] over the surface at the
    ``frame`` with the maximum total. The sum of the parts is at least the total.
    """

    frame: int
    total: float
    parts: dict[str, float]


def lame(case: MuscleCase, poisson: float) -> tuple[float, float]:
    """Lame's parameters mu and lambda [MPa] of the matrix material of a ``case``, with a Poisson's ratio of at most ``poisson``.

    Raises InputError if the matrix has no law in ``LAW`` with a shear and a bulk modulus, or if the case has laws of regions.
    """
    found = moduli([one for one in case.effects if name_of(one) in LAW])
    if (found.shear, found.bulk) != (moduli(case.effects).shear, moduli(case.effects).bulk):
        raise InputError(case.place, "shear or bulk modulus of another effect", f"those of {', '.join(LAW)} alone")
    if regions_named(case.effects) or not min(found.shear, found.bulk) > 0:
        raise InputError(case.place, "laws of regions, or no shear or bulk modulus", "one law of the whole muscle")
    mu, bulk = found.shear, found.bulk
    ratio = min((3 * bulk - 2 * mu) / (2 * (3 * bulk + mu)), poisson)
    return mu, 2 * mu * ratio / (1 - 2 * ratio)


def split(bench: Bench[MuscleCase], run: Run, law: Effect, takes: Collection[str] = ()) -> Split:
    """Split the error of a ``run`` into parts. The solver has ``law``, the case's tetrahedra (linear), and exact attachments.

    ``takes``: other effects that the solver models. Raises InputError if an intermediate reference has no solution.
    """
    path = [bench.reference(), *_references(bench, law, takes), run]
    frames = np.isfinite(run.positions).all(axis=(1, 2))
    totals = [_apart(path[0], run, i) if there else -1.0 for i, there in enumerate(frames)]
    worst = int(np.argmax(totals))
    steps = (_apart(one, other, worst) for one, other in pairwise(path))
    return Split(run.numbers[worst], totals[worst], dict(zip(PARTS, steps, strict=True)))


def _references(bench: Bench[MuscleCase], law: Effect, takes: Collection[str]) -> Iterator[Run]:
    """The intermediate references: without the effects that the solver leaves out, then with its law, then on linear tetrahedra."""
    case = bench.scene
    others = [one for one in case.effects if name_of(one) in takes]
    _check_held(bench)
    held = tuple(one.model_copy(update={"stiffness": None}) for one in case.attachment)
    whole = [one for one in case.effects if name_of(one) in LAW]
    own = [law] if moduli([law]).shear else [law, make("neo_hooke", mu=_WEAK * moduli([law]).bulk)]
    for effects, element in ((whole, ""), (own, "P2"), (own, "P1")):
        choice = case.reference.model_copy(update={"element": element}) if element else case.reference
        changed = {
            "effect": (*effects, *others),
            "attachment": held,
            "reference": choice,
            "choice": "listed",
            "expect": (),
        }
        made = Bench(case.model_copy(update=changed), bench.store).reference()
        if made.outcome.status != "converged":
            got = f"a reference with {name_of(effects[0])} {element}, {made.outcome.status}: {made.outcome.message}"
            raise InputError(case.place, got, "one that reaches all frames")
        yield made


def _check_held(bench: Bench[MuscleCase]) -> None:
    """Raise InputError if exact attachments would change the case too much: if it has no attachments, or springs whose stiffness
    times the size of the muscle is below the shear modulus of the muscle.
    """
    case, size = bench.scene, diagonal(bench.setup().surface.points)
    soft = [one.name for one in case.attachment if (one.stiffness or math.inf) * size < moduli(case.effects).shear]
    if soft or not case.attachment:
        got = f"springs softer than the muscle: {', '.join(soft)}" if soft else "nothing"
        raise InputError(f"{case.place}: attachment", got, "attachments stiff enough to be made exact")


def _apart(one: Run, other: Run, i: int) -> float:
    away = np.linalg.norm(one.positions[i] - other.positions[i], axis=1)
    return float(rms(away[None], vertex_areas(one.surface.points, one.surface.triangles))[0])


def law_of(name: str, case: MuscleCase, poisson: float) -> Effect:
    """The law ``name`` with the parameters of the matrix material of a ``case``."""
    mu, second = lame(case, poisson)
    return make(name, mu=mu, lame=second)


def check_law(name: str, poisson: object, place: str) -> None:
    """Raise InputError at ``place`` if the reference has no law ``name`` with Lame's parameters, or if ``poisson`` is invalid."""
    known = [one for one in names(Energy) if {"mu", "lame"} <= find(one).model_fields.keys()]
    if name not in known:
        raise InputError(
            f"{place}: law", f'"{name}"', f"{', '.join(known)}, or no key law, so that the error is not split"
        )
    if not isinstance(poisson, float) or not 0 < poisson < 0.5:
        got = "nothing" if poisson is None else str(poisson)
        raise InputError(f"{place}: settings.poisson", got, "the Poisson's ratio of the law, between 0 and 0.5")
