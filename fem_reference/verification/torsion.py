"""Bars that are twisted: a cylinder by a finite angle, and a square bar by a small one, free to warp."""

from functools import partial

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import Effect
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Turn
from fem_reference.verification.parts import clamped, control, find, mooney_rivlin, neo_hooke

# [MPa]; C1 and C2 make a Mooney-Rivlin law of the shear modulus MU. The truths are of incompressible material.
MU, BULK = 0.01, 1e4
C1, C2 = 0.003, 0.002
# Radius and length of the cylinder [mm], and its twist [rad/mm]: 0.5 rad from end to end, a shear of 0.5 at its side.
RADIUS, LENGTH, TWIST = 10.0, 10.0, 0.05
# Side and length of the square bar [mm], and its twist [rad/mm]: a shear of 0.0007 at its edges.
SIDE, SHORT, SMALL_TWIST = 10.0, 2.5, 1e-4


def twisted(lab: Lab, rings: int, end: str, element: str, material: tuple[Effect, ...], degree: int = 2) -> float:
    """``moments`` [N mm] or ``forces`` [N] of the top about or along the axis of the cylinder, whose ends are turned by TWIST times
    their height and fixed there; with ``degree`` 1 its cells are straight.
    """
    mesh = shapes.cylinder(RADIUS, LENGTH, rings, rings, ELEMENTS[element][0], degree)
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


rivlin = find("rivlin")
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
            slow=True,
            slow_negative_control=True,
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
        slow=True,
        slow_negative_control=True,
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
