"""Bodies for tests, made with numpy alone: boxes of tetrahedra and spheres of triangles."""

import itertools
from pathlib import Path

import meshio
import numpy as np

from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh, boundary
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone


def box(cells: tuple[int, int, int], size: tuple[float, float, float]) -> TetMesh:
    """A box from the origin, each of its cells cut into Kuhn's six tets, with its faces ``bottom`` (z = 0) and ``top``."""
    axes = [np.linspace(0, length, count + 1) for count, length in zip(cells, size, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    strides = np.array([(cells[1] + 1) * (cells[2] + 1), cells[2] + 1, 1])
    corners = np.array(list(itertools.product(*(range(count) for count in cells)))) @ strides
    tets = []
    for order in itertools.permutations(range(3)):
        path = np.cumsum([0, *(strides[axis] for axis in order)])
        even = np.linalg.det(np.eye(3)[list(order)]) > 0
        tets.append(corners[:, None] + (path if even else path[[0, 2, 1, 3]]))
    mesh = TetMesh(points, np.concatenate(tets))
    faces, _ = boundary(mesh.tets)
    ends = {"bottom": 0.0, "top": size[2]}
    facets = {name: faces[np.isclose(points[faces][:, :, 2], z).all(axis=1)] for name, z in ends.items()}
    return TetMesh(mesh.points, mesh.tets, facets)


def skin(mesh: TetMesh) -> Surface:
    """The boundary of a tet mesh as a surface of its own points."""
    faces, _ = boundary(mesh.tets)
    used, triangles = np.unique(faces, return_inverse=True)
    return Surface(mesh.points[used], triangles.reshape(-1, 3), "skin")


def sphere(subdivisions: int, radius: float = 1.0) -> Surface:
    """A sphere from an icosahedron, whose vertices all lie on the sphere."""
    golden = (1 + 5**0.5) / 2
    points = [
        point
        for a, b in itertools.product((1.0, -1.0), (golden, -golden))
        for point in ((0, a, b), (a, b, 0), (b, 0, a))
    ]
    corners = np.array(points)
    triangles = [
        triple
        for triple in itertools.combinations(range(12), 3)
        if np.ptp(corners[list(triple)], axis=0).max() < 2 * golden - 0.1
        and all(np.isclose(np.linalg.norm(corners[i] - corners[j]), 2) for i, j in itertools.combinations(triple, 2))
    ]
    for _ in range(subdivisions):
        corners, triangles = _subdivide(corners, np.array(triangles))
    faces = np.array(triangles)
    a, b, c = (corners[faces[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward][:, ::-1]
    return Surface(radius * corners / np.linalg.norm(corners, axis=1)[:, None], faces, "sphere")


def write(path: Path, surface: Surface, points: Floats) -> None:
    """A file of a ``surface`` with its points at ``points``, by meshio: as other programs write it."""
    form = "gmsh" if path.suffix == ".msh" else None  # or else it would be another program's
    meshio.Mesh(points, [("triangle", surface.triangles)]).write(path, form)


def _subdivide(points: Floats, triangles: np.ndarray) -> tuple[Floats, np.ndarray]:
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, middle = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (len(points) + middle.reshape(-1, 3)).T
    a, b, c = triangles.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    points = points / np.linalg.norm(points, axis=1)[:, None]
    middles = points[unique].mean(axis=1)
    return np.vstack([points, middles]), np.concatenate([np.column_stack(part) for part in parts])


def renumbered(mesh: TetMesh, seed: int) -> TetMesh:
    """The same mesh with its points, tetrahedra and facets in another order."""
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(mesh.points))
    number = np.argsort(order)
    facets = {name: number[rng.permutation(facet)] for name, facet in mesh.facets.items()}
    return TetMesh(mesh.points[order], number[rng.permutation(mesh.tets)], facets)


def bar(
    cells: tuple[int, int, int],
    size: tuple[float, float, float],
    motions: dict[str, RigidMotion | None],
    effects: tuple,
    frames: tuple[int, ...],
) -> MuscleProblem:
    """A bar whose ``bottom`` and ``top`` are each attached by a bone with its own motion, with one fibre along its middle."""
    mesh = box(cells, size)
    surface = skin(mesh)
    bone = Surface(np.eye(3), np.array([[0, 1, 2]]), "bone")
    attached = []
    for name, z in (("bottom", 0.0), ("top", size[2])):
        vertices = np.flatnonzero(np.isclose(surface.points[:, 2], z))
        attached.append(AttachedVertices(name, Bone(name, bone, motions[name]), vertices))
    middle = np.column_stack([np.full(5, size[0] / 2), np.full(5, size[1] / 2), np.linspace(0, size[2], 5)])
    return MuscleProblem(
        surface,
        tuple(entry.bone for entry in attached),
        tuple(attached),
        frames,
        None,
        mesh=mesh,
        effects=effects,
        fibres=Polylines(middle, np.array([0, 5])),
    )
