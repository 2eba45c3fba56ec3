"""Bent and twisted bodies: a block bent into a sector of a tube, a cylinder twisted by 0.5 rad, and a slightly twisted bar."""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

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
# Moduli [MPa]; C1 and C2 give a Mooney-Rivlin law with the shear modulus MU. The true values are for incompressible material.
MU, BULK = 0.01, 1e4
C1, C2 = 0.003, 0.002
# The block [mm], and the angle [rad] between its ends when it is bent; its curved faces then have radii of 15.7 and 25.4 mm.
THICKNESS, LENGTH, WIDTH, ANGLE = 10.0, 20.0, 2.5, 1.0
# Radius and height of the cylinder [mm], and its twist [rad/mm]: 0.5 rad from end to end, a shear of 0.5 at its lateral surface.
RADIUS, TALL, TWIST = 10.0, 10.0, 0.05
# Side and length of the square bar [mm], and its twist [rad/mm]: a shear of 0.0007 at its edges.
SIDE, SHORT, SMALL_TWIST = 10.0, 2.5, 1e-4


def flexed(thickness: float, length: float, angle: float, points: Floats, frame: float) -> Floats:
    """The displacement (n, 3) [mm] of rest ``points`` (n, 3) in a block bent by ``angle`` [rad] times the frame number; the block
    extends from x = 0 to its ``thickness`` [mm], and its ``length`` [mm] is centred at y = 0.
    """
    centred = points - [thickness / 2, 0.0, 0.0]
    moves: Floats = rivlin.Flexure(1.0, thickness, length, angle * frame).positions(centred) - centred
    return moves


def bent(lab: Lab, n: int, reading: str, element: str, mu: float = MU, faces: tuple[str, ...] = ("z0", "z1")) -> float:
    """A ``reading`` of the bent block, of which the half y >= 0 is solved in 2n by 2n by 1 cells. Its lateral ``faces`` stay plane;
    ``mu`` [MPa].
    """
    mesh = shapes.box((2 * n, 2 * n, 1), (THICKNESS, LENGTH / 2, WIDTH), ELEMENTS[element][0], 2)
    end = Prescribed("y1", "y1", (0, 1, 2), partial(flexed, THICKNESS, LENGTH, ANGLE))
    body = Body(mesh, neo_hooke(mu, BULK), (*sliding("y0"), end, *sliding(*faces)), (0.0, 1.0))
    return READINGS[reading].read(mesh.points, lab.solve(body, element, first_step=0.5, residual=1e-9).last)


def circle(points: Floats) -> float:
    """The radius [mm] of the circle ``x^2 + y^2 = 2 a x + 2 b y + c`` fitted to ``points`` (n, 2) [mm] by least squares.

    >>> round(circle(np.array([[3.0, 1.0], [1.0, 3.0], [-1.0, 1.0]])), 12)
    2.0
    """
    squares = np.sum(points**2, axis=1)
    (a, b, c), *_ = np.linalg.lstsq(np.column_stack([2 * points, np.ones(len(points))]), squares)
    return float(np.sqrt(c + a**2 + b**2))


class Reading(NamedTuple):
    """A quantity: its name in ``words``, its ``unit``, the function ``read`` that returns its value from the rest positions (n, 3)
    [mm] of the nodes and a state, and its ``truth``.
    """

    words: str
    unit: str
    read: Callable[[Floats, Frame], float]
    truth: Callable[[], float]


TRUE = rivlin.Flexure(MU, THICKNESS, LENGTH, ANGLE)
# The end moment per unit width; the radius of a circle fitted to the nodes of the inner face; the distance between curved faces.
READINGS = {
    "moment": Reading("the moment", "N", lambda _, state: float(state.moments["y1"][2] / WIDTH), TRUE.moment),
    "inner radius": Reading(
        "the radius of its inner face",
        "mm",
        lambda rest, state: circle(state.points[rest[:, 0] == 0, :2]),
        lambda: TRUE.radii()[0],
    ),
    "thickness": Reading(
        "its thickness halfway between its ends",
        "mm",
        lambda rest, state: float(np.ptp(state.points[rest[:, 1] == 0, 0])),
        lambda: np.diff(TRUE.radii())[0],
    ),
}


def twisted(lab: Lab, rings: int, end: str, element: str, material: tuple[Effect, ...], degree: int = 2) -> float:
    """The moment [N mm] on the top of the cylinder about its axis, if ``end`` is "moments", or the force [N] along the axis, if
    ``end`` is "forces".

    Both ends are rotated by TWIST times their height and held there. With ``degree`` 1 the cells are straight.
    """
    mesh = shapes.cylinder(RADIUS, TALL, rings, rings, ELEMENTS[element][0], degree)
    turn = Turn((0.0, 0.0, 1.0), TWIST, per_length=True)
    fixed = tuple(Prescribed(face, face, (0, 1, 2), turn) for face in ("bottom", "top"))
    state = lab.solve(Body(mesh, material, fixed, (0.0, 1.0)), element, first_step=0.5, residual=1e-9).last
    return float(getattr(state, end)["top"][2])


def square_bar(lab: Lab, cells: int, element: str, turned: tuple[int, ...]) -> float:
    """The torque divided by the twist [N mm2]. Only a quarter of the bar is solved, as small displacements are antisymmetric about
    planes through the axis. The displacements of the ends are prescribed along the axes ``turned``.
    """
    half = SIDE / 2
    mesh = shapes.box((cells, cells, 1), (half, half, SHORT), ELEMENTS[element][0])
    turn = Turn((0.0, 0.0, 1.0), SMALL_TWIST, per_length=True)
    ends = tuple(Prescribed(face, face, turned, turn) for face in ("z0", "z1"))
    fixed = (*clamped("x0", components=(1, 2)), *clamped("y0", components=(0, 2)), *ends)
    body = Body(mesh, neo_hooke(MU, BULK), fixed, (0.0, 1.0))
    return float(4 * lab.solve(body, element, first_step=1.0, residual=1e-12).last.moments["z1"][2] / SMALL_TWIST)


CELLS = {"P2/P1": ("tetrahedra", (1, 2, 4)), "Q2/Q1": ("hexahedra", (1, 2, 3))}  # for each element
FREE = control("one lateral face is free, so that the block may change its width", faces=("z0",))
STIFF = control("the shear modulus is 1 % too large", mu=1.01 * MU)
MIXED = Refinement((1, 2, 3), THICKNESS / 2, order=None, note="no order: the error changes its sign between meshes")


def flexure(
    name: str, reading: str, element: str, wrong: dict[str, Any], error: tuple[float, str], **more: Any
) -> Entry:
    """The entry for a ``reading`` of the bent block; ``error``: the tolerance, and the error with the finest cells, in words."""
    cells, counts = CELLS[element]
    stated: dict[str, Any] = {"refinement": Refinement(counts, THICKNESS / 2, order=4)} | wrong | more
    return Entry(
        name=f"flexure_{name}",
        group="flexure",
        title=f"A block, half as thick as it is long, bent by one radian: {READINGS[reading].words}, with {cells} ({element})",
        unit=READINGS[reading].unit,
        measure=bent,
        given={"reading": reading, "element": element},
        truth=READINGS[reading].truth,
        within=error[0],
        relative=True,
        because=f"discretisation error {error[1]} cells through the thickness; the finite K/mu = 1e6 adds 1e-6",
        kind="closed form",
        source="Rivlin 1949, doi 10.1098/rspa.1949.0004; validation/rivlin.py Flexure",
        **stated,
    )


NEO_HOOKE, MOONEY_RIVLIN = neo_hooke(MU, BULK), mooney_rivlin(C1, C2, BULK)
TWISTED = {
    "neo-Hookean": (NEO_HOOKE, rivlin.Torsion(MU / 2, 0.0, RADIUS, TWIST)),
    "Mooney-Rivlin": (MOONEY_RIVLIN, rivlin.Torsion(C1, C2, RADIUS, TWIST)),
}
MOMENT = ("moments", "the moment", "N mm", "moment")
PULL = ("forces", "the axial force that keeps its length (Poynting effect)", "N", "axial_force")
STRAIGHT = control("straight cells, with flat facets on the surface", degree=1)
SAME_MOMENT = "material with the same shear modulus, which needs the same moment"
MOONEY = control(f"Mooney-Rivlin {SAME_MOMENT}", material=MOONEY_RIVLIN)
NEO = control(f"neo-Hookean {SAME_MOMENT}", material=NEO_HOOKE)
OTHER_C2 = control("c2 is 1 % too large", material=mooney_rivlin(C1, 1.01 * C2, BULK))


def torsion(
    name: str, law: str, read: tuple[str, ...], wrong: dict[str, Any], error: tuple[float, str], **given: Any
) -> Entry:
    """The entry for a quantity ``read`` of the twisted cylinder, on several meshes unless the number of ``rings`` is given."""
    end, words, unit, truth = read
    material, true = TWISTED[law]
    cells, counts = CELLS[given["element"]]
    ladder = {} if "rings" in given else {"refinement": Refinement(counts, RADIUS / 2, order=4), **SLOW}
    return Entry(
        name=f"torsion_{name}",
        group="torsion",
        title=f"A {law} cylinder twisted by half a radian: {words}, with curved {cells} ({given['element']})",
        unit=unit,
        measure=twisted,
        given={"end": end, "material": material, **given},
        truth=getattr(true, truth),
        within=error[0],
        relative=True,
        because=f"discretisation error of order 4, {error[1]} cells along the radius; the finite K/mu = 1e6 adds 1e-6",
        kind="closed form",
        source="Rivlin 1949, doi 10.1098/rsta.1949.0009; validation/rivlin.py Torsion",
        **wrong,
        **ladder,
    )


SQUARE = partial(
    Entry,
    group="torsion",
    unit="N mm2",
    measure=square_bar,
    **control("the ends are kept plane: no warping", turned=(0, 1, 2)),
    truth=lambda: find("torsion").square_bar_stiffness(MU, SIDE),
    relative=True,
    kind="closed form",
    source="Timoshenko and Goodier 1970, art. 109; validation/torsion.py",
    refinement=Refinement((2, 4, 8), SIDE / 2, order=4),
)

ENTRIES: tuple[Entry, ...] = (
    flexure("moment_tetrahedra", "moment", "P2/P1", FREE, (5e-5, "of order 4, 1e-5 with 8")),
    flexure("moment_hexahedra", "moment", "Q2/Q1", STIFF, (1e-5, "of order 4, 3e-6 with 6")),
    flexure("inner_radius", "inner radius", "Q2/Q1", FREE, (1e-4, "of 3e-5 with 6"), refinement=MIXED),
    flexure("thickness", "thickness", "Q2/Q1", FREE, (3e-5, "of order 4 or more, 7e-6 with 6")),
    torsion("moment_tetrahedra", "neo-Hookean", MOMENT, STRAIGHT, (5e-4, "8e-5 with 8"), element="P2/P1"),
    torsion("moment_hexahedra", "neo-Hookean", MOMENT, STRAIGHT, (1e-4, "1.6e-5 with 6"), element="Q2/Q1"),
    torsion("axial_force", "neo-Hookean", PULL, MOONEY, (1e-3, "1.7e-4 with 6"), element="Q2/Q1"),
    torsion("moment_mooney_rivlin", "Mooney-Rivlin", MOMENT, OTHER_C2, (5e-4, "8e-5 with 4"), element="Q2/Q1", rings=2),
    torsion("axial_force_mooney_rivlin", "Mooney-Rivlin", PULL, NEO, (2e-3, "4e-4 with 4"), element="Q2/Q1", rings=2),
    *(
        SQUARE(
            name=f"torsion_square_bar_{cells}",
            title=f"A square bar twisted a little, free to warp: its torsional stiffness, with {cells} ({element})",
            given={"element": element, "turned": (0, 1)},
            within=within,
            because=f"discretisation error of order 3.7, {left} with 16 cells across; the finite twist adds 1e-6",
        )
        for cells, element, within, left in (
            ("tetrahedra", "P2/P1", 1e-4, "1.9e-5"),
            ("hexahedra", "Q2/Q1", 5e-5, "7e-6"),
        )
    ),
)
