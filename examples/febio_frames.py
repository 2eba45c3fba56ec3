"""Frames from a run of FEBio on another mesh: node positions from FEBio's log, interpolated at the vertices of the surface.

FEBio's file needs <logfile><node_data data="x;y;z" delim="," file="nodes.txt"/></logfile>. Here another tetrahedral mesh and a log
of an affine motion replace a run, so that the result is known.
"""

from pathlib import Path

import meshio
import numpy as np
from own_scene import make
from scipy.spatial import cKDTree

import fem_reference as fr

NEAR = 30  # the number of tetrahedra near a vertex that are searched for the one that contains it


def shares(vertices: np.ndarray, nodes: np.ndarray, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each vertex (v, 3) the tetrahedron (v, 4) that contains it, or the nearest, and its barycentric coordinates (v, 4)."""
    _, near = cKDTree(nodes[tets].mean(axis=1)).query(vertices, min(NEAR, len(tets)))
    corners = nodes[tets[near]]  # (v, k, 4, 3)
    edges = np.swapaxes(corners[:, :, 1:] - corners[:, :, :1], 2, 3)
    last = np.linalg.solve(edges, (vertices[:, None] - corners[:, :, 0])[..., None])[..., 0]
    all_four = np.concatenate([1 - last.sum(axis=2, keepdims=True), last], axis=2)
    best, every = all_four.min(axis=2).argmax(axis=1), np.arange(len(vertices))
    return tets[near[every, best]], all_four[every, best]


def positions(log: str) -> dict[float, np.ndarray]:
    """Positions (n, 3) of the nodes in their order, for each time in FEBio's log."""
    found = {}
    for block in log.split("*Step")[1:]:
        rows = [line.split(",") for line in block.splitlines() if line[:1].isdigit()]
        time = float(block.split("*Time")[1].split("=")[1].split()[0])
        found[time] = np.array(sorted(rows, key=lambda row: int(row[0])), float)[:, 1:]
    return found


if __name__ == "__main__":
    case, rest = make(), meshio.read("my_muscle/muscle.ply")  # in mm, like the model in FEBio
    box = fr.box((6, 6, 12), (40.0, 40.0, 80.0), "tetrahedron")
    nodes, tets = box.points - [20, 20, 10], box.cells  # or meshio.read("mesh.vtk"): points and cells_dict["tetra"]
    motion = np.array([[0.0, 0.0, 0.1], [0.0, 0.02, 0.0], [0.0, 0.05, -0.04]])
    log = ""
    for step, time in enumerate((10, 20), start=1):
        rows = (
            f"{i},{x!r},{y!r},{z!r}\n" for i, (x, y, z) in enumerate((nodes + time / 20 * nodes @ motion.T).tolist(), 1)
        )
        log += f"*Step  = {step}\n*Time  = {time}\n*Data  = x;y;z\n" + "".join(rows)
    corners, weights = shares(rest.points, nodes, tets)
    Path("febio").mkdir(exist_ok=True)
    for time, at in {0: nodes, **positions(log)}.items():  # the time of this log is the frame number
        points = np.einsum("vk,vkd->vd", weights, at[corners])
        meshio.Mesh(points, rest.cells).write(f"febio/frame_{round(time):04d}.ply", binary=True)
    mine = fr.read_run("febio", case)  # and fem-reference compare my_muscle --candidate febio
    print("largest error [mm]:", abs(mine.positions[-1] - (rest.points + rest.points @ motion.T)).max().round(9))
# Ends in 0 within 1e-6: linear interpolation reproduces an affine motion exactly; files have at least single precision.
