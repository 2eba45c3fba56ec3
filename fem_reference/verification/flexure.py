"""A block that is bent into a sector of a tube."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.runs.store import Frame
from fem_reference.verification.parts import neo_hooke, sliding
from fem_reference.verification.truths import find

rivlin = find("rivlin")
MU, BULK = 0.01, 1e4  # [MPa]; the truth is of incompressible material
THICKNESS, LENGTH, WIDTH = 10.0, 20.0, 2.5  # [mm]
ANGLE = 1.0  # [rad], between the ends: the faces are at 15.7 and 25.4 mm


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


def bent(lab: Lab, n: int, element: str, mu: float, faces: tuple[str, ...]) -> tuple[Floats, Frame]:
    """The half y >= 0 of the block in 2n by 2n by 1 cells: its nodes at rest (n, 3) [mm], and bent; its lateral ``faces`` stay in
    their planes, ``mu`` [MPa].
    """
    mesh = shapes.box((2 * n, 2 * n, 1), (THICKNESS, LENGTH / 2, WIDTH), ELEMENTS[element][0], 2)
    end = Prescribed("y1", "y1", (0, 1, 2), Flexed(THICKNESS, LENGTH, ANGLE))
    body = Body(mesh, neo_hooke(mu, BULK), (*sliding("y0"), end, *sliding(*faces)), (0.0, 1.0))
    return mesh.points, lab.solve(body, element, first_step=0.5, residual=1e-9).last


def moment(lab: Lab, n: int, element: str, mu: float = MU, faces: tuple[str, ...] = ("z0", "z1")) -> float:
    """Per width, on the end [N]."""
    _, state = bent(lab, n, element, mu, faces)
    return float(state.moments["y1"][2] / WIDTH)


def inner_radius(lab: Lab, n: int, faces: tuple[str, ...]) -> float:
    """The radius of the circle nearest to the nodes of the inner face [mm]."""
    rest, state = bent(lab, n, "Q2/Q1", MU, faces)
    return circle(state.points[rest[:, 0] == 0, :2])


def circle(points: Floats) -> float:
    """The radius of the circle ``x^2 + y^2 = 2 a x + 2 b y + c`` nearest to ``points`` (n, 2), [mm].

    >>> round(circle(np.array([[3.0, 1.0], [1.0, 3.0], [-1.0, 1.0]])), 12)
    2.0
    """
    squares = np.sum(points**2, axis=1)
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), squares)
    return float(np.sqrt(c + a**2 + b**2))


def thickness(lab: Lab, n: int, faces: tuple[str, ...]) -> float:
    """The distance [mm] between the curved faces, halfway between the ends."""
    rest, state = bent(lab, n, "Q2/Q1", MU, faces)
    return float(np.ptp(state.points[rest[:, 1] == 0, 0]))


TRUE = rivlin.Flexure(MU, THICKNESS, LENGTH, ANGLE)
BLOCK = partial(
    Entry,
    group="flexure",
    relative=True,
    kind="closed form",
    source="Rivlin 1949, doi 10.1098/rspa.1949.0004; validation/rivlin.py Flexure",
    refinement=Refinement((1, 2, 3), THICKNESS / 2, order=4),
)
FREE = "one lateral face is free, so that the block may change its width"

ENTRIES: tuple[Entry, ...] = (
    BLOCK(
        name="flexure_moment_tetrahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by tetrahedra (P2/P1)",
        unit="N",
        measure=moment,
        given={"element": "P2/P1"},
        negative_control=FREE,
        wrong={"faces": ("z0",)},
        truth=TRUE.moment,
        within=5e-5,
        because="discretisation of order 4, 1e-5 with 8 cells through the thickness; the material's K/mu of 1e6 adds 1e-6",
        refinement=Refinement((1, 2, 4), THICKNESS / 2, order=4),
    ),
    BLOCK(
        name="flexure_moment_hexahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by hexahedra (Q2/Q1)",
        unit="N",
        measure=moment,
        given={"element": "Q2/Q1"},
        negative_control="the shear modulus is 1 % too large",
        wrong={"mu": 1.01 * MU},
        truth=TRUE.moment,
        within=1e-5,
        because="discretisation of order 4, 3e-6 with 6 cells through the thickness; K/mu of 1e6 adds 1e-6",
    ),
    BLOCK(
        name="flexure_inner_radius",
        title="Bending a block, half as thick as long, by one radian: the radius of its inner face",
        unit="mm",
        measure=inner_radius,
        given={"faces": ("z0", "z1")},
        negative_control=FREE,
        wrong={"faces": ("z0",)},
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
        measure=thickness,
        given={"faces": ("z0", "z1")},
        negative_control=FREE,
        wrong={"faces": ("z0",)},
        truth=lambda: np.diff(TRUE.radii())[0],
        within=3e-5,
        because="discretisation of order 4 or more, 7e-6 with 6 cells through the thickness (Q2/Q1)",
    ),
)
