"""A block that is bent into a sector of a tube."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.runs.solved import Reached
from fem_reference.verification import truths
from fem_reference.verification.parts import ladder, neo_hooke, once

MU, BULK = 0.01, 1e4  # [MPa]; the truth is of incompressible material
THICKNESS, LENGTH, WIDTH = 10.0, 20.0, 2.5  # [mm]
ANGLE = 1.0  # [rad], between the ends: the faces are at 15.7 and 25.4 mm


@dataclass(frozen=True)
class Bend:
    """A block of ``thickness`` from x = 0 and of ``length`` [mm] about y = 0, bent by ``angle`` [rad] times the frame number."""

    thickness: float
    length: float
    angle: float

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        block = truths.find("rivlin").Flexure(1.0, self.thickness, self.length, self.angle * frame)
        centred = points - [self.thickness / 2, 0.0, 0.0]
        moves: Floats = block.positions(centred) - centred
        return moves


def bent(
    lab: Lab, n: int, element: str, mu: float = MU, faces: tuple[str, ...] = ("z0", "z1")
) -> tuple[Floats, Reached]:
    """The half y >= 0 of the block in 2n by 2n by 1 cells: its nodes at rest (n, 3) [mm], and bent; its lateral ``faces`` stay in
    their planes, ``mu`` [MPa].
    """
    mesh = shapes.box((2 * n, 2 * n, 1), (THICKNESS, LENGTH / 2, WIDTH), ELEMENTS[element][0], 2)
    fixed = (
        Prescribed("middle", "y0", (1,), Rest()),
        Prescribed("end", "y1", (0, 1, 2), Bend(THICKNESS, LENGTH, ANGLE)),
        *(Prescribed(face, face, (2,), Rest()) for face in faces),
    )
    body = Body(mesh, neo_hooke(mu, BULK), fixed, (0.0, 1.0))
    return mesh.points, lab.solve(body, element, first_step=0.5, residual=1e-9).last


def _moment(lab: Lab, n: int, element: str, mu: float = MU, faces: tuple[str, ...] = ("z0", "z1")) -> float:
    """Per width, on the end [N]."""
    _, state = bent(lab, n, element, mu, faces)
    return float(state.moments["end"][2] / WIDTH)


def _inner_radius(lab: Lab, n: int, faces: tuple[str, ...] = ("z0", "z1")) -> float:
    """Of the circle nearest to the nodes of the inner face [mm]."""
    rest, state = bent(lab, n, "Q2/Q1", faces=faces)
    return circle(state.points[rest[:, 0] == 0, :2])


def circle(points: Floats) -> float:
    """The radius of the circle ``x^2 + y^2 = 2 a x + 2 b y + c`` nearest to ``points`` (n, 2), [mm].

    >>> round(circle(np.array([[3.0, 1.0], [1.0, 3.0], [-1.0, 1.0]])), 12)
    2.0
    """
    squares = np.sum(points**2, axis=1)
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), squares)
    return float(np.sqrt(c + a**2 + b**2))


def _thickness(lab: Lab, n: int, faces: tuple[str, ...] = ("z0", "z1")) -> float:
    """Between the curved faces, halfway between the ends [mm]."""
    rest, state = bent(lab, n, "Q2/Q1", faces=faces)
    return float(np.ptp(state.points[rest[:, 1] == 0, 0]))


def _up_to_radius(lab: Lab) -> Finding:
    found = ladder(lab, _inner_radius, (1, 2, 3), THICKNESS / 2, _true_inner_radius)
    return replace(found, order=None, note="the error changes its sign between meshes: no order")


def _truth() -> Any:
    return truths.find("rivlin").Flexure(MU, THICKNESS, LENGTH, ANGLE)


def _true_moment() -> float:
    return float(_truth().moment())


def _true_inner_radius() -> float:
    return float(_truth().radii()[0])


def _true_thickness() -> float:
    return float(np.diff(_truth().radii())[0])


_FREE = ("z0",)
_UP = partial(ladder, size=THICKNESS / 2)
_BLOCK = partial(
    Entry,
    group="flexure",
    relative=True,
    kind="closed form",
    source="Rivlin 1949, doi 10.1098/rspa.1949.0004; validation/rivlin.py Flexure",
)

ENTRIES: tuple[Entry, ...] = (
    _BLOCK(
        name="flexure_moment_tetrahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by tetrahedra (P2/P1)",
        unit="N",
        truth=_true_moment,
        within=5e-5,
        because="discretisation of order 4, 1e-5 with 8 cells through the thickness; the material's K/mu of 1e6 adds 1e-6",
        measure=partial(_UP, value=partial(_moment, element="P2/P1"), counts=(1, 2, 4), truth=_true_moment),
        negative_control="one lateral face is free, so that the block may change its width",
        with_negative_control=partial(once, value=partial(_moment, element="P2/P1", faces=_FREE), count=4),
    ),
    _BLOCK(
        name="flexure_moment_hexahedra",
        title="Bending a block, half as thick as long, by one radian: the moment, by hexahedra (Q2/Q1)",
        unit="N",
        truth=_true_moment,
        within=1e-5,
        because="discretisation of order 4, 3e-6 with 6 cells through the thickness; K/mu of 1e6 adds 1e-6",
        measure=partial(_UP, value=partial(_moment, element="Q2/Q1"), counts=(1, 2, 3), truth=_true_moment),
        negative_control="the shear modulus is 1 % too large",
        with_negative_control=partial(once, value=partial(_moment, element="Q2/Q1", mu=1.01 * MU), count=3),
    ),
    _BLOCK(
        name="flexure_inner_radius",
        title="Bending a block, half as thick as long, by one radian: the radius of its inner face",
        unit="mm",
        truth=_true_inner_radius,
        within=1e-4,
        because="discretisation, 3e-5 with 6 cells through the thickness (Q2/Q1)",
        measure=_up_to_radius,
        negative_control="one lateral face is free, so that the block may change its width",
        with_negative_control=partial(once, value=partial(_inner_radius, faces=_FREE), count=3),
    ),
    _BLOCK(
        name="flexure_thickness",
        title="Bending a block, half as thick as long, by one radian: how thick it is halfway between its ends",
        unit="mm",
        truth=_true_thickness,
        within=3e-5,
        because="discretisation of order 4 or more, 7e-6 with 6 cells through the thickness (Q2/Q1)",
        measure=partial(_UP, value=_thickness, counts=(1, 2, 3), truth=_true_thickness),
        negative_control="one lateral face is free, so that the block may change its width",
        with_negative_control=partial(once, value=partial(_thickness, faces=_FREE), count=3),
    ),
)
