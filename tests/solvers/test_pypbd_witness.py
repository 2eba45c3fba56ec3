"""A witness for ``pbd`` and ``xpbd``: the library PositionBasedDynamics (pypbd) moves the same particles alike.

Its distance constraints, plain and extended, and its dihedral constraint are the same algorithms in double precision, so that
what may differ is rounding. Of volumes it knows that of a tetrahedron only: the smallest closed surface.
"""

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_reference.foundations.mesh import TET_FACES
from fem_reference.solvers import pbd, xpbd
from fem_reference.solvers.pbd_kernels import (
    LARGEST_TURN,
    dihedrals,
    distances,
    project_dihedrals,
    project_volume,
    volume,
)
from tests.solvers.test_xpbd import NONE, graph

pytestmark = pytest.mark.skipif(importlib.util.find_spec("pypbd") is None, reason="pypbd is not installed")

SCENE = Path(__file__).parents[1] / "pypbd_scene.py"
GRAVITY = np.array([0.0, -9.81, 0.0])
SECONDS, SWEEPS = 5e-3, 4
# A cord of eight masses from a nail, laid out sideways, with three braces; no two masses and no two springs are alike.
RANDOM = np.random.default_rng(1)
CORD = np.cumsum(RANDOM.uniform(0.05, 0.15, (8, 1)) * [1, 0, 0], axis=0) + RANDOM.normal(0, 0.01, (8, 3))
MASSES = np.r_[0.0, RANDOM.uniform(0.01, 0.03, 7)]
LOOSE = (MASSES > 0)[:, None]
INVERSE_MASSES = np.divide(1, MASSES, out=np.zeros(8), where=MASSES > 0)
EDGES = np.array([[i, i + 1] for i in range(7)] + [[0, 2], [3, 6], [2, 5]])
SPRINGS = RANDOM.uniform(20, 60, len(EDGES))  # [N/m]


def witness(rest, points, masses, constraints, steps=0):
    """Positions (n, 3) in the end, and the order (c,) in which it took the constraints."""
    scene = {
        "rest": rest.tolist(),
        "points": points.tolist(),
        "masses": masses.tolist(),
        "constraints": constraints,
        "seconds": SECONDS,
        "sweeps": SWEEPS,
        "steps": steps,
    }
    one_thread = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, str(SCENE)],
        input=json.dumps(scene),
        env=one_thread,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    return np.array(found["points"]), np.array(found["order"])


def fallen(kind, stiffness, steps):
    """The cord after so many time steps under gravity, and its edges (e, 2), lengths (e,) and ``stiffness`` (e,) in order."""
    constraints = [[kind, edge, one] for edge, one in zip(EDGES.tolist(), stiffness.tolist(), strict=True)]
    points, order = witness(CORD, CORD, MASSES, constraints, steps)
    edges = np.ascontiguousarray(EDGES[order])
    return points, edges, distances(CORD.copy(), edges), stiffness[order]


# Both take the same steps but for roundings of 1e-16, which a cord that swings about lets grow: to 1e-14 in a hundred steps,
# measured, in which its end moves by more than 1 m. A thousand times that is still nothing that physics does.
@pytest.mark.parametrize(("steps", "rounding"), [(10, 1e-14), (100, 1e-11)])
def test_a_cord_of_springs_falls_as_theirs(steps, rounding):
    theirs, edges, lengths, springs = fallen("distance_xpbd", SPRINGS, steps)
    cord = replace(graph(INVERSE_MASSES, edges, 0.0, 0.0), lengths=lengths, edge_softness=1 / springs)
    points, velocities = CORD.copy(), np.zeros(CORD.shape)
    for _ in range(steps):
        points, velocities = xpbd.advance(points, velocities, cord, xpbd.XpbdStep(SECONDS, SWEEPS, 0.0, tuple(GRAVITY)))
    np.testing.assert_allclose(points, theirs, rtol=0, atol=rounding)
    assert np.abs(points - CORD).max() > (1 if steps == 100 else 0.01)


@pytest.mark.parametrize(("steps", "rounding"), [(1, 1e-14), (100, 1e-11)])
def test_a_cord_of_position_based_dynamics_falls_as_theirs(steps, rounding):
    theirs, edges, lengths, share = fallen("distance", SPRINGS / SPRINGS.max(), steps)
    cord = pbd.PbdConstraints(INVERSE_MASSES, edges, lengths, share, NONE, 0.0, np.zeros((0, 4), np.int64), np.zeros(0))
    rules = pbd.PbdSettings(sub_iterations=1, solver_iterations=SWEEPS, damping=0, stretch=1, volume=0, bending=0)
    points, displacement = CORD.copy(), np.zeros(CORD.shape)
    for _ in range(steps):
        points, displacement = pbd.advance(points, displacement + np.where(LOOSE, SECONDS**2 * GRAVITY, 0), cord, rules)
    np.testing.assert_allclose(points, theirs, rtol=0, atol=rounding)
    assert np.abs(points - CORD).max() > (1 if steps == 100 else 1e-4)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("stiffness", [1.0, 0.4])
def test_a_pair_of_triangles_opens_as_theirs(side, stiffness):
    # Theirs is the angle of the normals, pi less ours, and their gradients, of Bridson, Marino and Fedkiw 2003, are its own: one
    # projection is the same as long as it turns by less than LARGEST_TURN. Coordinates of 1 carry roundings of some 1e-16.
    hinge, masses = np.array([[2, 3, 0, 1]]), np.array([1, 2, 0.5, 1.5])
    rest = np.array([[-1, 0.1, 0.3 * side], [0.9, 0, 0.4 * side], [0, -0.5, 0], [0, 0.6, 0]])
    start = rest + [[0, 0, 0.1], [0.03, 0, 0], [0, 0.02, 0], [0, 0, -0.05]]
    wanted = dihedrals(rest.copy(), hinge)
    assert 0.05 < abs(dihedrals(start.copy(), hinge)[0] - wanted[0]) < LARGEST_TURN
    theirs, _ = witness(rest, start, masses, [["dihedral", [0, 1, 2, 3], stiffness]])
    points = start.copy()
    project_dihedrals(points, 1 / masses, hinge, wanted, stiffness)
    np.testing.assert_allclose(points, theirs, rtol=0, atol=1e-14)
    assert np.abs(points - start).max() > 5e-3


@pytest.mark.parametrize("stiffness", [1.0, 0.4])
def test_a_tetrahedron_fills_as_theirs_but_for_their_sixth(stiffness):
    # Their value has the 1/6 of a tetrahedron's volume and their gradient has not: what they call 1 takes away a sixth.
    masses = np.array([1, 2, 0.5, 1.5])
    rest = np.array([[0.0, 0, 0], [1.1, 0, 0.1], [0, 0.9, 0], [0.1, 0.1, 1]])
    start = rest + [[0.03, 0, 0], [0, 0.05, 0], [0.02, 0, 0.04], [0, 0, 0.06]]
    theirs, _ = witness(rest, start, masses, [["volume", [0, 1, 2, 3], stiffness]])
    points = start.copy()
    project_volume(points, 1 / masses, TET_FACES, volume(rest.copy(), TET_FACES)[0], stiffness / 6)
    np.testing.assert_allclose(points, theirs, rtol=0, atol=1e-14)
    assert np.abs(points - start).max() > 5e-4
