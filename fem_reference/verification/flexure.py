"""A block that is bent into a sector of a tube."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.runs.store import Frame
from fem_reference.verification.parts import control, find, neo_hooke, sliding

rivlin = find("rivlin")
MU, BULK = 0.01, 1e4  # [MPa]; the truth is of incompressible material
THICKNESS, LENGTH, WIDTH = 10.0, 20.0, 2.5  # [mm]
ANGLE = 1.0  # [rad], between the ends: the faces are at 15.7 and 25.4 mm


Reading = Callable[[Floats, Frame], float]


@dataclass(frozen=True)
class Flexed:
    """A block of ``thickness`` from x = 0 and of ``length`` [mm] about y = 0, bent by ``angle`` [rad] times the frame number."""

    thickness: float
    length: float
    angle: float

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        block = rivlin.Flexure(1.0, self.thickness, self.length, self.angle * frame)
        centred = points - [self.thickness / 2, 0.0, 0.0]
        moves: Floats = block.positions(centred) - centred
        return moves


def bent(
    lab: Lab, n: int, reading: str, element: str = "Q2/Q1", mu: float = MU, faces: tuple[str, ...] = ("z0", "z1")
) -> float:
    """A reading of the half y >= 0 of the block in 2n by 2n by 1 cells, whose lateral ``faces`` stay in their planes; ``mu``
    [MPa].
    """
    mesh = shapes.box((2 * n, 2 * n, 1), (THICKNESS, LENGTH / 2, WIDTH), ELEMENTS[element][0], 2)
    end = Prescribed("y1", "y1", (0, 1, 2), Flexed(THICKNESS, LENGTH, ANGLE))
    body = Body(mesh, neo_hooke(mu, BULK), (*sliding("y0"), end, *sliding(*faces)), (0.0, 1.0))
    return READINGS[reading](mesh.points, lab.solve(body, element, first_step=0.5, residual=1e-9).last)


def circle(points: Floats) -> float:
    """The radius of the circle ``x^2 + y^2 = 2 a x + 2 b y + c`` nearest to ``points`` (n, 2), [mm].

    >>> round(circle(np.array([[3.0, 1.0], [1.0, 3.0], [-1.0, 1.0]])), 12)
    2.0
    """
    squares = np.sum(points**2, axis=1)
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), squares)
    return float(np.sqrt(c + a**2 + b**2))


# What is read from nodes at rest (n, 3) [mm] and the state: the moment on the end per width [N], the radius of the circle nearest
# to the nodes of the inner face [mm], and the distance between the curved faces, halfway between the ends [mm].
READINGS: dict[str, Reading] = {
    "moment": lambda _, state: float(state.moments["y1"][2] / WIDTH),
    "inner radius": lambda rest, state: circle(state.points[rest[:, 0] == 0, :2]),
    "thickness": lambda rest, state: float(np.ptp(state.points[rest[:, 1] == 0, 0])),
}
TRUE = rivlin.Flexure(MU, THICKNESS, LENGTH, ANGLE)
BLOCK = partial(
    Entry,
    group="flexure",
    measure=bent,
    relative=True,
    kind="closed form",
    source="Rivlin 1949, doi 10.1098/rspa.1949.0004; validation/rivlin.py Flexure",
    refinement=Refinement((1, 2, 3), THICKNESS / 2, order=4),
)
FREE: dict[str, Any] = {
    "negative_control": "one lateral face is free, so that the block may change its width",
    "wrong": {"faces": ("z0",)},
}

ENTRIES: tuple[Entry, ...] = (
    BLOCK(
        name="flexure_moment_tetrahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by tetrahedra (P2/P1)",
        unit="N",
        given={"reading": "moment", "element": "P2/P1"},
        **FREE,
        truth=TRUE.moment,
        within=5e-5,
        because="discretisation of order 4, 1e-5 with 8 cells through the thickness; the material's K/mu of 1e6 adds 1e-6",
        refinement=Refinement((1, 2, 4), THICKNESS / 2, order=4),
    ),
    BLOCK(
        name="flexure_moment_hexahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by hexahedra (Q2/Q1)",
        unit="N",
        given={"reading": "moment"},
        **control("the shear modulus is 1 % too large", mu=1.01 * MU),
        truth=TRUE.moment,
        within=1e-5,
        because="discretisation of order 4, 3e-6 with 6 cells through the thickness; K/mu of 1e6 adds 1e-6",
    ),
    BLOCK(
        name="flexure_inner_radius",
        title="Bending a block, half as thick as long, by one radian: the radius of its inner face",
        unit="mm",
        given={"reading": "inner radius"},
        **FREE,
        truth=lambda: TRUE.radii()[0],
        within=1e-4,
        because="discretisation, 3e-5 with 6 cells through the thickness (Q2/Q1)",
        refinement=Refinement(
            (1, 2, 3), THICKNESS / 2, order=None, note="the error changes its sign between meshes: no order"
        ),
    ),
    BLOCK(
        name="flexure_thickness",
        title="Bending a block, half as thick as long, by one radian: how thick it is halfway between its ends",
        unit="mm",
        given={"reading": "thickness"},
        **FREE,
        truth=lambda: np.diff(TRUE.radii())[0],
        within=3e-5,
        because="discretisation of order 4 or more, 7e-6 with 6 cells through the thickness (Q2/Q1)",
    ),
)
