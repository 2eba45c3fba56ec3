"""A standing person, made for this project, 1.75 m tall, as one closed triangle surface.

    python meshes/figure/build.py

writes figure.ply and card.toml beside this file. Lengths in mm; the figure stands on the plane y = 0 and faces +z, +x
is its left. Vertex 0 is the tip of the nose and vertex 1 the vertex nearest to it.

The body is the region in which a function, a smooth union of rods, is negative. Vertices are spread over its zero level, more
densely on small parts. A triangle lies between two of their Delaunay tetrahedra, one centred inside and one outside the body.
"""

import hashlib
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.spatial import Delaunay, KDTree

FOLDER = Path(__file__).resolve().parent
NOSE = np.array([[0.0, 1607.0, 121.0]])  # approximate position of its tip
FLOOR, SOLE = -15.5, 60.0  # height of a plane that cuts the feet, and width of the rounding there [mm]
STEP = 0.01  # step of the difference quotients of the gradient [mm]
SPREAD = 0.35  # growth of edge lengths with the distance from a part with shorter edges
PACKING = 0.91  # least distance of two initial vertices, as a fraction of the desired edge length
ROUNDS = 20  # number of rounds that even out the vertices

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Triple = tuple[float, float, float]


class Part(NamedTuple):
    """A rod between two points, with a radius at each and a section stretched along x, y, z; its mirror image is added."""

    name: str
    start: Triple
    end: Triple
    radii: tuple[float, float]
    stretch: Triple
    blend: float  # width of the fillet towards the parts before it
    edge: float  # desired edge length of the triangles


ROUND = (1.0, 1.0, 1.0)
PARTS = [
    Part("chest", (68, 1345, -8), (45, 1215, 0), (108, 98), (1, 1, 0.95), 30, 38),
    Part("waist", (38, 1190, 2), (40, 1040, 4), (102, 102), (1, 1, 0.95), 40, 38),
    Part("pelvis", (62, 985, 0), (74, 925, 0), (108, 102), (1, 1, 0.98), 40, 38),
    Part("buttock", (70, 915, -50), (74, 885, -46), (78, 74), ROUND, 30, 38),
    Part("shoulder", (15, 1462, -24), (165, 1410, -14), (46, 52), ROUND, 45, 34),
    Part("neck", (0, 1590, -20), (0, 1450, -24), (50, 56), ROUND, 22, 22),
    Part("cranium", (0, 1656, -20), (0, 1660, 6), (90, 85), (0.85, 1, 1), 15, 18),
    Part("face", (0, 1625, 30), (0, 1555, 54), (58, 33), ROUND, 20, 15),
    Part("cheek", (30, 1604, 58), (36, 1600, 46), (24, 22), ROUND, 12, 14),
    Part("brow", (0, 1657, 84), (36, 1658, 68), (14, 12), ROUND, 10, 11),
    Part("nose", (0, 1648, 91), (0, 1608, 107), (7, 13), (0.95, 1, 1), 8, 7),
    Part("nostril", (10, 1604, 96), (12, 1605, 93), (8, 8), ROUND, 5, 7),
    Part("lip", (0, 1572, 88), (15, 1573, 81), (8, 6), ROUND, 6, 9),
    Part("ear", (84, 1650, -16), (80, 1616, -8), (24, 16), (0.5, 1, 0.9), 7, 9),
    Part("upper arm", (192, 1400, -14), (262, 1130, -16), (54, 38), ROUND, 25, 26),
    Part("forearm", (263, 1125, -16), (276, 1060, -10), (36, 40), ROUND, 8, 24),
    Part("wrist", (276, 1060, -10), (318, 880, 14), (38, 26), (0.9, 1, 1), 8, 20),
    Part("palm", (320, 860, 18), (328, 790, 26), (38, 42), (0.5, 1, 1), 12, 16),
    Part("fingers", (328, 790, 26), (334, 712, 34), (40, 29), (0.5, 1, 1), 6, 16),
    Part("thumb", (318, 835, 46), (310, 785, 86), (15, 12), ROUND, 10, 11),
    Part("thigh", (98, 905, 2), (142, 520, 6), (94, 54), ROUND, 22, 36),
    Part("calf", (142, 500, 2), (152, 385, -20), (50, 57), ROUND, 14, 31),
    Part("shin", (152, 385, -16), (174, 95, -26), (54, 34), ROUND, 8, 27),
    Part("heel", (174, 80, -28), (174, 38, -46), (36, 38), (0.95, 1, 1), 12, 22),
    Part("foot", (175, 52, -20), (192, 20, 128), (44, 46), (1, 0.75, 1), 16, 22),
]


def smooth_minimum(one: Floats, other: Floats, width: float) -> Floats:
    """The lesser of two functions (n,), rounded off where they differ by less than ``width``."""
    overlap = np.maximum(1 - np.abs(one - other) / width, 0)
    return np.minimum(one, other) - width / 4 * overlap**2


def rod_distance(points: Floats, part: Part) -> Floats:
    """Approximate distance (n,) [mm] of ``points`` (n, 3) from a part without its mirror image, negative inside."""
    axis: Floats = np.subtract(part.end, part.start)
    along = np.clip((points - part.start) @ axis / (axis @ axis), 0, 1)
    offset = (points - part.start - along[:, None] * axis) / part.stretch
    length = np.linalg.norm(offset, axis=1)
    return (length - part.radii[0] - along * (part.radii[1] - part.radii[0])) * min(part.stretch)


def part_distance(points: Floats, part: Part) -> Floats:
    """Distance as ``rod_distance``, from a part and its mirror image."""
    return smooth_minimum(rod_distance(points, part), rod_distance(points * [-1, 1, 1], part), part.blend)


def body_distance(points: Floats) -> Floats:
    """Approximate distance (n,) [mm] of ``points`` (n, 3) from the skin, negative inside the body."""
    body = part_distance(points, PARTS[0])
    for part in PARTS[1:]:
        body = smooth_minimum(body, part_distance(points, part), part.blend)
    return -smooth_minimum(-body, points[:, 1] - FLOOR, SOLE)


def edge_length(points: Floats) -> Floats:
    """Desired length (n,) [mm] of the edges at ``points`` (n, 3)."""
    wanted = [part.edge + SPREAD * np.maximum(part_distance(points, part), 0) for part in PARTS]
    return np.min(wanted, axis=0)


def on_skin(points: Floats, rounds: int) -> Floats:
    """``points`` (n, 3) near the skin moved onto it, by Newton's method along the gradient."""
    for _ in range(rounds):
        value = body_distance(points)
        gradient = np.stack([body_distance(points + step) - value for step in STEP * np.eye(3)], axis=1) / STEP
        points = points - (value / np.einsum("ij,ij->i", gradient, gradient))[:, None] * gradient
    return points


def dense_points() -> Floats:
    """Points (n, 3) all over the skin, about a third of an edge apart, from cubes split where they meet the skin."""
    width = 64.0
    sides = [np.arange(low, high, width) for low, high in ((-410, 410), (-30, 1790), (-180, 240))]
    cubes, found = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 3), []
    halves = np.stack(np.meshgrid(*[[-0.25, 0.25]] * 3), axis=-1).reshape(-1, 3)
    while len(cubes):
        cubes = cubes[np.abs(body_distance(cubes)) < width]
        fine = width < edge_length(cubes) / 3
        found.append(cubes[fine])
        cubes = (cubes[~fine, None] + width * halves).reshape(-1, 3)
        width /= 2
    points = on_skin(np.concatenate(found), 2)
    return points[np.abs(body_distance(points)) < 0.1]


def scattered(points: Floats) -> Floats:
    """The tip of the nose and, in order of the distance from it, all ``points`` far enough from those chosen before."""
    tip = on_skin(NOSE, 4)
    points = np.concatenate([tip, points[np.argsort(np.linalg.norm(points - tip, axis=1))]])
    tree, free, chosen = KDTree(points), np.ones(len(points), bool), []
    spacing = PACKING * edge_length(points)
    for index in range(len(points)):
        if free[index]:
            chosen.append(index)
            free[tree.query_ball_point(points[index], spacing[index])] = False
    return points[chosen]


def skin_triangles(points: Floats) -> Ints:
    """The triangles (m, 3), outward, between tetrahedra whose circumcentres lie inside and outside the body."""
    mesh = Delaunay(points)
    corners = points[mesh.simplices]
    sides = corners[:, 1:] - corners[:, :1]
    centres = corners[:, 0] + np.linalg.solve(sides, (sides**2).sum(axis=2, keepdims=True) / 2)[:, :, 0]
    inside = np.append(body_distance(centres) < 0, False)  # the last entry: beyond the hull, neighbour -1
    tet, opposite = np.nonzero(inside[:-1, None] & ~inside[mesh.neighbors])
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[opposite]
    triangles = np.take_along_axis(mesh.simplices[tet], others, axis=1).astype(np.int64)
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), points[mesh.simplices[tet, opposite]] - a) > 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


def evened(points: Floats) -> Floats:
    """``points`` (n, 3), except the first, moved along the skin to the weighted mean of the centroids of their triangles."""
    triangles = skin_triangles(points)
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    middle = (a + b + c) / 3
    weight = np.linalg.norm(np.cross(b - a, c - a), axis=1) / edge_length(middle) ** 2
    total, moment = np.zeros(len(points)), np.zeros((len(points), 3))
    for corner in range(3):
        np.add.at(total, triangles[:, corner], weight)
        np.add.at(moment, triangles[:, corner], weight[:, None] * middle)
    moved = on_skin(moment / total[:, None], 1)
    moved[0] = points[0]
    return moved


def build() -> dict[str, tuple[Floats, Ints]]:
    """The figure by name: points (n, 3) [mm] and triangles (m, 3)."""
    points = scattered(dense_points())
    for _ in range(ROUNDS):
        points = evened(points)
    points = on_skin(points, 5)
    return {"figure": (points, skin_triangles(points))}


def ply(points: Floats, triangles: Ints) -> bytes:
    """A binary little-endian PLY file in double precision."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment unit mm\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    return header.encode() + points.astype("<f8").tobytes() + faces.tobytes()


def card(content: bytes, points: Floats, triangles: Ints) -> str:
    """The text of card.toml."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return f"""# A standing figure. Written by build.py; do not edit.

[[file]]
name = "figure.ply"
what = "standing person, arms and legs apart, vertices 0 and 1 at the nose; +y up, facing +z"
unit = "mm"
licence = "MIT, made for this project"
built = "build.py, numpy {np.__version__}, scipy {scipy.__version__}"
triangles = {len(triangles)}
volume_mm3 = {np.einsum("ij,ij->", a, np.cross(b, c)) / 6:.3f}
sha256 = "{hashlib.sha256(content).hexdigest()}"
"""


def main() -> None:
    """Write the figure and its card."""
    points, triangles = build()["figure"]
    content = ply(points, triangles)
    (FOLDER / "figure.ply").write_bytes(content)
    (FOLDER / "card.toml").write_text(card(content, points, triangles), encoding="utf-8")
    print(f"figure: {len(points)} vertices, {len(triangles)} triangles, mean y {points[:, 1].mean():.1f} mm")


if __name__ == "__main__":
    main()
