"""A stored run in numpy, and the same file read as ParaView reads it: the greatest displacement of the muscle's surface."""

import json

import numpy as np
import pyvista
from own_scene import make

import fem_reference as fr

case = make()
run = fr.solve(case)  # a run that was solved before is read from the store
assert run.folder is not None
facts = json.loads((run.folder / "run.json").read_text(encoding="utf-8"))
print(facts["status"], "after", facts["cost"]["newton_iterations"], "Newton iterations, in", run.folder)

moved = np.linalg.norm(run.positions - run.surface.points, axis=2)  # (f, n) [mm]
print("by frame [mm]:", dict(zip(run.numbers, moved.max(axis=1).round(3).tolist(), strict=True)))
if run.fibre_positions is not None and run.fibres is not None:
    print("fibres:", len(run.fibres.offsets) - 1, "with", run.fibre_positions.shape[1], "points")

# In ParaView: File > Open > surface.pvd, then Apply. The same VTK reader in Python:
reader = pyvista.get_reader(run.folder / "surface.pvd")
reader.set_active_time_value(reader.time_values[-1])
points = np.asarray(reader.read()[0].points)
print("largest difference between the two [mm]:", np.abs(points - run.positions[-1]).max())
print("greatest displacement [mm]:", moved.max())
# Ends in 8.55 within 0.0855: pinned; 15 degrees at a radius of 33 mm are 8.6 mm.
