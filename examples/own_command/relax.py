"""A solver of your own as a command: attached vertices follow their bones; others take the mean displacement of their neighbours.

    python relax.py --iterations 30 SCENE OUT

SCENE is a folder written by "fem-reference export"; a mesh for each frame is written into OUT.
"""

import argparse
import csv
import json
from pathlib import Path

import meshio
import numpy as np


def table(path: Path) -> list[list[str]]:
    """The rows of a CSV file without its header."""
    return list(csv.reader(path.read_text().splitlines()))[1:]


def solve(scene: Path, out: Path, iterations: int) -> None:
    """Average the displacements of neighbours, starting from those of the previous frame."""
    rest = meshio.read(scene / "muscle.ply")
    triangles = rest.cells_dict["triangle"]
    edges = np.vstack(
        [triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]
    )  # on a closed surface, each edge once in each direction
    neighbours = np.bincount(edges[:, 0])[:, None]
    attached, poses = table(scene / "attachments.csv"), table(scene / "poses.csv")
    vertices = [int(vertex) for _, _, vertex in attached]
    moves = np.zeros_like(rest.points)
    frames = json.loads((scene / "scene.json").read_text())["frames"]
    for frame in frames:
        pose = {bone: np.array(m, float).reshape(4, 4) for bone, number, *m in poses if int(number) == frame}
        carried = [pose[bone] @ [*rest.points[int(vertex)], 1] for _, bone, vertex in attached]
        for _ in range(iterations if frame > frames[0] else 0):
            total = np.zeros_like(moves)
            np.add.at(total, edges[:, 0], moves[edges[:, 1]])
            moves = total / neighbours
            moves[vertices] = np.array(carried)[:, :3] - rest.points[vertices]
        meshio.Mesh(rest.points + moves, rest.cells).write(out / f"frame_{frame:04d}.ply")


if __name__ == "__main__":
    words = argparse.ArgumentParser()
    words.add_argument("--iterations", type=int, required=True)
    words.add_argument("scene", type=Path)
    words.add_argument("out", type=Path)
    given = words.parse_args()
    solve(given.scene, given.out, given.iterations)
