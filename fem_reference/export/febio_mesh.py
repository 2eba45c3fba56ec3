"""Nodes, elements, node sets and surfaces in FEBio's input file."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference.export.febio_regions import MUSCLE, parts
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import (
    Floats,
    Ints,
    Surface,
    TetMesh,
    boundary,
    corner_areas,
    enclosed_volume,
    found_in,
)
from fem_reference.geometry.distance import distances
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone

# The pairs of corners between which the mid-side nodes of a tet10 lie; the first three pairs are also those of a tri6.
EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])
FACING = [0, 2, 1, 5, 4, 3]  # the order of the nodes of a tri6 that reverses its normal
# Springs at points are small rigid triangles. SHRUNK: their area / the point's tributary area; the penalty is divided by it too.
SHRUNK = 0.01
_LEAST_AREA = 1e-6  # a point has no spring if its tributary area is less than this fraction of the largest
_CLEAR = 0.005  # barycentric distance of the triangles at points from edges of a facet, so that no ray misses the facet


def leaf(parent: Element, tag: str, text: object, **attributes: str) -> None:
    """Add an XML element that contains only a text."""
    SubElement(parent, tag, attributes).text = str(text)


def leaves(parent: Element, values: Mapping[str, object]) -> None:
    """Add an XML element for each tag in ``values``, with the value as its text."""
    for tag, value in values.items():
        leaf(parent, tag, value)


def rows(parent: Element, tag: str, values: Iterable[Sequence[float]], first: int = 1) -> None:
    """Add XML elements with the same ``tag`` and the numbers ``first``, ``first + 1``, ..., with all digits of their ``values``."""
    for number, row in enumerate(values, start=first):
        leaf(parent, tag, ",".join(map(repr, row)), id=str(number))


def vector(values: Iterable[float]) -> str:
    """The text of a list of numbers in FEBio's format, with all digits."""
    return ",".join(repr(float(value)) for value in values)


def bone_id(bone: Bone) -> str:
    """The name of a bone in the file, which is also the name of its material and of its elements."""
    return f"bone_{bone.name}"


def springs_id(attached: AttachedVertices) -> str:
    """The name, in the file, of the springs of an attachment. The names of their shells and surfaces begin with it."""
    return f"springs_{attached.attachment}"


def by_springs(problem: MuscleProblem) -> list[AttachedVertices]:
    """The attachments by springs."""
    return [attached for attached in problem.attached if attached.stiffness is not None]


def exactly(problem: MuscleProblem) -> list[AttachedVertices]:
    """The attachments whose nodes move exactly with their bone."""
    return [attached for attached in problem.attached if attached.stiffness is None]


def quadratic(mesh: TetMesh) -> tuple[Floats, Ints]:
    """The points (n, 3) [mm] and tetrahedra (k, 10) of a mesh with an additional node at the midpoint of each edge.

    Nodes are in FEBio's order, and corners keep their indices.
    """
    ends = np.sort(mesh.tets[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middles = len(mesh.points) + number.reshape(-1, len(EDGES))
    return np.vstack([mesh.points, mesh.points[edges].mean(axis=1)]), np.hstack([mesh.tets, middles])


def outward(surface: Surface) -> Surface:
    """The ``surface`` with outward normals."""
    turned = enclosed_volume(surface.points, surface.triangles) < 0
    return Surface(surface.points, surface.triangles[:, ::-1]) if turned else surface


def free_facets(problem: MuscleProblem) -> Ints:
    """The facets (m, 3) of the contact surface: those on the boundary that are not attached and whose centroid is not exempt.

    Raises InputError if there are none.
    """
    outer, _ = boundary(problem.mesh.tets)
    attached = np.concatenate([np.zeros((0, 3), np.int64), *problem.mesh.facets.values()])
    loose = outer[~found_in(outer, attached)]
    middles = problem.mesh.points[loose].mean(axis=1)
    away, _ = problem.exempt.away(distances(middles, problem.surface).triangle, middles)
    felt = loose[away > problem.exempt.reach]
    if len(felt) == 0:
        got = f"no facet of the tetrahedra farther than {problem.exempt.reach:.2g} mm from attached parts"
        raise InputError("contact", got, "smaller tetrahedra (muscle.tet_size), or a case without the effect contact")
    return felt


class SpringPoints(NamedTuple):
    """The points of the tetrahedra at which springs act.

    ``of`` (n,): the indices of points on the attached skin. ``points`` (n, 3) [mm]: the nearest points on the boundary of the mesh.
    ``facets`` (n, 3): the facets that contain them. ``corners`` (n, 3, 3) [mm]: small triangles around the points, which face the
    attached skin.
    """

    of: Ints
    points: Floats
    facets: Ints
    corners: Floats


def spring_points(problem: MuscleProblem, attached: AttachedVertices) -> SpringPoints:
    """The points of the tetrahedra at which springs act, for an attachment with springs at points of the surface.

    FEBio's ``tied-elastic`` subtracts the gap at rest. Therefore a triangle in the plane of a facet acts as a spring at a point, if
    its area is the fraction ``SHRUNK`` of the tributary area of the point.
    """
    skin, outer = problem.attached_skins[attached.attachment], boundary(problem.mesh.tets)[0]
    of = np.flatnonzero(skin.areas > _LEAST_AREA * skin.areas.max(initial=0.0))
    near = distances(skin.points[of], Surface(problem.mesh.points, outer))
    corners = problem.mesh.points[outer[near.triangle]]
    scale = np.sqrt(SHRUNK * skin.areas[of] / corner_areas(corners))[:, None]
    least = scale / 3 + _CLEAR
    more = np.maximum(near.barycentric - least, 0.0)  # the parts above ``least``, which are scaled below
    inside = least + more * (1 - 3 * least) / more.sum(axis=1, keepdims=True)
    points = np.einsum("nc,nci->ni", inside, corners)
    small = points[:, None] + scale[:, :, None] * (corners - corners.mean(axis=1, keepdims=True))
    return SpringPoints(of, points, outer[near.triangle], small[:, FACING[:3]])


class Mesh:
    """Nodes, elements, node sets and surfaces of a problem. Nodes are numbered from 1, beginning with those of the muscle."""

    def __init__(self, problem: MuscleProblem) -> None:
        self.problem = problem
        self.points, self.tets = quadratic(problem.mesh)
        ends = np.sort(problem.mesh.tets[:, EDGES].reshape(-1, 2), axis=1)
        self.middles = dict(zip(map(tuple, ends.tolist()), self.tets[:, 4:].ravel().tolist(), strict=True))
        self.outer, _ = boundary(problem.mesh.tets)

    def add_to(self, root: Element) -> None:
        """Add the section ``Mesh``, in which node sets and surfaces follow all nodes and elements."""
        mesh, groups = SubElement(root, "Mesh"), [(MUSCLE, "tet10", self.points, self.tets)]
        for bone in self.problem.bones:
            surface = outward(bone.surface)
            groups.append((bone_id(bone), "tri3", surface.points, surface.triangles))
        groups += [(springs_id(attached), *self._copy(attached)) for attached in by_springs(self.problem)]
        before = np.cumsum([0, *(len(points) for _, _, points, _ in groups[:-1])])
        cells = {name: own + first for (name, _, _, own), first in zip(groups, before, strict=True)}
        for (name, _, points, _), first in zip(groups, before.tolist(), strict=True):
            rows(SubElement(mesh, "Nodes", name=f"{name}_nodes"), "node", points.tolist(), first + 1)
        own = {part.name: ("tet10", self.tets[part.cells]) for part in parts(self.problem)}
        elements, number = own | {name: (kind, cells[name]) for name, kind, _, _ in groups[1:]}, 1
        for name, (kind, nodes) in elements.items():
            rows(SubElement(mesh, "Elements", name=name, type=kind), "elem", (nodes + 1).tolist(), number)
            number += len(nodes)
        self._attached(mesh)
        if self.problem.obstacles:
            self._contact_surface(mesh, cells)
        for attached in by_springs(self.problem):
            self._tied(mesh, attached, cells[springs_id(attached)])

    def curved(self, facets: Ints) -> Ints:
        """The triangles (m, 6) with mid-side nodes for ``facets`` (m, 3) of the tetrahedra."""
        ends = np.sort(facets[:, EDGES[:3]], axis=2).reshape(-1, 2).tolist()
        middles = [self.middles[a, b] for a, b in ends]
        return np.hstack([facets, np.reshape(np.array(middles, np.int64), (-1, 3))])

    def _area(self, attached: AttachedVertices) -> Ints:
        """The triangles (m, 6) of an attachment, with outward normals; for springs at points, those that contain these points."""
        if attached.attachment in self.problem.attached_skins:
            return self.curved(np.unique(spring_points(self.problem, attached).facets, axis=0))
        return self.curved(self.outer[found_in(self.outer, self.problem.mesh.facets[attached.attachment])])

    def _copy(self, attached: AttachedVertices) -> tuple[str, Floats, Ints]:
        """The kind, the points (n, 3) [mm] and the triangles of a copy of the attached area, which faces this area, as the surfaces
        of a pair in FEBio must. For springs at points, the copy consists of the small triangles around these points.
        """
        if attached.attachment in self.problem.attached_skins:
            corners = spring_points(self.problem, attached).corners.reshape(-1, 3)
            return "tri3", corners, np.arange(len(corners)).reshape(-1, 3)
        used, triangles = np.unique(self._area(attached)[:, FACING], return_inverse=True)
        return "tri6", self.points[used], triangles.reshape(-1, 6)

    def _attached(self, mesh: Element) -> None:
        taken: set[int] = set()
        for attached in exactly(self.problem):
            nodes = set(self.curved(self.problem.mesh.facets[attached.attachment]).ravel().tolist()) - taken
            taken |= nodes
            name = f"attached_{attached.attachment}"
            SubElement(mesh, "NodeSet", name=name).text = ",".join(str(node + 1) for node in sorted(nodes))

    def _contact_surface(self, mesh: Element, cells: dict[str, Ints]) -> None:
        """Add the contact surface of the muscle, the surfaces of the bones in contact, and the pairs of surfaces."""
        self.surface(mesh, "muscle_free", "tri6", self.curved(free_facets(self.problem)))
        names = [bone_id(bone) for bone in self.problem.obstacles]
        for name in names:
            self.surface(mesh, f"{name}_surface", "tri3", cells[name])
        for name in names:
            self.pair(mesh, f"{name}_pair", "muscle_free", f"{name}_surface")

    def _tied(self, mesh: Element, attached: AttachedVertices, copy: Ints) -> None:
        """Add the attached area and its rigid copy, which is the primary surface, over which FEBio integrates."""
        name = springs_id(attached)
        self.surface(mesh, f"{name}_muscle", "tri6", self._area(attached))
        self.surface(mesh, f"{name}_bone", f"tri{copy.shape[1]}", copy)
        self.pair(mesh, f"{name}_pair", f"{name}_bone", f"{name}_muscle")

    @staticmethod
    def surface(mesh: Element, name: str, kind: str, facets: Ints) -> None:
        """Add a surface with a ``name`` and ``facets`` (m, 3 or 6) of a ``kind``, whose nodes are numbered from 0."""
        rows(SubElement(mesh, "Surface", name=name), kind, (facets + 1).tolist())

    @staticmethod
    def pair(mesh: Element, name: str, primary: str, secondary: str) -> None:
        """Add the pair ``name`` of two surfaces, which are given by their names."""
        leaves(SubElement(mesh, "SurfacePair", name=name), {"primary": primary, "secondary": secondary})
