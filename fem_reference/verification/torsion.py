"""Bars that are twisted: a cylinder by a finite angle, and a square bar by a small one, free to warp."""

from collections.abc import Callable
from functools import partial

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.effects import Effect
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Rest, Turn
from fem_reference.runs.solved import Reached
from fem_reference.verification import truths
from fem_reference.verification.parts import ladder, mooney_rivlin, neo_hooke, once

Material = Callable[[], tuple[Effect, ...]]

# [MPa]; C1 and C2 make a Mooney-Rivlin law of the shear modulus MU. The truths are of incompressible material.
MU, BULK = 0.01, 1e4
C1, C2 = 0.003, 0.002
# Radius and length of the cylinder [mm], and its twist [rad/mm]: 0.5 rad from end to end, a shear of 0.5 at its side.
RADIUS, LENGTH, TWIST = 10.0, 10.0, 0.05
# Side and length of the square bar [mm], and its twist [rad/mm]: a shear of 0.0007 at its edges.
SIDE, SHORT, SMALL_TWIST = 10.0, 2.5, 1e-4


def twisted(lab: Lab, rings: int, element: str, material: Material, degree: int = 2) -> Reached:
    """The cylinder, both ends turned by TWIST times their height and fixed there; with ``degree`` 1 its cells are straight."""
    mesh = shapes.cylinder(RADIUS, LENGTH, rings, rings, ELEMENTS[element][0], degree)
    turn = Turn((0.0, 0.0, 1.0), TWIST, per_length=True)
    fixed = tuple(Prescribed(end, end, (0, 1, 2), turn) for end in ("bottom", "top"))
    return lab.solve(Body(mesh, material(), fixed, (0.0, 1.0)), element, first_step=0.5, residual=1e-9).last


def _moment(lab: Lab, rings: int, element: str, material: Material, degree: int = 2) -> float:
    return float(twisted(lab, rings, element, material, degree).moments["top"][2])


def _axial_force(lab: Lab, rings: int, element: str, material: Material) -> float:
    return float(twisted(lab, rings, element, material).forces["top"][2])


def _square_bar(lab: Lab, cells: int, element: str, *, warps: bool = True) -> float:
    """Torque per twist [N mm2]. A quarter of the bar, as small displacements are antisymmetric about the planes of its axis."""
    half = SIDE / 2
    mesh = shapes.box((cells, cells, 1), (half, half, SHORT), ELEMENTS[element][0])
    turn = Turn((0.0, 0.0, 1.0), SMALL_TWIST, per_length=True)
    turned = (0, 1) if warps else (0, 1, 2)
    fixed = (
        Prescribed("x0", "x0", (1, 2), Rest()),
        Prescribed("y0", "y0", (0, 2), Rest()),
        Prescribed("bottom", "z0", turned, turn),
        Prescribed("top", "z1", turned, turn),
    )
    body = Body(mesh, neo_hooke(MU, BULK), fixed, (0.0, 1.0))
    top = lab.solve(body, element, first_step=1.0, residual=1e-12).last.moments["top"]
    return float(4 * top[2] / SMALL_TWIST)


def _true_moment(c1: float, c2: float) -> float:
    return float(truths.find("rivlin").Torsion(c1, c2, RADIUS, TWIST).moment())


def _true_axial_force(c1: float, c2: float) -> float:
    return float(truths.find("rivlin").Torsion(c1, c2, RADIUS, TWIST).axial_force())


def _true_square_bar() -> float:
    return float(truths.find("torsion").square_bar_stiffness(MU, SIDE))


_NEO_HOOKE = partial(neo_hooke, MU, BULK)
_MOONEY_RIVLIN = partial(mooney_rivlin, C1, C2, BULK)
_CYLINDER = partial(
    Entry,
    group="torsion",
    relative=True,
    kind="closed form",
    source="Rivlin 1949, doi 10.1098/rsta.1949.0009; validation/rivlin.py Torsion",
)
_MOMENT = partial(_CYLINDER, unit="N mm")
_FORCE = partial(_CYLINDER, unit="N")
_SQUARE = partial(
    Entry,
    group="torsion",
    unit="N mm2",
    truth=_true_square_bar,
    relative=True,
    kind="closed form",
    source="Timoshenko and Goodier 1970, art. 109; validation/torsion.py",
    negative_control="the ends are kept plane, as a round bar would keep them",
)
_UP_THE_SQUARE = partial(ladder, counts=(2, 4, 8), size=SIDE / 2, truth=_true_square_bar)

ENTRIES: tuple[Entry, ...] = (
    _MOMENT(
        name="torsion_moment_tetrahedra",
        title="Twisting a cylinder by half a radian: the moment, by curved tetrahedra (P2/P1)",
        truth=partial(_true_moment, MU / 2, 0.0),
        within=5e-4,
        because="discretisation of order 4, 8e-5 with 8 cells along the radius; the material's K/mu of 1e6 adds 1e-6",
        measure=partial(
            ladder,
            value=partial(_moment, element="P2/P1", material=_NEO_HOOKE),
            counts=(1, 2, 4),
            size=RADIUS / 2,
            truth=partial(_true_moment, MU / 2, 0.0),
        ),
        negative_control="straight cells, whose surface has flat facets",
        with_negative_control=partial(
            once, value=partial(_moment, element="P2/P1", material=_NEO_HOOKE, degree=1), count=4
        ),
        slow=True,
        slow_negative_control=True,
    ),
    _MOMENT(
        name="torsion_moment_hexahedra",
        title="Twisting a cylinder by half a radian: the moment, by curved hexahedra (Q2/Q1)",
        truth=partial(_true_moment, MU / 2, 0.0),
        within=1e-4,
        because="discretisation of order 4, 1.6e-5 with 6 cells along the radius; the material's K/mu of 1e6 adds 1e-6",
        measure=partial(
            ladder,
            value=partial(_moment, element="Q2/Q1", material=_NEO_HOOKE),
            counts=(1, 2, 3),
            size=RADIUS / 2,
            truth=partial(_true_moment, MU / 2, 0.0),
        ),
        negative_control="straight cells, whose surface has flat facets",
        with_negative_control=partial(
            once, value=partial(_moment, element="Q2/Q1", material=_NEO_HOOKE, degree=1), count=3
        ),
        slow=True,
        slow_negative_control=True,
    ),
    _FORCE(
        name="torsion_axial_force",
        title="Twisting a cylinder by half a radian: the force that keeps it from growing longer (Poynting effect)",
        truth=partial(_true_axial_force, MU / 2, 0.0),
        within=1e-3,
        because="discretisation of order 4, 1.7e-4 with 6 cells along the radius: a force of second order in the twist",
        measure=partial(
            ladder,
            value=partial(_axial_force, element="Q2/Q1", material=_NEO_HOOKE),
            counts=(1, 2, 3),
            size=RADIUS / 2,
            truth=partial(_true_axial_force, MU / 2, 0.0),
        ),
        negative_control="Mooney-Rivlin material of the same shear modulus, which turns with the same moment",
        with_negative_control=partial(
            once, value=partial(_axial_force, element="Q2/Q1", material=_MOONEY_RIVLIN), count=3
        ),
        slow=True,
        slow_negative_control=True,
    ),
    _MOMENT(
        name="torsion_moment_mooney_rivlin",
        title="Twisting a Mooney-Rivlin cylinder by half a radian: the moment",
        truth=partial(_true_moment, C1, C2),
        within=5e-4,
        because="discretisation of order 4, 8e-5 with 4 cells along the radius (Q2/Q1)",
        measure=partial(once, value=partial(_moment, element="Q2/Q1", material=_MOONEY_RIVLIN), count=2),
        negative_control="c2 is 1 % too large",
        with_negative_control=partial(
            once,
            value=partial(_moment, element="Q2/Q1", material=partial(mooney_rivlin, C1, 1.01 * C2, BULK)),
            count=2,
        ),
    ),
    _FORCE(
        name="torsion_axial_force_mooney_rivlin",
        title="Twisting a Mooney-Rivlin cylinder by half a radian: the force that keeps it from growing longer",
        truth=partial(_true_axial_force, C1, C2),
        within=2e-3,
        because="discretisation of order 4, 4e-4 with 4 cells along the radius (Q2/Q1)",
        measure=partial(once, value=partial(_axial_force, element="Q2/Q1", material=_MOONEY_RIVLIN), count=2),
        negative_control="neo-Hookean material of the same shear modulus, which turns with the same moment",
        with_negative_control=partial(once, value=partial(_axial_force, element="Q2/Q1", material=_NEO_HOOKE), count=2),
    ),
    _SQUARE(
        name="torsion_square_bar_tetrahedra",
        title="Twisting a square bar a little, free to warp: the torsional stiffness, by tetrahedra (P2/P1)",
        within=1e-4,
        because="discretisation of order 3.7, 1.9e-5 with 16 cells across; the finite twist adds 1e-6",
        measure=partial(_UP_THE_SQUARE, value=partial(_square_bar, element="P2/P1")),
        with_negative_control=partial(once, value=partial(_square_bar, element="P2/P1", warps=False), count=8),
    ),
    _SQUARE(
        name="torsion_square_bar_hexahedra",
        title="Twisting a square bar a little, free to warp: the torsional stiffness, by hexahedra (Q2/Q1)",
        within=5e-5,
        because="discretisation of order 3.7, 7e-6 with 16 cells across; the finite twist adds 1e-6",
        measure=partial(_UP_THE_SQUARE, value=partial(_square_bar, element="Q2/Q1")),
        with_negative_control=partial(once, value=partial(_square_bar, element="Q2/Q1", warps=False), count=8),
    ),
)
