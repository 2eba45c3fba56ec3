"""The regions of a muscle as stated in its case, their sizes in words, and checks of the regions of any body."""

from collections.abc import Callable
from itertools import combinations

import numpy as np

from fem_reference.effects import Energy, Load, State, region_of
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.mesh import Floats, Surface, TetMesh, check_closed, enclosed_volume, place_of
from fem_reference.foundations.records import join
from fem_reference.geometry.fibres import fibre_field
from fem_reference.geometry.regions import Around, Between, Blended, Depth, Inside, Region, Union, samples
from fem_reference.geometry.sectors import attached_shares
from fem_reference.io import files
from fem_reference.problems.anatomy import field_mesh
from fem_reference.problems.body import Body
from fem_reference.problems.setup import Setup
from fem_reference.scenes.muscle import MuscleCase

_LEAST = 0.5  # the smallest accepted sum, at a point, of the shares of all laws of a kind
# The smallest accepted maximum of the share in a region. The maximum is low if the width of the region exceeds its depth.
_REACHED = 0.25
_ROUNDED = 1e-6  # the rounding error of a sum of shares
_SURE = 0.99  # the maximum share in a region is reported if it is below this
_SEEN = 1e-3  # an overlap is reported if its fraction of the volume is above this


def of_case(case: MuscleCase, rest: Setup, fill: Callable[[float], TetMesh]) -> dict[str, Region]:
    """The regions of a case with the set-up ``rest``, by name. Regions with the same name are united.

    ``fill``: a function that fills the muscle with tetrahedra of a given size [mm], for regions that need tetrahedra.
    """
    found: dict[str, list[Region]] = {}
    for i, region in enumerate(case.region):
        found.setdefault(region.name, []).append(Blended(_depth(case, i, rest, fill), region.width))
    return {name: parts[0] if len(parts) == 1 else Union(tuple(parts)) for name, parts in found.items()}


def _depth(case: MuscleCase, i: int, rest: Setup, fill: Callable[[float], TetMesh]) -> Depth:
    """The depth of points in ``case.region[i]``, as a function."""
    region, key = case.region[i], f"region[{i}]"
    if (near := region.attachment) is not None:
        shares = next(
            attached_shares(rest.surface, one.vertices) for one in rest.attached if one.attachment == near.name
        )
        whole = shares.all(axis=1) if shares.all(axis=1).any() else shares.any(axis=1)
        return Around(Surface(rest.surface.points, rest.surface.triangles[whole]), near.length)
    if (patch := region.patch) is not None:
        return Around(files.read_surface(case.file(patch.file, f"{key}.patch.file"), patch.unit), patch.depth)
    if (closed := region.surface) is not None:
        place = join(case.place, f"{key}.surface.file")
        given = files.read_surface(case.file(closed.file, f"{key}.surface.file"), closed.unit)
        return Inside(check_closed(Surface(given.points, given.triangles, f"{place}: {given.place}")))
    if (tets := region.tets) is not None:
        path = case.file(tets.file, f"{key}.tets.file")
        return Inside(check_closed(files.read_labelled(path, tets.unit, tets.array, tets.labels)))
    share = region.field
    assert share is not None  # a CaseRegion record has one of the five
    return Between(fibre_field(field_mesh(rest.surface, fill), share.start, share.end), share.first, share.last)


def facts(rest: Setup) -> dict[str, str]:
    """The volume of each region of a muscle, and of the overlap of each pair of regions, in words."""
    points, volume = samples(rest.surface), enclosed_volume(rest.surface.points, rest.surface.triangles)
    shares = {name: region(points) for name, region in rest.regions.items()}

    def size(share: Floats) -> str:
        return f"{100 * share.mean():.3g} % of the volume, {share.mean() * volume:.4g} mm3"

    found = {name: size(share) for name, share in shares.items()}
    for name, share in shares.items():
        if (most := float(share.max(initial=0.0))) < _SURE:
            found[name] += f", with a share of {most:.3g} at most: its width is greater than its depth"
    for (one, a), (other, b) in combinations(shares.items(), 2):
        if (a * b).mean() > _SEEN:
            found[f"{one} and {other} overlap in"] = size(a * b)
    return found


def check(body: Body) -> None:
    """Raise InputError if an effect acts in a region that does not exist or whose share is below 0.25 everywhere, if shares are not
    from 0 to 1, or if a part of the body lacks an isochoric law, a volumetric law, or a law for the pressure unknown.
    """
    named = {i: region for i, effect in enumerate(body.effects) if (region := region_of(effect))}
    for i, region in named.items():
        if region.removeprefix(REST) not in body.regions:
            want = f"a region of the body: {', '.join(body.regions) or 'it has none'}"
            raise InputError(f"effects[{i}].in", f'"{region}"', want)
    if not named:
        return
    places = list(body.mesh.places())
    points = np.concatenate(places)
    at = State(F=(), regions=body.shares(points, np.tile(np.arange(len(places[0])), len(places))))
    for i, region in named.items():
        share = at.share(region)
        if not (share.min() >= 0 and share.max() <= 1):
            raise InputError(f"regions: {region}", f"shares from {share.min():g} to {share.max():g}", "from 0 to 1")
        # The shares of a membrane are evaluated at the corners of facets.
        if isinstance(effect := body.effects[i], Load) and effect.on in body.mesh.facets:
            corners = body.points_on(effect.on)
            share = State(F=(), regions=body.shares(corners, np.zeros(len(corners), int))).share(region)
        if (most := float(share.max(initial=0.0))) < _REACHED:
            got = f"whose share is at most {most:.2g}" if most else "which is nowhere in the body"
            want = f"a share of {_REACHED:g} somewhere: more depth, or less width"
            raise InputError(f"effects[{i}].in", f'"{region}", {got}', want)
    laws = [effect for effect in body.effects if isinstance(effect, Energy)]
    _check_whole("isochoric", [law for law in laws if law.moduli().shear], at, points)
    _check_whole("volumetric", [law for law in laws if law.moduli().bulk and not law.unknowns], at, points)
    _check_whole("pressure", [law for law in laws if law.unknowns], at, points)


def _check_whole(kind: str, laws: list[Energy], at: State, points: Floats) -> None:
    """Raise InputError unless the shares of all ``laws`` of a ``kind`` sum to at least 0.5 at each of ``points`` (n, 3), and to 1
    for laws with a pressure unknown. ``at``: the state with the shares at these points. Without laws nothing is checked.
    """
    total = np.zeros(len(points)) + sum(at.share(law.region) for law in laws)
    off = np.abs(total - 1) - _ROUNDED if kind == "pressure" else _LEAST - total
    if laws and not off.max() <= 0:
        named, worst = ", ".join(law.title for law in laws), int(off.argmax())
        got = f"{kind} laws ({named}) with a share of {total[worst]:.3g} at {place_of(points[worst])}"
        want = "1 everywhere" if kind == "pressure" else f"at least {_LEAST:g} everywhere"
        raise InputError("effects", got, f'{want}: a law without "in", or one in "NAME" and one in "{REST}NAME"')
