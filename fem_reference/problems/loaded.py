"""Loads on parts of the surface that are prescribed exactly: they would go to what prescribes them and deform nothing."""

from itertools import combinations

import numpy as np

from fem_reference.effects import Load
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Bools, Floats, Ints
from fem_reference.problems.body import Body


def check(body: Body) -> None:
    """Raise InputError where an external load acts only along axes along which its facets are prescribed exactly."""
    mesh = body.mesh
    for effect in body.effects:
        if not (isinstance(effect, Load) and effect.outer and effect.on in mesh.facets):
            continue
        facets = mesh.facets[effect.on]
        along = effect.along(_normals(mesh.points, facets))
        if along.any() and not (along & ~_fixed(body, facets)).any():
            got = "a part that is prescribed exactly along all axes of the load, which deforms nothing"
            want = "one that is free along an axis of the load, or attached by springs"
            raise InputError(f'{type(effect).__name__} on "{effect.on}"', got, want)


def _fixed(body: Body, facets: Ints) -> Bools:
    """True (f, 3) for the axes along which the ``facets`` (f, 3 or 4) are prescribed exactly, by one region or by several."""
    found, names = np.zeros((len(facets), 3), bool), _names(facets)
    for entry in body.prescribed:
        if entry.stiffness is None and isinstance(entry.on, str):
            region = set(_names(body.mesh.facets[entry.on]))
            found[np.ix_([name in region for name in names], entry.components)] = True
    return found


def _names(facets: Ints) -> list[tuple[int, ...]]:
    """The corners of each of the ``facets`` (f, 3 or 4), in order."""
    return list(map(tuple, np.sort(facets, axis=1).tolist()))


def _normals(points: Floats, facets: Ints) -> Floats:
    """The sizes (f, 3) of the components of the normals at rest of ``facets`` (f, 3 or 4), the greatest of all their triangles."""
    corners = [points[column] for column in facets.T]
    crosses = [np.abs(np.cross(b - a, c - a)) for a, b, c in combinations(corners, 3)]
    greatest = np.max(crosses, axis=0)
    return np.asarray(greatest / np.linalg.norm(greatest, axis=1, keepdims=True))
