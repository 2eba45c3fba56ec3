"""Several bodies joined into one body, each as a separate piece of its mesh. The pieces may be in contact."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem_reference.effects import Effect, Energy, Load, region_of
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.fibres import Directions
from fem_reference.geometry.regions import Region
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.checks import check_agreement
from fem_reference.problems.contact import ContactLaw
from fem_reference.problems.shapes import joined
from fem_reference.problems.touching import Touching

Range = tuple[int, int]


@dataclass(frozen=True)
class Span:
    """The slices of the joined arrays that belong to one muscle: ``vertices`` of the surface, points of ``fibres``, ``points`` of
    the mesh, and ``cells``.
    """

    name: str
    vertices: slice
    fibres: slice
    points: slice
    cells: slice


def called(piece: str, name: str) -> str:
    """The name, in the joined body, of the part that is called ``name`` in the body ``piece``."""
    return f"{piece} {name}"


@dataclass(frozen=True, eq=False)
class DirectionsByPiece:
    """The fibre directions in a joined body. ``ranges``: the range of cells of each piece; ``of``: the fibre directions of each
    piece, None for a piece without fibres, in which the direction is along x.
    """

    ranges: tuple[Range, ...]
    of: tuple[Directions | None, ...]

    def __call__(self, cells: Ints, points: Floats) -> Floats:
        """Unit vectors (n, 3) at ``points`` (n, 3) in ``cells`` (n,)."""
        found = np.tile([1.0, 0.0, 0.0], (len(points), 1))
        for (first, last), directions in zip(self.ranges, self.of, strict=True):
            own = (cells >= first) & (cells < last)
            if directions is not None and own.any():
                found[own] = directions(cells[own] - first, points[own])
        return found


@dataclass(frozen=True, eq=False)
class Share:
    """The share of points in a ``region``, or outside the region if ``outside`` is True; 1 everywhere if ``region`` is None."""

    region: Region | None = None
    outside: bool = False

    def __call__(self, points: Floats) -> Floats:
        """The shares (n,) of ``points`` (n, 3)."""
        if self.region is None:
            return np.ones(len(points))
        return 1 - self.region(points) if self.outside else self.region(points)


def join(bodies: Mapping[str, Body], touching: tuple[Touching, ...] = ()) -> Body:
    """Join ``bodies``, by name, into one body. ``touching``: the laws of contact between facets of the joined body.

    Effects common to all bodies act everywhere; any other effect acts in the cells of its body. Raises InputError if the bodies
    differ in properties that they must share.
    """
    ends = np.cumsum([0, *(len(one.mesh.cells) for one in bodies.values())]).tolist()
    ranges = {name: (first, last) for name, first, last in zip(bodies, ends, ends[1:], strict=False)}
    some = next(iter(bodies.values()))
    mesh = joined({name: one.mesh for name, one in bodies.items()})
    mesh = replace(
        mesh,
        facets={
            called(name, on): mesh.facets[f"{name}_{on}"] for name, one in bodies.items() for on in one.mesh.facets
        },
    )
    effects, regions, within = _acting(bodies, ranges)
    body = Body(
        mesh,
        effects,
        tuple(_prescribed(bodies, ranges)),
        _frames(bodies, touching),
        fibre=DirectionsByPiece(tuple(ranges.values()), tuple(one.fibre for one in bodies.values())),
        contact=_contact(bodies, ranges),
        bones=some.bones,
        interval=some.interval,
        regions=regions,
        touching=touching,
        within=within,
    )
    if all(one.fibre is None for one in bodies.values()):
        body = replace(body, fibre=None)
    check_agreement(body)
    return body


def _frames(bodies: Mapping[str, Body], touching: tuple[Touching, ...]) -> tuple[float, ...]:
    """The frames of the joined body, beginning with the earliest frame at which the removal of an overlap at rest begins."""
    found = min((one.frames for one in bodies.values()), key=lambda frames: frames[0])
    begin = min((law.relaxed[0] for law in touching if law.relaxed is not None), default=found[0])
    return (begin, *found) if begin < found[0] else found


def _acting(
    bodies: Mapping[str, Body], ranges: Mapping[str, Range]
) -> tuple[tuple[Effect, ...], dict[str, Region], dict[str, Range]]:
    """The effects of the joined body, the regions in which effects of a single body act, and the range of cells of each region."""
    effects, regions, within = list[Effect](), dict[str, Region](), dict[str, Range]()
    for name, body in bodies.items():
        for effect in body.effects:
            alike = (
                not isinstance(effect, Load)
                and not region_of(effect)
                and all(effect in one.effects for one in bodies.values())
            )
            if alike:
                effects += [] if effect in effects else [effect]
                continue
            if isinstance(effect, Load) and not region_of(effect):
                effects.append(effect.model_copy(update={"on": called(name, effect.on)}))
                continue
            if not isinstance(effect, Energy) or "momentum" in effect.needs:
                want = "the same values on all muscles"
                raise InputError(f"{name}: {effect.title}", "an effect without a region", want)
            region = region_of(effect)
            where = called(name, region) if region else name
            inner = body.regions[region.removeprefix(REST)] if region else None
            regions[where], within[where] = Share(inner, region.startswith(REST)), ranges[name]
            effects.append(effect.model_copy(update={"region": where}))
    _check_pressure(bodies)
    return tuple(effects), regions, within


def _check_pressure(bodies: Mapping[str, Body]) -> None:
    """Raise InputError if one body has an unknown, such as the pressure, that another lacks."""
    brought = {name: {one for effect in body.effects for one in effect.unknowns} for name, body in bodies.items()}
    if len({frozenset(one) for one in brought.values()}) > 1:
        got = "; ".join(f"{name}: {', '.join(sorted(one)) or 'none'}" for name, one in brought.items())
        raise InputError("effects", f"unknowns that differ ({got})", "the same for all muscles")


def _prescribed(bodies: Mapping[str, Body], ranges: Mapping[str, Range]) -> Iterator[Prescribed]:
    """Yield all prescribed displacements, with their names in the joined body."""
    for name, body in bodies.items():
        for entry in body.prescribed:
            on = called(name, entry.on) if isinstance(entry.on, str) else _moved(entry.on, ranges[name][0])
            yield replace(entry, name=called(name, entry.name), on=on)


def _moved(skin: Skin, first: int) -> Skin:
    """The ``skin`` with ``first`` added to the indices of its cells."""
    return replace(skin, cells=skin.cells + first)


def _contact(bodies: Mapping[str, Body], ranges: Mapping[str, Range]) -> ContactLaw | None:
    """The law of contact of the joined body with bones, with the points of all bodies; None without contact."""
    laws: dict[str, Any] = {name: one.contact for name, one in bodies.items() if one.contact is not None}
    if not laws:
        return None
    ends = np.cumsum([0, *(len(law.on.points) for law in laws.values())]).tolist()
    skins = [_moved(law.on, ranges[name][0]) for name, law in laws.items()]
    skin = Skin(*(np.concatenate([getattr(one, key) for one in skins]) for key in ("cells", "points", "areas")))
    known = {(law.stiffness, law.smoothing, law.in_situ, law.friction) for law in laws.values()}
    if len(known) > 1 or len(laws) < len(bodies):
        raise InputError("contact", "contact that differs between muscles or is missing in some", "the same for all")
    relaxed = next((law.relaxed for law in laws.values() if law.relaxed is not None), None)
    parts = tuple(zip(laws, ends, ends[1:], strict=False))
    some: ContactLaw = next(iter(laws.values()))
    return replace(some, on=skin, relaxed=relaxed, parts=parts)
