"""An idealised right hip, made for this project: pelvis, femur and a gluteus-like muscle, as closed triangle surfaces.

    python meshes/hip/build.py

writes muscle.ply, pelvis.ply, femur.ply and card.toml beside this file. Lengths in mm; the hip joint centre is the
origin, +x the subject's left, +y posterior, +z superior. Flexion turns the femur by a negative angle about +x.

The muscle is a loft of ellipses along a Bezier curve. Its two ends are flat and lie at a distance of ``GAP`` from
flat faces of the bones, so that exactly the vertices of an end are within 1.5 mm of a bone. Its triangles are finer
towards the ends, so that attached areas stop at the rims of the ends.
"""

import hashlib
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).resolve().parent
GAP = 0.5  # distance between an end of the muscle and its bone
ORIGIN, ORIGIN_NORMAL = np.array([12.0, 82.0, 68.0]), np.array([-0.25, 0.36, -0.90])
INSERTION, INSERTION_NORMAL = np.array([-46.0, 30.0, -96.0]), np.array([0.05, 0.50, 0.87])
BOW = 58.0  # length of the Bezier handles, which determines how far the muscle bulges backwards
END_SIZE = 2.4  # edge length of the muscle's triangles at its ends
END_RADIUS, BELLY_RADIUS, FLATNESS = 9.6, 21.0, 1.12
SECTIONS = 15

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Tag = tuple[int, int]


def unit(vector: Floats) -> Floats:
    """``vector`` (3,) with length 1."""
    return vector / np.linalg.norm(vector)


def axis_point(s: float) -> Floats:
    """The point (3,) [mm] of the muscle's axis at ``s`` in 0..1: a cubic Bezier curve along the normals of both faces."""
    start, end = ORIGIN + GAP * unit(ORIGIN_NORMAL), INSERTION + GAP * unit(INSERTION_NORMAL)
    handles = start + BOW * unit(ORIGIN_NORMAL), end + BOW * unit(INSERTION_NORMAL)
    weights = (1 - s) ** 3, 3 * s * (1 - s) ** 2, 3 * s**2 * (1 - s), s**3
    return np.einsum("i,ij->j", weights, [start, *handles, end])


def section(s: float) -> int:
    """The closed wire of the ellipse at ``s``, wide across the axis in the frontal plane, flat from front to back."""
    tangent = unit(axis_point(min(s + 1e-5, 1.0)) - axis_point(max(s - 1e-5, 0.0)))
    across = unit(np.array([1.0, 0.0, 0.0]) - tangent[0] * tangent)
    belly = np.sin(np.pi * s)
    radius = END_RADIUS + (BELLY_RADIUS - END_RADIUS) * belly
    flatness = 1 + (FLATNESS - 1) * belly
    ellipse = gmsh.model.occ.addEllipse(
        *axis_point(s), radius * flatness, radius / flatness, zAxis=list(tangent), xAxis=list(across)
    )
    return gmsh.model.occ.addCurveLoop([ellipse])


def muscle() -> list[Tag]:
    """The fusiform muscle."""
    wires = [section(s) for s in np.linspace(0, 1, SECTIONS)]
    return gmsh.model.occ.addThruSections(wires, makeSolid=True, continuity="C2")


def ellipsoid(centre: Floats | list[float], semi_axes: list[float], turn: float = 0.0) -> Tag:
    """An ellipsoid with semi-axes along x, y, z, turned about +x by ``turn`` [rad]."""
    tag = (3, gmsh.model.occ.addSphere(*centre, 1.0))
    gmsh.model.occ.dilate([tag], *centre, *semi_axes)
    gmsh.model.occ.rotate([tag], *centre, 1, 0, 0, turn)
    return tag


def rod(start: list[float], end: list[float], radii: tuple[float, float]) -> list[Tag]:
    """A cone from ``start`` to ``end`` with a ball at its end."""
    cone = gmsh.model.occ.addCone(*start, *np.subtract(end, start), *radii)
    return [(3, cone), (3, gmsh.model.occ.addSphere(*end, radii[1]))]


def cut_flat(body: Tag, face: Floats, normal: Floats) -> Tag:
    """The part of ``body`` behind the plane through ``face`` with the outward ``normal``."""
    occ = gmsh.model.occ
    block = occ.addBox(*(face - [200, 200, 0]), 400, 400, 400)
    turn_axis = np.cross([0, 0, 1], unit(normal))
    occ.rotate([(3, block)], *face, *turn_axis, float(np.arccos(unit(normal)[2])))
    ((left, *_), _) = occ.cut([body], [(3, block)])
    return left


def fused(parts: list[Tag]) -> list[Tag]:
    """The union of overlapping solids."""
    whole, _ = gmsh.model.occ.fuse(parts[:1], parts[1:])
    return whole


def pelvis() -> list[Tag]:
    """Ilium with the face where the muscle starts, sacrum, ischium and pubic ramus; it leaves the femoral head free."""
    ilium = cut_flat(ellipsoid([18, 28, 94], [28, 80, 58], turn=-0.35), ORIGIN, ORIGIN_NORMAL)
    sacrum = ellipsoid([60, 68, 78], [24, 18, 46], turn=0.4)
    ischium = ellipsoid([42, 18, 4], [16, 21, 58], turn=0.15)
    seat = ellipsoid([42, 27, -46], [15, 16, 18])
    return fused([ilium, sacrum, ischium, seat, *rod([42, 14, 0], [78, -38, -8], (12, 10))])


def femur() -> list[Tag]:
    """Head, neck, greater trochanter, shaft, condyles, and the tuberosity with the face on which the muscle ends."""
    head = (3, gmsh.model.occ.addSphere(0, 0, 0, 22))
    neck = (3, gmsh.model.occ.addCone(0, 0, 0, -42, 0, -34, 14, 16))
    trochanter = ellipsoid([-46, 2, -22], [16, 19, 26])
    tuberosity = cut_flat(ellipsoid([-46, 24, -124], [20, 22, 40]), INSERTION, INSERTION_NORMAL)
    condyles = ellipsoid([-38, 6, -270], [32, 24, 20])
    return fused([head, neck, trochanter, tuberosity, condyles, *rod([-44, 0, -24], [-40, 0, -265], (15, 14))])


def finer_towards_the_ends(_dimension: int, _tag: int, x: float, y: float, z: float, size: float) -> float:
    """The desired edge length of the muscle at a point: ``END_SIZE`` on its end faces, and 0.7 mm more per mm of distance."""
    heights = (unit(ORIGIN_NORMAL) @ ([x, y, z] - ORIGIN), unit(INSERTION_NORMAL) @ ([x, y, z] - INSERTION))
    return min(size, END_SIZE + 0.7 * max(0.0, float(min(heights)) - GAP))


@contextmanager
def gmsh_session(size: float) -> Iterator[None]:
    """A gmsh session that meshes curves and surfaces with edges of about ``size`` [mm]."""
    gmsh.initialize(interruptible=False)
    try:
        for name, value in {
            "General.Terminal": 0,
            "General.NumThreads": 1,
            "Mesh.MeshSizeMin": min(size, END_SIZE),
            "Mesh.MeshSizeMax": size,
            "Mesh.RandomSeed": 1,
        }.items():
            gmsh.option.setNumber(name, value)
        yield
    finally:
        gmsh.finalize()


def surface(solid: Callable[[], list[Tag]], size: float) -> tuple[Floats, Ints]:
    """The boundary of a solid as points (n, 3) [mm] and triangles (m, 3)."""
    with gmsh_session(size):
        tags = solid()
        gmsh.model.occ.synchronize()
        if solid is muscle:
            gmsh.model.mesh.setSizeCallback(finer_towards_the_ends)
        gmsh.model.mesh.generate(2)
        faces = gmsh.model.getBoundary(tags)
        corners = [gmsh.model.mesh.getElementsByType(2, tag)[1].reshape(-1, 3) for _, tag in faces]
        nodes, points, _ = gmsh.model.mesh.getNodes()
    corners = [block[:, ::-1] if tag < 0 else block for block, (_, tag) in zip(corners, faces, strict=True)]
    used, triangles = np.unique(np.concatenate(corners), return_inverse=True)
    order = np.argsort(nodes)
    return points.reshape(-1, 3)[order[np.searchsorted(nodes[order], used)]], triangles.reshape(-1, 3)


def volume(points: Floats, triangles: Ints) -> float:
    """Volume inside a closed surface [mm3]."""
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def ply(points: Floats, triangles: Ints) -> bytes:
    """A binary little-endian PLY file in double precision."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment unit mm\n"
        f"element vertex {len(points)}\nproperty double x\nproperty double y\nproperty double z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = b"".join(struct.pack("<B3i", 3, *triangle) for triangle in triangles)
    return header.encode() + points.astype("<f8").tobytes() + faces


SURFACES = {
    "muscle": (muscle, 5.2, "gluteus-like fusiform muscle with flat ends"),
    "pelvis": (pelvis, 11.5, "right half of a pelvis: ilium, sacrum, ischium, pubic ramus"),
    "femur": (femur, 10.0, "right femur: head, neck, trochanter, tuberosity, shaft, condyles"),
}


def build() -> dict[str, tuple[Floats, Ints]]:
    """The surfaces by name."""
    return {name: surface(solid, size) for name, (solid, size, _) in SURFACES.items()}


def card(name: str, content: bytes, points: Floats, triangles: Ints) -> str:
    """The table of one file in card.toml."""
    return f"""
[[file]]
name = "{name}.ply"
what = "{SURFACES[name][2]}"
unit = "mm"
licence = "MIT, made for this project"
built = "build.py, gmsh {gmsh.__version__}"
triangles = {len(triangles)}
volume_mm3 = {volume(points, triangles):.3f}
sha256 = "{hashlib.sha256(content).hexdigest()}"
"""


def main() -> None:
    """Write the surfaces and their card."""
    text = "# An idealised hip. Written by build.py; do not edit.\n"
    for name, (points, triangles) in build().items():
        content = ply(points, triangles)
        (FOLDER / f"{name}.ply").write_bytes(content)
        text += card(name, content, points, triangles)
        print(f"{name}: {len(triangles)} triangles, {volume(points, triangles):.0f} mm3")
    (FOLDER / "card.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
