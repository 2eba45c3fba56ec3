"""Loads on parts of the surface that are prescribed exactly: they would go to what prescribes them and deform nothing."""

import numpy as np

from fem_reference.effects import Load
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Ints
from fem_reference.problems.body import Body


def check(body: Body) -> None:
    """Raise InputError where all facets of a load are prescribed exactly along all axes, by one region or by several."""
    facets = body.mesh.facets
    exact = [entry for entry in body.prescribed if entry.stiffness is None and isinstance(entry.on, str)]
    for i, effect in enumerate(body.effects):
        if not isinstance(effect, Load):
            continue
        loaded = _names(facets.get(effect.on)) if exact else set()
        fixed = (
            set[tuple[int, ...]]().union(*(_names(facets.get(str(one.on))) for one in exact if axis in one.components))
            for axis in range(3)
        )
        if loaded and all(loaded <= along for along in fixed):
            got = f'{effect.title} on "{effect.on}", which is prescribed exactly, so that a load deforms nothing'
            raise InputError(f"effects[{i}].on", got, "a part that is free along an axis, or attached by springs")


def _names(facets: Ints | None) -> set[tuple[int, ...]]:
    """The corners of each of the ``facets`` (f, 3 or 4), in order."""
    return set() if facets is None else set(map(tuple, np.sort(facets, axis=1).tolist()))
