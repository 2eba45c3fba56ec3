"""Bodies that are bent and twisted: a block into a sector of a tube, a cylinder by a finite angle, a square bar by a small one."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import Effect
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Turn
from fem_reference.runs.store import Frame
from fem_reference.verification.parts import SLOW, clamped, control, find, mooney_rivlin, neo_hooke, sliding

rivlin = find("rivlin")
# [MPa]; C1 and C2 make a Mooney-Rivlin law of the shear modulus MU. The truths are of incompressible material.
MU, BULK = 0.01, 1e4
C1, C2 = 0.003, 0.002
# The bent block [mm], and the angle [rad] between its ends: the faces are at 15.7 and 25.4 mm.
THICKNESS, LENGTH, WIDTH, ANGLE = 10.0, 20.0, 2.5, 1.0
# Radius and height of the cylinder [mm], and its twist [rad/mm]: 0.5 rad from end to end, a shear of 0.5 at its side.
RADIUS, TALL, TWIST = 10.0, 10.0, 0.05
# Side and length of the square bar [mm], and its twist [rad/mm]: a shear of 0.0007 at its edges.
SIDE, SHORT, SMALL_TWIST = 10.0, 2.5, 1e-4

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


# Readings of nodes at rest (n, 3) [mm] and the state: the moment on the end per width [N], the radius of the circle nearest
# to the nodes of the inner face [mm], and the distance between the curved faces, halfway between the ends [mm].
READINGS: dict[str, Reading] = {
    "moment": lambda _, state: float(state.moments["y1"][2] / WIDTH),
    "inner radius": lambda rest, state: circle(state.points[rest[:, 0] == 0, :2]),
    "thickness": lambda rest, state: float(np.ptp(state.points[rest[:, 1] == 0, 0])),
}


def twisted(lab: Lab, rings: int, end: str, element: str, material: tuple[Effect, ...], degree: int = 2) -> float:
    """``moments`` [N mm] or ``forces`` [N] of the top about or along the axis of the cylinder, whose ends are turned by TWIST times
    their height and fixed there; with ``degree`` 1 its cells are straight.
    """
    mesh = shapes.cylinder(RADIUS, TALL, rings, rings, ELEMENTS[element][0], degree)
    turn = Turn((0.0, 0.0, 1.0), TWIST, per_length=True)
    fixed = tuple(Prescribed(face, face, (0, 1, 2), turn) for face in ("bottom", "top"))
    state = lab.solve(Body(mesh, material, fixed, (0.0, 1.0)), element, first_step=0.5, residual=1e-9).last
    return float(getattr(state, end)["top"][2])


def square_bar(lab: Lab, cells: int, element: str, turned: tuple[int, ...]) -> float:
    """Torque per twist [N mm2]. A quarter of the bar, as small displacements are antisymmetric about the planes of its axis; its
    ends are ``turned`` along these axes.
    """
    half = SIDE / 2
    mesh = shapes.box((cells, cells, 1), (half, half, SHORT), ELEMENTS[element][0])
    turn = Turn((0.0, 0.0, 1.0), SMALL_TWIST, per_length=True)
    ends = tuple(Prescribed(face, face, turned, turn) for face in ("z0", "z1"))
    fixed = (*clamped("x0", components=(1, 2)), *clamped("y0", components=(0, 2)), *ends)
    body = Body(mesh, neo_hooke(MU, BULK), fixed, (0.0, 1.0))
    return float(4 * lab.solve(body, element, first_step=1.0, residual=1e-12).last.moments["z1"][2] / SMALL_TWIST)


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
FREE = control("one lateral face is free, so that the block may change its width", faces=("z0",))

TWISTED, TWISTED_MOONEY_RIVLIN = (rivlin.Torsion(*moduli, RADIUS, TWIST) for moduli in ((MU / 2, 0.0), (C1, C2)))
NEO_HOOKE, MOONEY_RIVLIN = neo_hooke(MU, BULK), mooney_rivlin(C1, C2, BULK)
CYLINDER = partial(
    Entry,
    group="torsion",
    measure=twisted,
    relative=True,
    kind="closed form",
    source="Rivlin 1949, doi 10.1098/rsta.1949.0009; validation/rivlin.py Torsion",
)
SQUARE = partial(
    Entry,
    group="torsion",
    unit="N mm2",
    measure=square_bar,
    **control("the ends are kept plane, as a round bar would keep them", turned=(0, 1, 2)),
    truth=lambda: find("torsion").square_bar_stiffness(MU, SIDE),
    relative=True,
    kind="closed form",
    source="Timoshenko and Goodier 1970, art. 109; validation/torsion.py",
    refinement=Refinement((2, 4, 8), SIDE / 2, order=4),
)

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
    *(
        CYLINDER(
            name=f"torsion_moment_{cells}",
            title=f"Twisting a cylinder by half a radian: the moment, by curved {cells} ({element})",
            unit="N mm",
            given={"end": "moments", "element": element, "material": NEO_HOOKE},
            **control("straight cells, whose surface has flat facets", degree=1),
            truth=TWISTED.moment,
            within=within,
            because=f"discretisation of order 4, {left} cells along the radius; the material's K/mu of 1e6 adds 1e-6",
            refinement=Refinement(counts, RADIUS / 2, order=4),
            **SLOW,
        )
        for cells, element, within, left, counts in (
            ("tetrahedra", "P2/P1", 5e-4, "8e-5 with 8", (1, 2, 4)),
            ("hexahedra", "Q2/Q1", 1e-4, "1.6e-5 with 6", (1, 2, 3)),
        )
    ),
    CYLINDER(
        name="torsion_axial_force",
        title="Twisting a cylinder by half a radian: the force that keeps it from growing longer (Poynting effect)",
        unit="N",
        given={"end": "forces", "element": "Q2/Q1", "material": NEO_HOOKE},
        negative_control="Mooney-Rivlin material of the same shear modulus, which turns with the same moment",
        wrong={"material": MOONEY_RIVLIN},
        truth=TWISTED.axial_force,
        within=1e-3,
        because="discretisation of order 4, 1.7e-4 with 6 cells along the radius: a force of second order in the twist",
        refinement=Refinement((1, 2, 3), RADIUS / 2, order=4),
        **SLOW,
    ),
    CYLINDER(
        name="torsion_moment_mooney_rivlin",
        title="Twisting a Mooney-Rivlin cylinder by half a radian: the moment",
        unit="N mm",
        given={"end": "moments", "rings": 2, "element": "Q2/Q1", "material": MOONEY_RIVLIN},
        **control("c2 is 1 % too large", material=mooney_rivlin(C1, 1.01 * C2, BULK)),
        truth=TWISTED_MOONEY_RIVLIN.moment,
        within=5e-4,
        because="discretisation of order 4, 8e-5 with 4 cells along the radius (Q2/Q1)",
    ),
    CYLINDER(
        name="torsion_axial_force_mooney_rivlin",
        title="Twisting a Mooney-Rivlin cylinder by half a radian: the force that keeps it from growing longer",
        unit="N",
        given={"end": "forces", "rings": 2, "element": "Q2/Q1", "material": MOONEY_RIVLIN},
        negative_control="neo-Hookean material of the same shear modulus, which turns with the same moment",
        wrong={"material": NEO_HOOKE},
        truth=TWISTED_MOONEY_RIVLIN.axial_force,
        within=2e-3,
        because="discretisation of order 4, 4e-4 with 4 cells along the radius (Q2/Q1)",
    ),
    *(
        SQUARE(
            name=f"torsion_square_bar_{cells}",
            title=f"Twisting a square bar a little, free to warp: the torsional stiffness, by {cells} ({element})",
            given={"element": element, "turned": (0, 1)},
            within=within,
            because=f"discretisation of order 3.7, {left} with 16 cells across; the finite twist adds 1e-6",
        )
        for cells, element, within, left in (
            ("tetrahedra", "P2/P1", 1e-4, "1.9e-5"),
            ("hexahedra", "Q2/Q1", 5e-5, "7e-6"),
        )
    ),
)
