"""Generated bodies: a fusiform muscle, and an ellipsoid and a spindle of tetrahedra between two round bones."""

from dataclasses import replace
from typing import Any

import numpy as np
import pyvista

from fem_reference.effects import make
from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh, boundary
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry import tessellation
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, ByCell, Cells, Prescribed
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.paths import Rest, Turn
from fem_reference.problems.setup import AttachedVertices, Bone, Setup

# The fusiform body: its length and its radius in the middle [mm], and the fraction by which it is thinner at its ends.
LENGTH, RADIUS, THINNER = 60.0, 10.0, 0.6
# Its top turns about a hinge beside its middle [mm] by this angle [rad] in this number of frames: it bends, and stretches by 1/6.
HINGE, ANGLE, FRAMES = (-25.0, 0.0, 30.0), -0.5, 6
EFFECTS: dict[str, dict[str, Any]] = {
    "neo_hooke": {"mu": "10 kPa"},
    "incompressible": {"bulk": "10 MPa"},
    "fibre_passive_febio": {"c3": "10 kPa", "c4": 12.0, "c5": "3 MPa", "linear_from": 1.3},
}
# Semi-axes of the ellipsoid (the long one along z), and the radius of the bones beyond its ends [mm].
SHORT, LONG, BONE = 10.0, 40.0, 15.0
# The fraction of half its length beyond which the ellipsoid is attached, and the rotation of the upper bone per frame [rad].
ATTACHED, TURN = 0.8, 0.01


def fusiform(element: str, rings: int, slices: int) -> Body:
    """A spindle-shaped muscle along z with ``slices`` layers of straight cells and ``rings`` of cells around its core. Its fibres
    run from end to end, its bottom is fixed, and its top turns.
    """
    straight = shapes.cylinder(RADIUS, LENGTH, rings, slices, ELEMENTS[element][0], 1)
    along = 2 * straight.points[:, 2:] / LENGTH - 1
    points = straight.points * np.hstack([np.repeat(1 - THINNER * along**2, 2, axis=1), np.ones_like(along)])
    mesh = replace(straight, points=points)
    knots = ((0.0, 0.0), (float(FRAMES), 1.0))
    ends = (
        Prescribed("bottom", "bottom", (0, 1, 2), Rest()),
        Prescribed("top", "top", (0, 1, 2), Turn((0.0, 1.0, 0.0), ANGLE, HINGE, knots=knots)),
    )
    acting = tuple(make(name, **parameters) for name, parameters in EFFECTS.items())
    return Body(mesh, acting, ends, tuple(map(float, range(FRAMES + 1))), ByCell(_fibres(mesh)))


def _fibres(mesh: Cells) -> Floats:
    """The unit vectors (m, 3) along the fibres in the cells of the spindle: lines at a constant fraction of its radius."""
    x, y, z = mesh.points[mesh.cells].mean(axis=1).T
    along = 2 * z / LENGTH - 1
    # The slope of the logarithm of the radius along the axis [1/mm].
    opening = -4 * THINNER * along / LENGTH / (1 - THINNER * along**2)
    tangents = np.stack([x * opening, y * opening, np.ones_like(z)], axis=1)
    return np.asarray(tangents / np.linalg.norm(tangents, axis=1)[:, None])


def ellipsoid(subdivisions: int) -> Setup:
    """The ellipsoid of ``20 * 4^subdivisions`` triangles, both ends attached to bones, of which the upper one turns."""
    sphere = pyvista.Icosphere(nsub=subdivisions)
    unit = sphere.points / np.linalg.norm(sphere.points, axis=1)[:, None]
    surface = Surface(unit * [SHORT, SHORT, LONG], sphere.regular_faces.astype(np.int64))
    bones, z = _bones(LONG, surface.points), unit[:, 2]
    ends = (np.flatnonzero(z < -ATTACHED), np.flatnonzero(z > ATTACHED))
    attached = tuple(AttachedVertices(bone.name, bone, end) for bone, end in zip(bones, ends, strict=True))
    return Setup(surface, bones, attached, (0, 1), None)


def spindle(rings: int, slices: int) -> MuscleProblem:
    """The fusiform body filled with tetrahedra, its ends attached to bones, of which the upper one turns."""
    cells = fusiform("P2/P1", rings, slices).mesh
    half = LENGTH / 2
    points = cells.points - [0.0, 0.0, half]
    facets = {name: cells.facets[name] for name in ("bottom", "top")}
    mesh = TetMesh(points, cells.cells, facets)
    outside, _ = boundary(mesh.tets)
    used, triangles = np.unique(outside, return_inverse=True)
    surface = Surface(points[used], triangles.reshape(-1, 3))
    bones = _bones(half, surface.points)
    ends = (np.flatnonzero(np.isclose(surface.points[:, 2], end)) for end in (-half, half))
    attached = tuple(AttachedVertices(*each) for each in zip(facets, bones, ends, strict=True))
    axis = Polylines(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), np.array([0, 2]))
    return MuscleProblem(surface, bones, attached, (0, 1), None, mesh, (), axis)


def _bones(half: float, beside: Floats) -> tuple[Bone, Bone]:
    """Balls beyond the ends at -half and half [mm], the upper one turning about the middle."""
    turning: RigidMotion = RigidMotion((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 100.0), (0.0, 100 * TURN))
    balls = (Sphere((0.0, 0.0, side * (half + BONE)), BONE) for side in (-1, 1))
    (lower, below), (upper, above) = [(ball, tessellation.tessellated(ball, beside, "bone")) for ball in balls]
    return Bone("lower", below, None, solid=lower), Bone("upper", above, turning, solid=upper)
