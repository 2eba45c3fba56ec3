"""Bodies of any shape: straight or curved cells, boundary conditions, effects and contact.

This module is independent of any solver.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from typing import ClassVar, Literal

import numpy as np

from fem_reference.effects import Effect, in_situ, moduli, regions_named
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, diagonal
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.fibres import Directions
from fem_reference.geometry.regions import Region
from fem_reference.geometry.skins import Skin
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.problem import NOTHING, AtRest, Task
from fem_reference.problems.resolved_paths import Moving, moving_ramp, posed, some, stops, turning
from fem_reference.problems.touching import Touching

_OUTWARDS = 0.7  # fields are also checked at this fraction of the distance from the centre of a cell to each node
Kind = Literal["tetrahedron", "hexahedron"]
# For each element: the kind of cell, the degree of the displacement, and the degree of the pressure (None: no pressure unknown; 0:
# constant in each cell). If both degrees are equal, solvers stabilise the pressure (``is_stabilised``).
ELEMENTS: dict[str, tuple[Kind, int, int | None]] = {
    "P1": ("tetrahedron", 1, None),
    "P1/P1": ("tetrahedron", 1, 1),
    "P2": ("tetrahedron", 2, None),
    "P2/P0": ("tetrahedron", 2, 0),
    "P2/P1": ("tetrahedron", 2, 1),
    "Q1": ("hexahedron", 1, None),
    "Q2": ("hexahedron", 2, None),
    "Q1/P0": ("hexahedron", 1, 0),
    "Q2/Q1": ("hexahedron", 2, 1),
}


def is_stabilised(element: str) -> bool:
    """True if displacement and pressure have the same degree, so that the pressure would oscillate without stabilisation.

    Solvers add the energy ``-1 / (4 mu) integral of (p - its mean in the cell)^2``, which decreases with the square of the cell
    size. The shear modulus mu of the cell at rest is the mean of the second derivatives of its energy with respect to F_ij, i != j.

    Source: Dohrmann and Bochev 2004, doi 10.1002/fld.752; with 2 mu as in White and Borja 2008, doi 10.1016/j.cma.2008.05.015.
    """
    _, displacement, pressure = ELEMENTS[element]
    return displacement == pressure


def outer_facets(mesh: "Cells") -> tuple[Ints, Ints]:
    """The facets that belong to one cell only: corners (f, 3 or 4), in the order of ``facet_corners``, and the cells (f,)."""
    sides = np.array(facet_corners(mesh.kind))
    every = mesh.cells[:, sides].reshape(-1, sides.shape[1])
    found = distinct(np.sort(every, axis=1))
    outer = found.first[found.counts == 1]
    return every[outer], outer // len(sides)


def facet_corners(kind: Kind) -> list[tuple[int, ...]]:
    """The indices of the corners of each facet of a cell, in increasing order."""
    if kind == "tetrahedron":
        return list(combinations(range(4), 3))
    corners = reference_nodes(kind, 1)
    return [tuple(np.flatnonzero(corners[:, axis] == end).tolist()) for axis in range(3) for end in (0, 1)]


def check_element(element: str, kind: Kind, degree: int, effects: tuple[Effect, ...], place: str) -> None:
    """Raise an InputError that names ``place`` unless the ``element``, a key of ``ELEMENTS``, suits the cells and the effects.

    The displacement must have at least the ``degree`` of the cells. The element must have a pressure if and only if an effect needs
    the pressure as an unknown.
    """
    if element not in ELEMENTS:
        raise InputError(place, f'"{element}"', f"one of {', '.join(ELEMENTS)}")
    brings = any("pressure" in effect.unknowns for effect in effects)
    fitting = [
        name
        for name, (other, order, pressure) in ELEMENTS.items()
        if other == kind and order >= degree and (pressure is not None) == brings
    ]
    if element not in fitting:
        cells = f"{'curved ' if degree > 1 else ''}{kind} cells"
        pressure = "with a pressure, which an effect needs" if brings else "without a pressure, which no effect needs"
        raise InputError(place, f'"{element}"', f"an element for {cells} {pressure}: {', '.join(fitting)}")


def check_stiffness(effects: tuple[Effect, ...], place: str) -> None:
    """Raise an InputError that names ``place`` unless laws resist both shear and volume change at rest; fibres resist neither."""
    found = moduli(effects)
    for kind, modulus, law in (("shape", found.shear, "neo_hooke"), ("volume", found.bulk, "incompressible")):
        if not modulus > 0:
            got = f"effects that do not resist a change of {kind} at rest"
            raise InputError(place, got, f'a law that resists it, such as "{law}", besides fibres and loads')


def check_quadrature(element: str, degree: int | None, place: str) -> None:
    """Raise InputError if quadrature of a ``degree`` cannot integrate the variation of a stabilised pressure in a cell."""
    if degree == 1 and is_stabilised(element):
        raise InputError(place, degree, f"2 or more for {element}, whose pressure is stabilised")


def reference_nodes(kind: Kind, degree: int) -> Floats:
    """The positions (k, 3) of the nodes of the reference cell (the unit tetrahedron or the unit cube), in the order of
    ``Cells.cells``: the corners, sorted by (z, y, x), and then, for degree 2, the other nodes, sorted in the same way.
    """
    ticks = np.arange(3) / 2
    x, y, z = (axis.ravel() for axis in np.meshgrid(ticks, ticks, ticks, indexing="ij"))
    nodes = np.stack([z, y, x], axis=1)
    if kind == "tetrahedron":
        nodes = nodes[nodes.sum(axis=1) <= 1]
    corner = np.isin(nodes, (0, 1)).all(axis=1)
    return nodes[corner] if degree == 1 else np.concatenate([nodes[corner], nodes[~corner]])


@dataclass(frozen=True, eq=False)
class Cells:
    """The mesh of a body. ``points`` (n, 3) [mm]: the points at rest. ``cells`` (m, k): the indices of the points of each cell, in
    the order of :func:`reference_nodes`. ``degree``: 1 for straight cells, 2 for curved cells. ``facets``: the corners (f, 3 or 4)
    of the facets of each region of the surface, by name.
    """

    points: Floats
    cells: Ints
    kind: Kind
    degree: int
    facets: dict[str, Ints]

    def places(self) -> Iterator[Floats]:
        """Yield places (m, 3) [mm] for checks of fields, one in each cell: first the centres, then points near each node."""
        nodes = self.points[self.cells]
        middles = nodes.mean(axis=1)
        yield middles
        for corner in np.swapaxes(nodes, 0, 1):
            yield middles + _OUTWARDS * (corner - middles)


@dataclass(frozen=True, eq=False)
class Prescribed:
    """A prescribed displacement of a part of the surface, exact or by springs.

    ``name``: the name under which the reaction force is reported. ``on``: the name of a region in ``Cells.facets``, or a skin.
    ``components``: the prescribed axes, 0, 1, 2 for x, y, z. ``path``: a picklable function of rest points (n, 3) [mm] and a frame
    number that returns displacements (n, 3) [mm]. ``stiffness`` [MPa/mm]: the stiffness per unit area of springs that pull towards
    the path; None if the displacement is exact. On a skin only springs are possible.

    ``anchor`` [mm]: the rest position of a point that follows the path. If it is given, the springs of the skin are straight
    tendons to this point, which pull while they are longer than at rest.
    """

    name: str
    on: str | Skin
    components: tuple[int, ...]
    path: Callable[[Floats, float], Floats]
    stiffness: float | None = None
    anchor: tuple[float, float, float] | None = None

    def displacements(self, points: Floats, frame: float) -> Floats:
        """The displacements (n, 3) [mm] of ``points`` (n, 3), 0 along axes that are free. Raises InputError if the path fails."""
        place, want = f'prescribed "{self.name}": path at frame {frame:g}', "displacements (n, 3) of points (n, 3)"
        try:
            found = np.asarray(self.path(np.array(points), frame))
            if np.iscomplexobj(found):
                raise TypeError("complex numbers")
            found = np.asarray(found, float)
        except Exception as error:  # any error in a function of the caller
            raise InputError(place, f"{type(error).__name__}: {error}", want) from error
        if found.shape != points.shape:
            raise InputError(place, f"displacements {found.shape} of points {points.shape}", want)
        return np.asarray(np.where(np.isin(np.arange(3), self.components), found, 0.0))

    def moving(self, points: Floats) -> Moving:
        """The motion of ``points`` (n, 3) [mm] along the path."""
        name, known = f'prescribed "{self.name}"', turning(self.path, points)
        return Moving(name, lambda frame: points + self.displacements(points, frame), known)


@dataclass(frozen=True, eq=False)
class ByCell:
    """Fibre directions that are constant in each cell: unit vectors (m, 3)."""

    vectors: Floats

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """The directions (n, 3) in ``cells`` (n,)."""
        return np.asarray(self.vectors[cells])


@dataclass(frozen=True, eq=False)
class Body:
    """A body: a ``mesh`` with ``effects`` and ``prescribed`` displacements, at rest at ``frames[0]`` unless it has a ``start``.

    A load acts on the facets of the region that its ``on`` names. ``contact``: the law of contact with all ``bones``, None without
    contact. ``touching``: the laws of contact between parts of the surface. ``interval`` [s]: the time between consecutive frame
    numbers, None if nothing depends on time. ``start``: a function from rest points (n, 3) to their positions at ``frames[0]``.
    ``regions``: the regions in which effects act, by name. ``within``: for regions in only one of
    several pieces of the mesh, the range of cells to which each is limited, by the name of the region.
    """

    mesh: Cells
    effects: tuple[Effect, ...]
    prescribed: tuple[Prescribed, ...]
    frames: tuple[float, ...]
    fibre: Directions | None = None
    contact: ContactLaw | None = None
    bones: tuple[ContactBone, ...] = ()
    interval: float | None = None
    start: Callable[[Floats], Floats] | None = None
    regions: Mapping[str, Region] = field(default_factory=dict)
    touching: tuple[Touching, ...] = ()
    within: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    task: ClassVar[Task] = "solve_body"
    rest: ClassVar[AtRest] = NOTHING

    @property
    def first(self) -> float:
        """The first requested frame. An overlap at rest is removed before this frame."""
        return next((frames[1] for frames in self._relaxed), self.frames[0])

    @property
    def _relaxed(self) -> list[tuple[float, float]]:
        """The pairs of frames between which overlaps at rest are removed."""
        found = [law.relaxed for law in self.touching] + ([self.contact.relaxed] if self.contact else [])
        return [frames for frames in found if frames is not None]

    @property
    def begun(self) -> bool:
        """True unless the body starts at rest and free of stress."""
        tense = in_situ.among(self.effects) is not None
        return self.start is not None or tense or (self.contact is not None and self.contact.in_situ is not None)

    @property
    def rubs(self) -> bool:
        """True if there is friction, so that a state depends on the load path."""
        return any(one is not None for one in self.frictions)

    @property
    def has_energy(self) -> bool:
        """True if contact has an energy, so that its tangent is symmetric: without friction and without ``own_normals``."""
        return not (self.rubs or any(law.own_normals for law in self.touching))

    @property
    def remembers(self) -> bool:
        """True if contact depends on earlier states: if there is friction, or a part of the surface touches itself."""
        return self.rubs or any(law.one == law.other for law in self.touching)

    @property
    def frictions(self) -> list[float | None]:
        """The coefficients of friction of the contact with bones and of each pair of touching parts; None without friction."""
        own = [self.contact.friction] if self.contact else []
        return [*own, *(law.friction for law in self.touching)]

    @property
    def size(self) -> float:
        """The diagonal of the bounding box of the body [mm]."""
        return diagonal(self.mesh.points)

    def shares(self, points: Floats, cells: Ints) -> dict[str, Floats]:
        """The shares (n,) of points in each region that an effect names, by the name of the region.

        ``points`` (n, 3) [mm]: the rest positions of the points; ``cells`` (n,): the cells in which they are.
        """
        found = {name: self.regions[name](points) for name in regions_named(self.effects)}
        for name in set(found) & set(self.within):
            first, last = self.within[name]
            found[name] = np.where((cells >= first) & (cells < last), found[name], 0.0)
        return found

    def points_on(self, on: str | Skin) -> Floats:
        """The corners (n, 3) [mm] of the facets of a region, or the points of a skin, at rest."""
        return self.mesh.points[np.unique(self.mesh.facets[on])] if isinstance(on, str) else on.points

    @cached_property
    def stops(self) -> tuple[float, ...]:
        """The frame numbers at which load steps must end, so that no step skips motion or the end of the removal of an overlap.

        Raises InputError if a path cannot be followed.
        """
        things = [entry.moving(some(self.points_on(entry.on))) for entry in self.prescribed]
        things += [posed(f'bone "{one.name}"', one.pose, self.mesh.points) for one in self.bones]
        ramps = (moving_ramp(effect, self.size) for effect in self.effects)
        found = stops([*things, *(ramp for ramp in ramps if ramp)], self.frames, self.size)
        ends = {last for _, last in self._relaxed if self.frames[0] < last < self.frames[-1]}
        return tuple(sorted({*found, *ends}))
