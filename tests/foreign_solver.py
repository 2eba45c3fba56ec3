"""Somebody else's solver, as bad as can be: the whole muscle turns with the bone that moves. It knows an export, nothing of ours.

python foreign_solver.py EXPORT FRAMES
"""

import csv
import json
import sys
from pathlib import Path

import meshio
import numpy as np

export, frames = Path(sys.argv[1]), Path(sys.argv[2])
scene = json.loads((export / "scene.json").read_text())
muscle = meshio.read(export / "muscle.ply")
mover = next(bone["name"] for bone in scene["bones"] if "motion" in bone)
poses = {}
with (export / "poses.csv").open(newline="") as table:
    for bone, frame, *entries in list(csv.reader(table))[1:]:
        if bone == mover:
            poses[int(frame)] = np.array(entries, float).reshape(4, 4)

frames.mkdir()
for frame in scene["frames"]:
    metres = (muscle.points @ poses[frame][:3, :3].T + poses[frame][:3, 3]) / 1000
    meshio.Mesh(metres, muscle.cells).write(frames / f"frame_{frame:04d}.ply")
(frames / "candidate.toml").write_text(
    'name = "stiff"\nversion = "0.1"\nunit = "m"\nseconds_per_frame = 0.002\nthreads = 1\n'
)
