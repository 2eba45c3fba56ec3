"""A body without a scene file: points and cells in Python, a prescribed displacement, and the moment that it requires.

A bar of square section, free to warp, is twisted by one degree; at small strain its torque is 0.1406 mu a^4 theta / L
(Timoshenko and Goodier 1970).
"""

from itertools import permutations

import numpy as np

import fem_reference as fr

SIDE, LENGTH, MU, ANGLE, ACROSS, ALONG = 10.0, 30.0, 0.01, np.deg2rad(1.0), 6, 8  # mm, mm, MPa, rad

# The points of a grid, and its boxes, each cut into six tetrahedra along its diagonal.
shape = (ACROSS + 1, ACROSS + 1, ALONG + 1)
unit = np.indices(shape).reshape(3, -1).T / np.subtract(shape, 1)
points = unit * [SIDE, SIDE, LENGTH] - [SIDE / 2, SIDE / 2, 0]
start = np.indices((ACROSS, ACROSS, ALONG)).reshape(3, -1).T
paths = [np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0) for order in permutations(range(3))]
corners = np.concatenate([start[:, None] + path for path in paths])
cells = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), shape)
turned = np.linalg.det(points[cells[:, 1:]] - points[cells[:, :1]]) < 0
cells[turned] = cells[turned][:, [1, 0, 2, 3]]


def face(height: float) -> np.ndarray:
    """The triangles (f, 3) of the boundary at a height."""
    on = np.isclose(points[cells][..., 2], height)
    return np.stack([cell[here] for cell, here in zip(cells, on, strict=True) if here.sum() == 3])


def twist(rest: np.ndarray, frame: float) -> np.ndarray:
    """Displacements (n, 3) [mm] of a rotation about z by the angle times ``frame``."""
    c, s = np.cos(frame * ANGLE) - 1, np.sin(frame * ANGLE)
    return np.stack([c * rest[:, 0] - s * rest[:, 1], s * rest[:, 0] + c * rest[:, 1], 0 * rest[:, 0]], axis=1)


mesh = fr.Cells(points, cells, "tetrahedron", 1, {"bottom": face(0.0), "top": face(LENGTH)})
effects = (fr.make_effect("neo_hooke", mu=MU), fr.make_effect("incompressible", bulk=1000 * MU))
bottom = fr.Prescribed("bottom", "bottom", (0, 1), lambda rest, _: 0 * rest)  # free to warp along z,
middle = fr.Prescribed("top", "top", (0, 1), twist)
still = fr.Prescribed("still", "bottom", (2,), lambda rest, _: 0 * rest, stiffness=1e-6)  # except for weak springs
solved = fr.solve_body(fr.Body(mesh, effects, (bottom, middle, still), frames=(0.0, 1.0)), first_step=1)
torque = 0.1406 * MU * SIDE**4 * ANGLE / LENGTH
print("torque [N mm]:", solved.last.moments["top"][2], "at small strain:", torque)
print("ratio:", solved.last.moments["top"][2] / torque)
# Ends in 1 within 5e-3: torsion at small strain.
