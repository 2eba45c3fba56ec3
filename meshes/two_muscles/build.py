"""Two flat muscles, one over the other, between the same two bones.

    python meshes/two_muscles/build.py

writes deep.ply, superficial.ply and card.toml beside this file. Lengths in mm; the muscles run along x from 0 to 100, and z points
from the deep muscle to the superficial one.

A cross-section is an ellipse, whose size grows as ``0.4 + 0.6 sin(pi x / 100)`` from the flat ends to the middle. Its semi-axes in
the middle are 20 and 8 mm for the deep muscle, 16 and 6 mm for the superficial one. The middle line of the deep muscle is straight;
that of the superficial muscle is curved, so that a gap of 2 mm remains between the muscles along their middle.
"""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FOLDER = Path(__file__).resolve().parent
LENGTH, GAP, STATIONS, RINGS, AROUND = 100.0, 2.0, 31, 4, 28
SIZES = {"deep": (20.0, 8.0), "superficial": (16.0, 6.0)}  # semi-axes along y and z in the middle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def growth(x: Floats) -> Floats:
    """The size of the cross-sections at ``x``, 1 in the middle."""
    return np.asarray(0.4 + 0.6 * np.sin(np.pi * x / LENGTH))


def muscle(name: str) -> tuple[Floats, Ints]:
    """The surface of a muscle, with outward triangles: rings around it, and ends of rings around a middle point."""
    wide, high = SIZES[name]
    lift = 0.0 if name == "deep" else SIZES["deep"][1] + high
    angles = 2 * np.pi * np.arange(AROUND) / AROUND
    inner = [(x, (i + 1) / RINGS) for x, rings in ((0.0, range(RINGS - 1)),) for i in rings]
    outer = [(x, 1.0) for x in np.linspace(0, LENGTH, STATIONS)]
    rings = [*inner, *outer, *((LENGTH, share) for _, share in reversed(inner))]
    points = [
        np.column_stack(
            [
                np.full(AROUND, x),
                share * wide * growth(np.array(x)) * np.cos(angles),
                share * high * growth(np.array(x)) * np.sin(angles) + middle(x, lift),
            ]
        )
        for x, share in rings
    ]
    ends = [[0.0, 0.0, middle(0.0, lift)], [LENGTH, 0.0, middle(LENGTH, lift)]]
    first = np.arange(len(rings) - 1)[:, None] * AROUND + np.arange(AROUND)
    beside = np.arange(len(rings) - 1)[:, None] * AROUND + (np.arange(AROUND) + 1) % AROUND
    sides = [np.stack([first, beside + AROUND, beside], -1), np.stack([first, first + AROUND, beside + AROUND], -1)]
    count, last = len(rings) * AROUND, (len(rings) - 1) * AROUND
    around = np.arange(AROUND)
    near = np.stack([np.full(AROUND, count), around, (around + 1) % AROUND], -1)
    far = np.stack([np.full(AROUND, count + 1), last + (around + 1) % AROUND, last + around], -1)
    triangles = np.concatenate([*(side.reshape(-1, 3) for side in sides), near, far])
    return np.concatenate([*points, ends]), triangles[:, ::-1]


def middle(x: float, lift: float) -> float:
    """The height of the middle line at ``x``, which is ``lift`` above the gap in the middle; 0 for the deep muscle."""
    return float(lift * growth(np.array(x)) + GAP) if lift else 0.0


def volume(points: Floats, triangles: Ints) -> float:
    """The volume inside the triangles [mm3]."""
    return float(np.linalg.det(points[triangles]).sum() / 6)


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


def build() -> dict[str, tuple[Floats, Ints]]:
    """The muscles by name: points (n, 3) [mm] and triangles (m, 3)."""
    return {name: muscle(name) for name in SIZES}


def main() -> None:
    """Write the muscles and their card."""
    text = "# Two muscles, one over the other. Written by build.py; do not edit.\n"
    for name, (points, triangles) in build().items():
        content = ply(points, triangles)
        (FOLDER / f"{name}.ply").write_bytes(content)
        text += f"""
[[file]]
name = "{name}.ply"
what = "the {name} one of two flat muscles, 100 long"
unit = "mm"
licence = "MIT, made for this project"
built = "build.py"
triangles = {len(triangles)}
volume_mm3 = {volume(points, triangles):.3f}
sha256 = "{hashlib.sha256(content).hexdigest()}"
"""
        print(f"{name}: {len(points)} vertices, {len(triangles)} triangles, {volume(points, triangles):.0f} mm3")
    (FOLDER / "card.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
