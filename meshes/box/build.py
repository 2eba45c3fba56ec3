"""A box to squeeze between plates, straight fibres in it, and the vertices at which it is attached loosely.

    python meshes/box/build.py

writes box.ply, fibres.vtk, sides.csv and card.toml beside this file. Lengths in mm; y is the direction in which plates squeeze it.

The faces of the box are cut into squares of 5 mm, and each of these into two triangles along the diagonal from its lowest to its
highest corner. So grids of boxes of 5, 10 or 20 mm, each cut into Kuhn's tetrahedra, have matching faces.
"""

import hashlib
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).resolve().parent
LOW, HIGH, SQUARE = np.array([-50, 10, -50]), np.array([50, 90, 50]), 5
STEP = 10  # distance between the points of a fibre
# Positions of the fibres along y, (x, z), and of those along x, (y, z).
ALONG_Y = [(x, z) for x in (-35, 0, 35) for z in (-30, 30)]
ALONG_X = [(y, z) for y in (20, 50, 80) for z in (-10, 10)]

# Half the extent in y and z of the attached areas in the middle of the faces across x.
HALF = np.array([20, 30])

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def sheet(axis: int, at: int, *, high: bool) -> Ints:
    """Corners (m, 3, 3) of the outward triangles of the face across ``axis`` ``at`` a coordinate."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    across, along = (np.arange(LOW[other], HIGH[other], SQUARE), np.arange(LOW[one], HIGH[one], SQUARE))
    corner = np.zeros((len(along) * len(across), 3), np.int64)
    corner[:, one], corner[:, other] = (ticks.ravel() for ticks in np.meshgrid(along, across, indexing="ij"))
    corner[:, axis] = at
    first, second = SQUARE * np.eye(3, dtype=np.int64)[[one, other]]
    halves = np.array([[0 * first, first, first + second], [0 * first, first + second, second]])
    return (corner[:, None, None] + (halves if high else halves[:, ::-1])).reshape(-1, 3, 3)


def build() -> dict[str, tuple[Floats, Ints]]:
    """The box by name: points (n, 3) [mm] and triangles (m, 3)."""
    ends = [(axis, high) for axis in range(3) for high in (False, True)]
    corners = np.concatenate([sheet(axis, (HIGH if high else LOW)[axis], high=high) for axis, high in ends])
    points, triangles = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return {"box": (points.astype(float), triangles.reshape(-1, 3))}


def fibres() -> list[Floats]:
    """The points (k, 3) [mm] of each fibre: six along y, six along x, from 5 mm below the surface to 5 mm below the other side."""
    x, y = (np.arange(LOW[axis] + STEP / 2, HIGH[axis], STEP) for axis in (0, 1))
    along_y = [np.column_stack([np.full(len(y), a), y, np.full(len(y), b)]) for a, b in ALONG_Y]
    along_x = [np.column_stack([x, np.full(len(x), a), np.full(len(x), b)]) for a, b in ALONG_X]
    return along_y + along_x


def sides(points: Floats) -> list[int]:
    """The vertices in the middle of the two faces across x."""
    middle = (LOW + HIGH) / 2
    on_face = np.isin(points[:, 0], (LOW[0], HIGH[0]))
    return np.flatnonzero(on_face & (np.abs(points[:, 1:] - middle[1:]) <= HALF).all(axis=1)).tolist()


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


def vtk(lines: list[Floats]) -> bytes:
    """A legacy VTK file of polylines, as text."""
    points = np.concatenate(lines)
    ends = np.cumsum([0, *(len(line) for line in lines)])
    rows = [" ".join(map(str, [b - a, *range(a, b)])) for a, b in pairwise(ends)]
    head = f"# vtk DataFile Version 3.0\nstraight fibres in a box, mm\nASCII\nDATASET POLYDATA\nPOINTS {len(points)} double"
    places = [" ".join(f"{value:g}" for value in point) for point in points]
    return "\n".join([head, *places, f"LINES {len(rows)} {len(points) + len(rows)}", *rows, ""]).encode()


def entry(name: str, what: str, count: str, content: bytes) -> str:
    """The table of one file in card.toml."""
    return f"""
[[file]]
name = "{name}"
what = "{what}"
unit = "mm"
licence = "MIT, made for this project"
built = "build.py"
{count}
sha256 = "{hashlib.sha256(content).hexdigest()}"
"""


def main() -> None:
    """Write the box, its fibres and their card."""
    points, triangles = build()["box"]
    lines = fibres()
    attached = sides(points)
    volume = float(np.prod(HIGH - LOW))
    surface, threads = ply(points, triangles), vtk(lines)
    listed = "\n".join(["vertex", *map(str, attached), ""]).encode()
    size = f"triangles = {len(triangles)}\nvolume_mm3 = {volume:.3f}"
    text = "# A box to squeeze. Written by build.py; do not edit.\n"
    text += entry("box.ply", "box of 100 x 80 x 100, y from 10 to 90, in squares of 5", size, surface)
    text += entry(
        "fibres.vtk", "straight lines in the box, six along y and six along x", f"lines = {len(lines)}", threads
    )
    text += entry("sides.csv", "vertices in the middle of the faces across x", f"vertices = {len(attached)}", listed)
    (FOLDER / "sides.csv").write_bytes(listed)
    (FOLDER / "box.ply").write_bytes(surface)
    (FOLDER / "fibres.vtk").write_bytes(threads)
    (FOLDER / "card.toml").write_text(text, encoding="utf-8")
    print(
        f"box: {len(points)} vertices, {len(triangles)} triangles; {len(lines)} fibres, {len(np.concatenate(lines))} points"
    )


if __name__ == "__main__":
    main()
