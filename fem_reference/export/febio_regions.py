"""Regions in FEBio's input file: tetrahedra with similar parameters form a part with a single material.

In FEBio the bulk modulus of an uncoupled material is constant, so a region cannot be represented by a map over elements.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fem_reference.effects import Effect, region_of
from fem_reference.effects.fibre_passive import FibrePassive
from fem_reference.effects.fibre_passive_febio import FibrePassiveFebio
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.effects.mooney_rivlin import MooneyRivlin
from fem_reference.effects.neo_hooke import NeoHooke
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.mesh import Floats, Ints, tet_volumes
from fem_reference.problems.muscle import MuscleProblem

MUSCLE = "muscle"  # the name of a muscle's elements and material; with regions, the names of its parts begin with it
# The parameters to which the energy of each effect is proportional.
SCALED: dict[type[Effect], tuple[str, ...]] = {
    NeoHooke: ("mu",),
    MooneyRivlin: ("c1", "c2"),
    Incompressible: ("bulk",),
    IncompressiblePenalty: ("bulk",),
    FibrePassive: ("stress",),
    FibrePassiveFebio: ("c3", "c5"),
}
# Parameters in a part differ by at most FACTOR. Fibre parameters below _LEAST times the maximum are not distinguished.
FACTOR, _LEAST = 1.2, 0.01
# The parameters of fibre effects. Multiplied by the share of a region, they may fall to 0 at its border.
_OF_FIBRES = ("stress", "c3", "c5")
# The barycentric coordinates of the points of a quadrature rule of degree 2 in a tetrahedron.
_NEAR, _FAR = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
_POINTS = np.full((4, 4), _FAR) + (_NEAR - _FAR) * np.eye(4)


@dataclass(frozen=True, eq=False)
class Piece:
    """A part of the muscle with a single material.

    ``name``: the name of the material. ``cells`` (k,): the tetrahedra. ``effects``: the effects, each multiplied by the mean share
    of its region in these tetrahedra.
    """

    name: str
    cells: Ints
    effects: tuple[Effect, ...]


def shares(problem: MuscleProblem) -> dict[str, Floats]:
    """The mean share (m,) of each region in each tetrahedron, by the name with which effects refer to the region.

    For effects that act outside a region, the name begins with ``REST`` and the share is 1 minus that of the region.
    """
    corners, found = problem.mesh.points[problem.mesh.tets], dict[str, Floats]()
    for name in dict.fromkeys(filter(None, map(region_of, problem.effects))):
        points = np.einsum("qc,mci->mqi", _POINTS, corners).reshape(-1, 3)
        within = problem.regions[name.removeprefix(REST)](points).reshape(len(corners), -1).mean(axis=1)
        found[name] = 1 - within if name.startswith(REST) else within
    return found


@lru_cache(maxsize=8)
def parts(problem: MuscleProblem) -> tuple[Piece, ...]:
    """The parts of a muscle, in order of decreasing number of tetrahedra; a single part if no effect has a region."""
    known = shares(problem)
    if not known:
        return (Piece(MUSCLE, np.arange(len(problem.mesh.tets)), problem.effects),)
    levels = np.stack([_levels(*one) for one in _parameters(problem, known)], axis=1)
    _, which, counts = np.unique(levels, axis=0, return_inverse=True, return_counts=True)
    volumes, found = tet_volumes(problem.mesh.points, problem.mesh.tets), list[Piece]()
    for number, kind in enumerate(np.argsort(-counts, kind="stable"), start=1):
        cells = np.flatnonzero(which == kind)
        means = {name: float(np.average(one[cells], weights=volumes[cells])) for name, one in known.items()}
        acting = (_scaled(effect, means.get(region_of(effect), 1.0)) for effect in problem.effects)
        found.append(Piece(f"{MUSCLE}_{number}", cells, tuple(one for one in acting if one is not None)))
    return tuple(found)


def _parameters(problem: MuscleProblem, known: dict[str, Floats]) -> list[tuple[str, Floats]]:
    """The parameters of effects, multiplied by shares: pairs of a key and the values (m,) in all tetrahedra.

    A parameter is the sum over all effects of the same kind, except that each ``fibre_passive`` is separate.
    """
    found = dict[tuple[object, str], Floats]()
    for i, effect in enumerate(problem.effects):
        for key in SCALED.get(type(effect), ()):
            of = (i if isinstance(effect, FibrePassive) else type(effect), key)
            amount = known.get(region_of(effect), np.ones(len(problem.mesh.tets))) * getattr(effect, key)
            found[of] = found.get(of, 0.0) + amount
    return [(key, values) for (_, key), values in found.items()]


def _levels(key: str, values: Floats) -> Ints:
    """The number (m,) of the interval that contains each of the ``values`` (m,) of the parameter ``key``."""
    least = max(_LEAST * float(values.max()) if key in _OF_FIBRES else 0.0, np.finfo(float).tiny)
    return np.asarray(np.round(np.log(np.maximum(values, least)) / np.log(FACTOR)), np.int64)


def _scaled(effect: Effect, share: float) -> Effect | None:
    """The ``effect`` multiplied by ``share``; None if the share is 0."""
    keys = SCALED.get(type(effect), ())
    if share <= 0 and keys:
        return None
    return effect.model_copy(update={key: share * getattr(effect, key) for key in keys})


def note(problem: MuscleProblem) -> list[str]:
    """A list with a sentence about the parts; empty if there is only one part."""
    many = len(parts(problem))
    text = (
        f"regions are represented by {many} materials; in each, the parameters of the tetrahedra differ by at most a factor of "
        f"{FACTOR:g} (fibre parameters below {100 * _LEAST:g} % of the maximum are not distinguished). A material has the mean of "
        "these parameters, whereas in the reference they vary between quadrature points"
    )
    return [text] if many > 1 else []
