"""Checks of loads on exactly prescribed parts of the surface, where a load would deform nothing."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from fem_reference.effects import Load
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Bools, Floats, Ints, found_in
from fem_reference.problems.body import Body, Prescribed


def check(body: Body) -> None:
    """Raise InputError if an external load acts only along axes along which its facets are prescribed exactly."""
    for effect in body.effects:
        if not (isinstance(effect, Load) and effect.outer and effect.on in body.mesh.facets):
            continue
        facets = body.mesh.facets[effect.on]
        free = ~_fixed(body, facets)
        along = (effect.along(_normals(points, facets)) for points in _places(body))
        if not any((one & free).any() or not one.any() for one in along):
            got = "a part that is prescribed exactly along all axes of the load, which deforms nothing"
            want = "a part that is free along an axis of the load, or attached by springs"
            raise InputError(f'{type(effect).__name__} on "{effect.on}"', got, want)


def _exact(body: Body) -> list[tuple[Prescribed, Ints]]:
    """The exactly prescribed displacements of a body, each with its facets (f, 3 or 4)."""
    entries = [(entry, entry.on) for entry in body.prescribed if entry.stiffness is None]
    return [(entry, body.mesh.facets[on]) for entry, on in entries if isinstance(on, str)]


def _places(body: Body) -> Iterator[Floats]:
    """Yield the points (n, 3) [mm] of the mesh at rest, then at and between frames, moved by the exactly prescribed displacements,
    which may tilt facets.
    """
    yield body.mesh.points
    ends = np.unique([*body.frames, *body.stops])
    for frame in np.concatenate([ends, (ends[1:] + ends[:-1]) / 2]):
        moved = body.mesh.points.copy()
        for entry, facets in _exact(body):
            corners, axes = np.unique(facets), list(entry.components)
            places = body.mesh.points[corners]
            moved[np.ix_(corners, axes)] = (places + entry.displacements(places, frame))[:, axes]
        yield moved


def _fixed(body: Body, facets: Ints) -> Bools:
    """Mask (f, 3) of the axes along which the ``facets`` (f, 3 or 4) are prescribed exactly, by one region or by several."""
    found = np.zeros((len(facets), 3), bool)
    for entry, others in _exact(body):
        found[np.ix_(found_in(facets, others), entry.components)] = True
    return found


def _normals(points: Floats, facets: Ints) -> Floats:
    """The absolute components (f, 3) of the normals of ``facets`` (f, 3 or 4), each the maximum over the triangles of a facet."""
    corners = [points[column] for column in facets.T]
    crosses = [np.abs(np.cross(b - a, c - a)) for a, b, c in combinations(corners, 3)]
    greatest = np.max(crosses, axis=0)
    sizes = np.linalg.norm(greatest, axis=1, keepdims=True)
    return np.asarray(greatest / np.maximum(sizes, np.finfo(float).tiny))
