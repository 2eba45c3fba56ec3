"""The nodes, elements, node sets and surfaces of FEBio's input file."""

from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from fem_reference.mesh import Floats, Ints, Surface, TetMesh, boundary, enclosed_volume
from fem_reference.problem import Body, Problem

# Corners between which the last six nodes of a tet10 are; the first three pairs are those of a tri6 too.
EDGES = np.array([[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]])


def leaf(parent: Element, tag: str, text: object, **attributes: str) -> None:
    """An element with a text and nothing below it."""
    SubElement(parent, tag, attributes).text = str(text)


def vector(values: Iterable[float]) -> str:
    """Numbers in full, as FEBio reads them."""
    return ",".join(repr(float(value)) for value in values)


def bone_id(bone: Body) -> str:
    """What a bone is called in the file: its material, its elements."""
    return f"bone_{bone.name}"


def quadratic(mesh: TetMesh) -> tuple[Floats, Ints]:
    """Points (n, 3) [mm] and tets (k, 10) with a node in the middle of each edge, in FEBio's order; corners stay as they are."""
    ends = np.sort(mesh.tets[:, EDGES].reshape(-1, 2), axis=1)
    edges, number = np.unique(ends, axis=0, return_inverse=True)
    middles = len(mesh.points) + number.reshape(-1, len(EDGES))
    return np.vstack([mesh.points, mesh.points[edges].mean(axis=1)]), np.hstack([mesh.tets, middles])


def pushing(problem: Problem) -> list[Body]:
    """The bones that push on the muscle."""
    contact = problem.contact
    return [bone for bone in problem.bones if contact is not None and contact.is_by(bone.name)]


def outward(surface: Surface) -> Surface:
    """The surface with its normals pointing out of it."""
    turned = enclosed_volume(surface.points, surface.triangles) < 0
    return Surface(surface.points, surface.triangles[:, ::-1]) if turned else surface


class Mesh:
    """Nodes, elements, node sets and surfaces; node numbers of FEBio begin at 1, with those of the muscle."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.points, self.tets = quadratic(problem.mesh)
        ends = np.sort(problem.mesh.tets[:, EDGES].reshape(-1, 2), axis=1)
        self.middles = dict(zip(map(tuple, ends.tolist()), self.tets[:, 4:].ravel().tolist(), strict=True))

    def add_to(self, root: Element) -> None:
        """The section ``Mesh``: sets and surfaces after all nodes and elements."""
        mesh, elements = SubElement(root, "Mesh"), []
        first_node, first_element = len(self.points), len(self.tets)
        self._nodes(mesh, "muscle_nodes", self.points, 0)
        elements.append(("muscle", "tet10", self.tets, 0))
        for bone in self.problem.bones:
            surface = outward(bone.surface)
            self._nodes(mesh, f"{bone_id(bone)}_nodes", surface.points, first_node)
            elements.append((bone_id(bone), "tri3", surface.triangles + first_node, first_element))
            first_node += len(surface.points)
            first_element += len(surface.triangles)
        for name, kind, cells, before in elements:
            group = SubElement(mesh, "Elements", name=name, type=kind)
            for i, cell in enumerate((cells + 1).tolist(), start=before + 1):
                leaf(group, "elem", ",".join(map(str, cell)), id=str(i))
        self._held(mesh)
        if self.problem.contact is not None:
            self._pairs(mesh, {name: cells for name, kind, cells, _ in elements if kind == "tri3"})

    @staticmethod
    def _nodes(mesh: Element, name: str, points: Floats, before: int) -> None:
        group = SubElement(mesh, "Nodes", name=name)
        for i, point in enumerate(points.tolist(), start=before + 1):
            leaf(group, "node", vector(point), id=str(i))

    def _curved(self, facets: Ints) -> Ints:
        """Straight triangles (m, 3) of the tets with the middles of their edges, (m, 6)."""
        ends = np.sort(facets[:, EDGES[:3]], axis=2).reshape(-1, 2).tolist()
        middles = [self.middles[a, b] for a, b in ends]
        return np.hstack([facets, np.reshape(np.array(middles, np.int64), (-1, 3))])

    def _held(self, mesh: Element) -> None:
        taken: set[int] = set()
        for held in self.problem.held:
            nodes = set(self._curved(self.problem.mesh.facets[held.attachment]).ravel().tolist()) - taken
            taken |= nodes
            name = f"held_{held.attachment}"
            SubElement(mesh, "NodeSet", name=name).text = ",".join(str(node + 1) for node in sorted(nodes))

    def _pairs(self, mesh: Element, bones: dict[str, Ints]) -> None:
        """The surface that bones push on: none of what is held, nor its neighbours."""
        facets, _ = boundary(self.problem.mesh.tets)
        held = np.concatenate([np.zeros((0, 3), np.int64), *self.problem.mesh.facets.values()])
        free = facets[~np.isin(facets, held).any(axis=1)]
        self._surface(mesh, "muscle_free", "tri6", self._curved(free))
        for bone in pushing(self.problem):
            self._surface(mesh, f"{bone_id(bone)}_surface", "tri3", bones[bone_id(bone)])
        for bone in pushing(self.problem):
            pair = SubElement(mesh, "SurfacePair", name=f"{bone_id(bone)}_pair")
            leaf(pair, "primary", "muscle_free")
            leaf(pair, "secondary", f"{bone_id(bone)}_surface")

    @staticmethod
    def _surface(mesh: Element, name: str, kind: str, facets: Ints) -> None:
        group = SubElement(mesh, "Surface", name=name)
        for i, facet in enumerate((facets + 1).tolist(), start=1):
            leaf(group, kind, ",".join(map(str, facet)), id=str(i))
