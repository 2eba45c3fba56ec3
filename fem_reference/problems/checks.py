"""Checks of bodies before they are solved. Errors name the invalid part."""

from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import Any

import numpy as np

from fem_reference.effects import Effect, Load
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import said
from fem_reference.foundations.mesh import Floats, Ints, TetMesh, place_of, sorted_corners, tet_volumes
from fem_reference.geometry.skins import Skin
from fem_reference.problems import directions, friction, loaded, regions, tendons
from fem_reference.problems.body import (
    Body,
    Cells,
    Prescribed,
    check_element,
    check_quadrature,
    outer_facets,
    reference_nodes,
)
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.touching import Touching, check_touching

SAME = 1e-6  # the fraction of the body's size by which two prescribed displacements of a point may differ
_FLAT = 1e-9  # a cell is flat if the determinant of three edges is below this fraction of its longest edge cubed
_FARTHEST = 1e9  # the maximum distance [mm] of a point from the origin
_MOST = 100_000  # the maximum number of frames
_MOST_CELLS = 10_000_000  # the maximum number of cells of a box
_SHORTEST, _LONGEST = 1e-6, 1e6  # the minimum edge of a box [mm], and the maximum ratio of two edges
_THINNEST = 1e6  # the limit of length / thickness of a cell; stiffnesses then differ by up to 1e12, its square


def check(body: Body, element: str, quadrature_degree: int | None = None) -> None:
    """Raise InputError unless ``body`` is valid, and ``element`` and ``quadrature_degree`` suit its cells and effects. All required
    regions and fibre directions must exist, all constraints must agree, and a solver must be able to follow them.
    """
    if not isinstance(body, Body):
        raise InputError("body", said(body), "a Body")
    _check_cells(body.mesh)
    _check_many("effects", body.effects, Effect, "effects")
    _check_many("prescribed", body.prescribed, Prescribed, "prescribed displacements")
    check_frames(body.frames, "frames")
    _check_rest(body)
    check_element(element, body.mesh.kind, body.mesh.degree, body.effects, "element")
    _check_prescribed(body.prescribed)
    fixed = [entry.on for entry in body.prescribed if isinstance(entry.on, str)]
    contact = [body.contact.on] if body.contact and isinstance(body.contact.on, str) else []
    loads = [effect.on for effect in body.effects if isinstance(effect, Load)]
    used = dict.fromkeys([*fixed, *contact, *loads, *(on for law in body.touching for on in (law.one, law.other))])
    for on in used:
        if on not in body.mesh.facets:
            raise InputError("on", f'"{on}"', f"a region of the body: {', '.join(map(str, body.mesh.facets))}")
    _check_regions(body.mesh, tuple(used))
    check_touching(body.touching, body.mesh.cells, body.mesh.facets, moved=body.start is not None)
    _check_needs(body)
    check_agreement(body)
    _check_start(body)
    check_quadrature(element, quadrature_degree, "quadrature_degree")


def check_box(counts: object, size: object, kind: object, degree: object) -> None:
    """Raise InputError unless the numbers of cells, the lengths, the kind of cell and the degree of a box are valid."""
    if not isinstance(counts, tuple | list) or len(counts) != 3 or not all(_is_integer(n) and n > 0 for n in counts):
        raise InputError("counts", said(counts), "numbers of cells along x, y, z, at least 1")
    if int(counts[0]) * int(counts[1]) * int(counts[2]) > _MOST_CELLS:
        raise InputError("counts", said(counts), f"at most {_MOST_CELLS} cells")
    if (
        not isinstance(size, tuple | list | np.ndarray)
        or getattr(size, "ndim", 1) != 1
        or len(size) != 3
        or not all(_is_number(one) and one > _SHORTEST for one in size)
    ):
        raise InputError("size", said(size), f"lengths along x, y, z, from {_SHORTEST:g} to {_FARTHEST:g} mm")
    if not max(size) < _LONGEST * min(size):
        raise InputError("size", said(size), f"edges whose lengths differ by a factor of less than {_LONGEST:g}")
    _check_kind("", kind, degree)


def _check_kind(place: str, kind: Any, degree: Any) -> None:
    if not isinstance(kind, str) or kind not in ("tetrahedron", "hexahedron"):
        raise InputError(f"{place}kind", said(kind), '"tetrahedron" or "hexahedron"')
    if not _is_integer(degree) or degree not in (1, 2):
        raise InputError(f"{place}degree", said(degree), "1 or 2")


def check_frames(frames: object, place: str) -> None:
    """Raise an InputError that names ``place`` unless ``frames`` are increasing numbers."""
    if (
        isinstance(frames, str | bytes)
        or not isinstance(frames, Sequence | np.ndarray)
        or len(frames) == 0
        or not all(_is_number(one) for one in frames)
    ):
        raise InputError(place, said(frames), "one or more frame numbers")
    if not all(early < late for early, late in pairwise(frames)):
        raise InputError(place, said(frames), "increasing frame numbers")
    if len(frames) > _MOST:
        raise InputError(place, f"{len(frames)} frame numbers", f"at most {_MOST}")


def _is_number(value: Any) -> bool:
    """True for a number of magnitude up to 1e9 that is not a bool."""
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    return number and bool(abs(value) <= _FARTHEST)


def _is_integer(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _check_many(place: str, given: Any, kind: type, want: str) -> None:
    if not isinstance(given, tuple | list):
        raise InputError(place, said(given), f"{want}, in a tuple")
    for i, one in enumerate(given):
        if not isinstance(one, kind):
            raise InputError(f"{place}[{i}]", said(one), f"{kind.__name__} records")


def _check_rest(body: Body) -> None:
    """Raise InputError if an optional part of a body has the wrong type."""
    if body.interval is not None and not (_is_number(body.interval) and body.interval > 0):
        raise InputError("interval", said(body.interval), "a time above 0 s, or None")
    for name in ("fibre", "start"):
        part = getattr(body, name)
        if part is not None and not callable(part):
            raise InputError(name, said(part), "a function, or None")
    _check_many("bones", body.bones, ContactBone, "bones")
    _check_many("touching", body.touching, Touching, "pairs of parts that may touch")
    if body.start is not None:
        begun = np.asarray(body.start(np.array(body.mesh.points)))
        if begun.shape != body.mesh.points.shape or not np.isfinite(begun).all():
            raise InputError("start", f"positions {begun.shape}, not all finite", "finite positions (n, 3) of points")
    if body.contact is not None and not isinstance(body.contact, ContactLaw):
        raise InputError("contact", said(body.contact), "a ContactLaw, or None")


def _check_cells(mesh: Any) -> None:
    """Raise InputError unless ``mesh`` has finite points, and valid cells and facets on these points."""
    if not isinstance(mesh, Cells):
        raise InputError("mesh", said(mesh), "Cells")
    _check_kind("mesh.", mesh.kind, mesh.degree)
    points = mesh.points
    if not isinstance(points, np.ndarray) or points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f":
        raise InputError("mesh.points", said(points), "an array (n, 3) of floats")
    if not (np.abs(points) <= _FARTHEST).all():
        raise InputError(
            "mesh.points", "a point that is not finite, or too far away", f"points within {_FARTHEST:g} mm"
        )
    nodes = len(reference_nodes(mesh.kind, mesh.degree))
    _check_indices("mesh.cells", mesh.cells, nodes, len(points))
    if not len(mesh.cells):
        raise InputError("mesh.cells", "none", "at least one")
    if not isinstance(mesh.facets, dict):
        raise InputError("mesh.facets", said(mesh.facets), "a dictionary of arrays by region")
    for name, facets in mesh.facets.items():
        _check_indices(f"mesh.facets[{name!r}]", facets, 3 if mesh.kind == "tetrahedron" else 4, len(points))
    _check_volumes(mesh)


def _check_indices(place: str, given: Any, width: int, count: int) -> None:
    integers = isinstance(given, np.ndarray) and given.dtype.kind in "iu"
    if not integers or given.ndim != 2 or given.shape[1] != width:
        raise InputError(place, said(given), f"an array of integers (m, {width})")
    if given.size and not (given.min() >= 0 and given.max() < count):
        raise InputError(place, f"index {int(given.min())} to {int(given.max())}", f"indices from 0 to {count - 1}")


def _check_volumes(mesh: Cells) -> None:
    corners = mesh.points[mesh.cells[:, [0, 1, 2, 3 if mesh.kind == "tetrahedron" else 4]]]
    edges = corners[:, 1:] - corners[:, :1]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    flat = np.flatnonzero(~(np.abs(np.linalg.det(edges)) > _FLAT * longest**3))
    if len(flat):
        raise InputError(f"mesh.cells[{flat[0]}]", "a cell without volume", "cells with a volume")


def _check_prescribed(prescribed: Sequence[Prescribed]) -> None:
    """Raise InputError if a prescribed displacement is invalid, or if two share a name, under which forces are reported."""
    names = [entry.name for entry in prescribed if isinstance(entry.name, str)]
    for entry in prescribed:
        place = f"prescribed.{entry.name}"
        if not isinstance(entry.name, str) or not isinstance(entry.on, str | Skin):
            raise InputError(f"{place}: name and on", f"{said(entry.name)}, {said(entry.on)}", "a text and a region")
        if names.count(entry.name) > 1:
            raise InputError("prescribed", f'"{entry.name}" twice', "a different name for each")
        axes = isinstance(entry.components, tuple | list) and len(entry.components) > 0
        axes = axes and all(_is_integer(one) and 0 <= one <= 2 for one in entry.components)
        if not axes or len(set(entry.components)) < len(entry.components):
            want = "axes among 0, 1, 2 for x, y, z, each once"
            raise InputError(f"{place}.components", said(entry.components), want)
        if not callable(entry.path):
            raise InputError(f"{place}.path", said(entry.path), "a function of points and a frame number")
        if entry.stiffness is None and not isinstance(entry.on, str):
            raise InputError(f"{place}.stiffness", "none on a skin", "springs")
        if entry.stiffness is not None and not (_is_number(entry.stiffness) and entry.stiffness > 0):
            raise InputError(f"{place}.stiffness", f"{entry.stiffness}", "a stiffness above 0, or None if exact")
        if entry.anchor is not None and (isinstance(entry.on, str) or len(entry.components) < 3):
            raise InputError(
                f"{place}.anchor", said(entry.anchor), "None, or springs at points of a skin along all axes"
            )


def _check_regions(mesh: Cells, names: tuple[str, ...]) -> None:
    """Raise InputError unless each region in ``names`` has facets, all of them on the boundary of the cells."""
    boundary = set(sorted_corners(outer_facets(mesh)[0]))
    for name in names:
        facets = set(sorted_corners(mesh.facets[name]))
        lost = sorted(facets - boundary)
        if not facets:
            raise InputError(f"facets.{name}", "none", "at least one facet on the boundary of the cells")
        if lost:
            some = f"{len(lost)} of {len(facets)}, the first with corners {lost[0]}"
            got = f"facets that do not belong to one cell each ({some})"
            raise InputError(f"facets.{name}", got, "facets on the boundary of the cells")


def _check_needs(body: Body) -> None:
    """Raise InputError if an effect needs fibre directions or times that the body lacks, or if directions are not unit vectors."""
    needs = {need for effect in body.effects for need in effect.needs}
    if body.interval is None and "interval" in needs:
        raise InputError("interval", "nothing", "the time from a frame number to the next, which an effect needs")
    if "fibre" not in needs:
        return
    if body.fibre is None:
        raise InputError("fibre", "nothing", "fibre directions, which an effect needs")
    for places in body.mesh.places():
        directions.check_unit(body.fibre, places)


def check_agreement(body: Body) -> None:
    """Raise InputError if the parts of a body do not agree, or if a path cannot be followed.

    In every part of the body the required laws must act (``regions.check``), and the normal of a law must not be along fibres. A
    tendon or friction must not be combined with tension at rest, and a load must not act only along exactly prescribed axes. Two
    regions must not prescribe different exact displacements at shared points; displacements are compared at all frames, at all
    stops, and halfway between them.
    """
    regions.check(body)
    directions.check_normals(body)
    tendons.check(body)
    loaded.check(body)
    friction.check(body.frictions, begun=body.begun)
    ends = np.unique([*body.frames, *body.stops])
    sampled = np.unique(np.concatenate([ends, (ends[1:] + ends[:-1]) / 2]))
    exact = [entry for entry in body.prescribed if entry.stiffness is None and isinstance(entry.on, str)]
    for one, other in combinations(exact, 2):
        common = sorted(set(one.components) & set(other.components))
        places = _shared(body.mesh, str(one.on), str(other.on)) if common else np.zeros((0, 3))
        for frame in sampled if len(places) else ():
            found = [entry.displacements(places, frame)[:, common] for entry in (one, other)]
            off = np.abs(found[0] - found[1]).max(axis=1)
            if not off.max() <= SAME * (body.size + np.abs(found).max()):
                x, y, z = places[np.argmax(off)]
                got = f"displacements {off.max():.4g} mm apart at ({x:.4g}, {y:.4g}, {z:.4g}) mm at frame {frame:g}"
                raise InputError(f'prescribed "{one.name}" and "{other.name}"', got, "the same at shared points")


def _check_start(body: Body) -> None:
    """Raise InputError if a prescribed displacement is not zero at the first frame of a body that starts at rest."""
    for entry in body.prescribed if body.start is None else ():
        off = np.abs(entry.displacements(body.points_on(entry.on), body.frames[0])).max(initial=0.0)
        if not off <= SAME * body.size:
            place = f'prescribed "{entry.name}": path at frame {body.frames[0]:g}'
            got = f"displacements up to {off:.4g} mm"
            raise InputError(place, got, "none at the first frame, where the body is at rest")


def _shared(mesh: Cells, one: str, other: str) -> Floats:
    """The corners and midpoints of edges (n, 3) [mm] that two regions share."""
    count = len(mesh.points)

    def edges(name: str) -> Ints:
        facets = np.sort(mesh.facets[name].astype(np.int64), axis=1)  # 64 bits for products of two indices
        pairs = facets[:, list(combinations(range(facets.shape[1]), 2))]
        return np.asarray(pairs[..., 0] * count + pairs[..., 1])

    corners = np.intersect1d(mesh.facets[one], mesh.facets[other])
    both = np.divmod(np.intersect1d(edges(one), edges(other)), count)
    return np.concatenate([mesh.points[corners], mesh.points[np.stack(both, axis=1)].mean(axis=1)])


def check_thinness(mesh: TetMesh) -> None:
    """Raise InputError if a cell is too thin for double precision."""
    corners = mesh.points[mesh.tets]
    longest = np.linalg.norm(corners[:, [0, 0, 0, 1, 1, 2]] - corners[:, [1, 2, 3, 2, 3, 3]], axis=2).max(axis=1)
    ratios = longest**3 / (6 * tet_volumes(mesh.points, mesh.tets))
    worst = int(np.argmax(ratios))
    if not ratios[worst] < _THINNEST:
        place = f"cell {worst} at {place_of(corners[worst].mean(axis=0))}"
        want = f"less than {_THINNEST:g}, for double precision"
        raise InputError(place, f"{ratios[worst]:.1e} times as long as thick", want)
