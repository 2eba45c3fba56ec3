"""Inflation of hollow bodies: a sphere inflated past its limit point (the maximum pressure), and a tube.

If the motion of the inner face is prescribed, the pressure is the derivative of the energy with respect to the enclosed volume,
as the energy grows by the work of the pressure. A polynomial interpolates the energy at a few stretches of the inner face.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq, minimize_scalar

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import radially
from fem_reference.runs.store import Run
from fem_reference.verification.parts import SLOW, SYMMETRY, clamped, control, find, mooney_rivlin, neo_hooke, ramp

# [MPa]; C1 and C2 give a Mooney-Rivlin law with the shear modulus MU. Pressures are proportional to the moduli.
MU, BULK = 1.0, 1e4
C1, C2 = 0.3, 0.2
NEARLY = 1e6  # [MPa], the bulk modulus if the closed form is for incompressible material
INNER, OUTER, LENGTH = 10.0, 20.0, 5.0  # radii of sphere and tube, length of the tube [mm]
STRETCH, BEYOND = 1.5, 2.2  # a / A of the inner face; the pressure of the sphere is largest at 1.83
PRESSED = 0.7  # [MPa]; the limit pressure of the sphere is 0.82
# Shear modulus of a soft sphere [MPa], thickness of a membrane on its inner face [mm], and a pressure [MPa] that the membrane
# mostly carries.
SOFT, THICKNESS, SHEATHED = 0.01, 0.5, 0.05
RESIDUAL = 1e-8  # [N, mm3], at forces of about 100 N

Material = tuple[Effect, ...]
Pressures = Callable[[float], float]  # the pressure [MPa] at a stretch a / A of the inner face
# The largest stretch, and the function that reads a value from the pressures at stretches up to it.
Reading = tuple[float, Callable[[Pressures], float]]


def stretches(largest: float, count: int) -> tuple[float, ...]:
    """Stretches from 1 to the ``largest``, denser at both ends (Chebyshev), so that the interpolating polynomial is accurate."""
    along = (1 - np.cos(np.linspace(0, np.pi, count))) / 2
    return tuple((1 + (largest - 1) * along).tolist())


def slope(solved: Run) -> Chebyshev:
    """The derivative of the energy with respect to the frame number [N mm]."""
    end = solved.last.number
    frames, energies = zip(*((state.number, state.scalars["energy"]) for state in solved.states), strict=True)
    return Chebyshev.fit(frames, energies, len(frames) - 1, domain=[frames[0], end]).deriv()


def blown(lab: Lab, n: int, reading: Reading, element: str, material: Material, degree: int = 2) -> float:
    """A ``reading`` of an octant of the sphere in 3 n^2 by 2 n cells, which are straight if ``degree`` is 1. The inner face, with
    the radius a, is displaced outwards and encloses the volume ``pi a^3 / 6``.
    """
    largest, read = reading
    grown = Prescribed("inner", "inner", (0, 1, 2), radially(1.0, knots=((1.0, 0.0), (2.0, 1.0), (3.0, 2.0))))
    frames = stretches(largest, 8 if largest < 2 else 10)
    mesh = shapes.sphere_octant(INNER, OUTER, n, 2 * n, ELEMENTS[element][0], degree)
    body = Body(mesh, material, (*SYMMETRY, grown), frames)
    curve = slope(lab.solve(body, element, first_step=0.2, residual=RESIDUAL))
    return read(lambda stretch: float(curve(stretch) / (np.pi / 2 * INNER**3 * stretch**2)))


def top(pressures: Pressures) -> float:
    """The stretch between STRETCH and BEYOND at which the ``pressures`` have their maximum."""
    found = minimize_scalar(lambda stretch: -pressures(stretch), bounds=(STRETCH, BEYOND), options={"xatol": 1e-7})
    return float(found.x)


def pressed(lab: Lab, n: int, mu: float) -> float:
    """The stretch of the sphere's inner face, averaged over its nodes. A fluid inside the sphere has the pressure PRESSED."""
    mesh = shapes.sphere_octant(INNER, OUTER, n, 2 * n, "tetrahedron", 2)
    fluid = make("pressure", on="inner", pressure=f"{PRESSED} MPa", ramp=ramp())
    body = Body(mesh, (*neo_hooke(mu, BULK), fluid), SYMMETRY, (0.0, 1.0))
    state = lab.solve(body, "P2/P1", first_step=0.25, residual=RESIDUAL).last
    inside = np.linalg.norm(mesh.points, axis=1) < INNER * (1 + 1e-9)
    return float(np.linalg.norm(state.points[inside], axis=1).mean() / INNER)


def tube(lab: Lab, n: int, element: str, ends: tuple[str, ...] = ("bottom", "top"), degree: int = 2) -> Run:
    """A quarter of the tube, whose inner face is displaced outwards to STRETCH, and whose ``ends`` stay in their planes."""
    mesh = shapes.tube_quarter(INNER, OUTER, LENGTH, (2 * n, 2 * n, 1), ELEMENTS[element][0], degree)
    grown = Prescribed("inner", "inner", (0, 1), radially(1.0, (1.0, 1.0, 0.0), ((1.0, 0.0), (2.0, 1.0))))
    fixed = (*SYMMETRY[:2], *clamped(*ends, components=(2,)), grown)
    body = Body(mesh, neo_hooke(MU, BULK), fixed, stretches(STRETCH, 8))
    return lab.solve(body, element, first_step=0.2, residual=RESIDUAL)


def tube_pressure(lab: Lab, n: int, **given: Any) -> float:
    """The pressure [MPa] in the tube at STRETCH. The quarter of the tube encloses the volume ``pi a^2 L / 4``."""
    return float(slope(tube(lab, n, **given))(STRETCH) / (np.pi / 2 * INNER**2 * STRETCH * LENGTH))


def tube_force(lab: Lab, n: int, **given: Any) -> float:
    """The force [N] at STRETCH on one end of the tube, summed over all four quarters."""
    return float(4 * tube(lab, n, **given).last.forces["top"][2])


def sheathed(lab: Lab, n: int, thickness: float, element: str) -> float:
    """The mean stretch of the inner face of a soft sphere under pressure. A membrane of ``thickness`` [mm] lines this face."""
    mesh = shapes.sphere_octant(INNER, OUTER, n, n, ELEMENTS[element][0], 2)
    membrane = make("membrane", on="inner", thickness=thickness, mu=MU)
    fluid = make("pressure", on="inner", pressure=SHEATHED, ramp=ramp())
    body = Body(mesh, (*neo_hooke(SOFT, SOFT * BULK), membrane, fluid), SYMMETRY, (0.0, 1.0))
    state = lab.solve(body, element, first_step=0.25, residual=RESIDUAL).last
    inside = np.linalg.norm(mesh.points, axis=1) < INNER * (1 + 1e-9)
    return float(np.linalg.norm(state.points[inside], axis=1).mean() / INNER)


def true_sheathed() -> float:
    """The stretch at which the pressures carried by membrane and sphere add up to the pressure of the fluid."""

    def left(stretch: float) -> float:
        own = SOFT * true_pressure(TRUE_LAW, stretch)  # pressures are proportional to the moduli
        return float(balloon(MU, THICKNESS, INNER, stretch)) + own - SHEATHED

    return float(brentq(left, 1.01, 1.38, xtol=1e-12))


laws, radial, balloon = find("laws"), find("radial"), find("balloon").pressure
TRUE_LAW, TRUE_SPHERE = laws.neo_hooke(MU), find("rivlin").Sphere(MU, INNER, OUTER)


def true_pressure(law: object, stretch: float = STRETCH) -> float:
    """The pressure [MPa] in the sphere for a law of ``validation/laws.py``."""
    return float(radial.sphere_pressure(law, BULK, (INNER, OUTER), stretch))


def true_tube(which: int) -> float:
    """The pressure [MPa] (0) or the force along the axis [N] (1) of the tube at STRETCH."""
    return float(radial.tube(TRUE_LAW, BULK, (INNER, OUTER), STRETCH)[which])


NEO_HOOKE, MOONEY_RIVLIN = neo_hooke(MU, BULK), mooney_rivlin(C1, C2, BULK)
NEARLY_INCOMPRESSIBLE = neo_hooke(MU, NEARLY)
STRAIGHT = control("straight cells, with flat facets on the surfaces", degree=1)
OTHER_LAW = "Mooney-Rivlin material with the same shear modulus, whose pressure keeps rising"
RISING = control(OTHER_LAW, material=MOONEY_RIVLIN)
INFLATED = partial(Entry, group="inflation", relative=True, kind="closed form")
FINITE = partial(INFLATED, source="Ogden 1984, ch. 5.3, with a finite bulk modulus; validation/radial.py")
# The pressure at STRETCH [MPa], the maximum pressure [MPa] and its stretch, and the drop in pressure from there to BEYOND [MPa].
AT_STRETCH: Reading = (1.6, lambda pressures: pressures(STRETCH))
LARGEST: Reading = (BEYOND, lambda pressures: pressures(top(pressures)))
WHERE_LARGEST: Reading = (BEYOND, top)
FALL: Reading = (BEYOND, lambda pressures: pressures(top(pressures)) - pressures(BEYOND))
CELLS = {"n": 2, "element": "Q2/Q1", "material": NEARLY_INCOMPRESSIBLE}
LIMIT = partial(
    INFLATED, measure=blown, source="Green and Zerna 1954, ch. 3; Ogden 1984, ch. 5.3.2; validation/rivlin.py Sphere"
)

ENTRIES: tuple[Entry, ...] = (
    *(
        FINITE(
            name=f"inflation_sphere_pressure_{cells}",
            title=f"A thick sphere inflated to 1.5 times its inner radius: its pressure, with curved {cells} ({element})",
            unit="MPa",
            measure=blown,
            given={"reading": AT_STRETCH, "element": element, "material": NEO_HOOKE},
            **STRAIGHT,
            truth=lambda: true_pressure(TRUE_LAW),
            within=within,
            because=f"discretisation error of order 4, {left} cells through the wall; interpolating the energy adds 1e-6",
            refinement=Refinement(counts, INNER / 2, order=4),
            slow=True,
            slow_negative_control=element == "P2/P1",
        )
        for cells, element, within, left, counts in (
            ("tetrahedra", "P2/P1", 2e-4, "5e-5 with 6", (1, 2, 3)),
            ("hexahedra", "Q2/Q1", 4e-4, "1.1e-4 with 4", (1, 2)),
        )
    ),
    FINITE(
        name="inflation_sphere_pressure_mooney_rivlin",
        title="A thick Mooney-Rivlin sphere inflated to 1.5 times its inner radius: its pressure",
        unit="MPa",
        measure=blown,
        given={"reading": AT_STRETCH, "n": 2, "element": "Q2/Q1", "material": MOONEY_RIVLIN},
        **control("neo-Hookean material with the same shear modulus", material=NEO_HOOKE),
        truth=lambda: true_pressure(laws.MooneyRivlin(C1, C2)),
        within=4e-4,
        because="discretisation error of order 4, 1e-4 with 4 cells through the wall (Q2/Q1)",
        **SLOW,
    ),
    FINITE(
        name="inflation_sphere_stretch",
        title="A thick sphere under an internal follower pressure: the stretch of its inner radius",
        unit="1",
        measure=pressed,
        given={"mu": MU},
        **control("the shear modulus is 1 % too large", mu=1.01 * MU),
        truth=lambda: brentq(lambda stretch: true_pressure(TRUE_LAW, stretch) - PRESSED, 1.1, 1.7, xtol=1e-10),
        within=4e-4,
        because="discretisation error of order 4, 8e-5 with 4 cells through the wall (P2/P1)",
        refinement=Refinement((1, 2), INNER / 2, order=4),
    ),
    FINITE(
        name="inflation_membrane",
        title="A soft sphere lined with a membrane that carries nine tenths of the internal pressure: stretch of its inner radius",
        unit="1",
        measure=sheathed,
        given={"element": "P2/P1", "thickness": THICKNESS},
        **control("the membrane is 1 % too thick", thickness=1.01 * THICKNESS),
        truth=true_sheathed,
        within=2e-4,
        because="discretisation error of order 4, 8e-5 with 2 cells through the wall (P2/P1), with the membrane on the inner faces",
        source="Membrane: p = 2 sigma h / r, incompressible neo-Hookean (Holzapfel 2000, ch. 6.5; validation/balloon.py)",
        refinement=Refinement((1, 2), INNER / 2, order=4),
    ),
    LIMIT(
        name="inflation_limit_pressure",
        title="A thick sphere inflated past its limit point: its largest pressure",
        unit="MPa",
        given={**CELLS, "reading": LARGEST},
        **STRAIGHT,
        truth=lambda: TRUE_SPHERE.limit_point()[1],
        within=4e-4,
        because="discretisation error of order 4, 1e-4 with 4 cells through the wall (Q2/Q1); interpolation adds 1e-6",
        slow_negative_control=True,
    ),
    LIMIT(
        name="inflation_limit_stretch",
        title="A thick sphere inflated past its limit point: the stretch of its inner radius at the largest pressure",
        unit="1",
        given={**CELLS, "reading": WHERE_LARGEST},
        **RISING,
        truth=lambda: TRUE_SPHERE.limit_point()[0],
        within=1e-4,
        because="discretisation error of order 4, 2e-5 with 4 cells through the wall (Q2/Q1)",
        **SLOW,
    ),
    LIMIT(
        name="inflation_fall_beyond_limit",
        title="A thick sphere inflated to 2.2 times its inner radius: the drop in pressure from its maximum",
        unit="MPa",
        given={**CELLS, "reading": FALL},
        **RISING,
        truth=lambda: TRUE_SPHERE.limit_point()[1] - TRUE_SPHERE.pressure(BEYOND),
        within=2e-3,
        because="the drop is 4 % of the pressures, whose relative errors of 1e-4 largely cancel: the relative error of the drop is "
        "2e-4 (Q2/Q1, 4 cells through the wall)",
        slow=True,
    ),
    FINITE(
        name="inflation_tube_pressure",
        title="A thick tube of constant length inflated to 1.5 times its inner radius: its pressure",
        unit="MPa",
        measure=tube_pressure,
        given={"element": "Q2/Q1"},
        **control("one end of the tube is free to move along the axis", ends=("bottom",)),
        truth=lambda: true_tube(0),
        within=5e-5,
        because="discretisation error of order 4, 1.1e-5 with 6 cells through the wall (Q2/Q1)",
        refinement=Refinement((1, 2, 3), INNER / 2, order=4),
        slow=True,
    ),
    FINITE(
        name="inflation_tube_axial_force",
        title="A thick tube of constant length inflated to 1.5 times its inner radius: its axial force",
        unit="N",
        measure=tube_force,
        given={"element": "P2/P1"},
        **STRAIGHT,
        truth=lambda: true_tube(1),
        within=5e-5,
        because="discretisation error of order 4, 1e-5 with 6 cells through the wall (P2/P1)",
        refinement=Refinement((1, 2, 3), INNER / 2, order=4),
    ),
)
