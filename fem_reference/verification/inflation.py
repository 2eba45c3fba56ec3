"""Hollow bodies that are blown up: a sphere, past the point where its pressure is largest, and a tube.

Where the inner face is moved, the pressure is the slope of the body's energy over the enclosed volume: the work of the pressure is
what the energy grows by. The energy is a polynomial through those of a few stretches of the inner face.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.polynomial import Chebyshev
from scipy.optimize import brentq, minimize_scalar

from fem_reference.assessment.catalogue import Entry, Lab
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Radial, Rest
from fem_reference.runs.solved import Solved
from fem_reference.verification import truths
from fem_reference.verification.parts import SYMMETRY, ladder, mooney_rivlin, neo_hooke, once, ramp
from fem_reference.verification.torsion import Material

# [MPa]; C1 and C2 make a Mooney-Rivlin law of the shear modulus MU. Pressures are proportional to the moduli.
MU, BULK = 1.0, 1e4
C1, C2 = 0.3, 0.2
NEARLY = 1e6  # [MPa], the bulk modulus where the truth is of incompressible material
INNER, OUTER, LENGTH = 10.0, 20.0, 5.0  # radii of sphere and tube, length of the tube [mm]
STRETCH, BEYOND = 1.5, 2.2  # a / A of the inner face; the pressure of the sphere is largest at 1.83
PRESSED = 0.7  # [MPa], of 0.82 that the sphere can bear
RESIDUAL = 1e-8  # [N, mm3], where forces are some 100 N

Pressures = Callable[[float], float]  # [MPa] by the stretch a / A of the inner face


def stretches(largest: float, count: int) -> tuple[float, ...]:
    """From 1 to the largest, closer at both ends: where a polynomial through values is good in between."""
    along = (1 - np.cos(np.linspace(0, np.pi, count))) / 2
    return tuple((1 + (largest - 1) * along).tolist())


def sphere(element: str, n: int, degree: int) -> Cells:
    """An octant of 3 n^2 by 2 n cells; with ``degree`` 1 they are straight."""
    return shapes.sphere_octant(INNER, OUTER, n, 2 * n, ELEMENTS[element][0], degree)


def slope(solved: Solved) -> Chebyshev:
    """Of the energy over the frames [N mm]."""
    end = solved.last.frame
    frames, energies = zip(*((state.frame, state.scalars["energy"]) for state in solved.states), strict=True)
    return Chebyshev.fit(frames, energies, len(frames) - 1, domain=[frames[0], end]).deriv()


def _blown(lab: Lab, n: int, element: str, material: Material, degree: int = 2, largest: float = 1.6) -> Pressures:
    """The pressures of the sphere whose inner face is moved out up to the largest stretch: it encloses ``pi a^3 / 6``."""
    grown = Prescribed("inner", "inner", (0, 1, 2), Radial(1.0, knots=((1.0, 0.0), (2.0, 1.0), (3.0, 2.0))))
    frames = stretches(largest, 8 if largest < 2 else 10)
    body = Body(sphere(element, n, degree), material(), (*SYMMETRY, grown), frames)
    curve = slope(lab.solve(body, element, first_step=0.2, residual=RESIDUAL))
    return lambda stretch: float(curve(stretch) / (np.pi / 2 * INNER**3 * stretch**2))


def _pressure(lab: Lab, n: int, element: str, material: Material, degree: int = 2) -> float:
    """In the sphere at STRETCH [MPa]."""
    return _blown(lab, n, element, material, degree)(STRETCH)


def _limit_stretch(lab: Lab, n: int, material: Material) -> float:
    """Where the pressure in the sphere is largest."""
    return _top(_blown(lab, n, "Q2/Q1", material, largest=BEYOND))


def _limit_pressure(lab: Lab, n: int, material: Material, degree: int = 2) -> float:
    """The largest pressure in the sphere [MPa]."""
    pressures = _blown(lab, n, "Q2/Q1", material, degree, BEYOND)
    return pressures(_top(pressures))


def _fall(lab: Lab, n: int, material: Material) -> float:
    """From the largest pressure in the sphere to that at BEYOND [MPa]."""
    pressures = _blown(lab, n, "Q2/Q1", material, largest=BEYOND)
    return pressures(_top(pressures)) - pressures(BEYOND)


def _top(pressures: Pressures) -> float:
    found = minimize_scalar(lambda stretch: -pressures(stretch), bounds=(STRETCH, BEYOND), options={"xatol": 1e-7})
    return float(found.x)


def _pressed(lab: Lab, n: int, mu: float) -> float:
    """The mean stretch of the sphere's inner face, over its nodes, where a fluid of the pressure PRESSED is in it."""
    mesh = sphere("P2/P1", n, 2)
    fluid = make("pressure", on="inner", pressure=f"{PRESSED} MPa", ramp=ramp())
    body = Body(mesh, (*neo_hooke(mu, BULK), fluid), SYMMETRY, (0.0, 1.0))
    state = lab.solve(body, "P2/P1", first_step=0.25, residual=RESIDUAL).last
    inside = np.linalg.norm(mesh.points, axis=1) < INNER * (1 + 1e-9)
    return float(np.linalg.norm(state.points[inside], axis=1).mean() / INNER)


def _tube(lab: Lab, n: int, element: str, ends: tuple[str, ...] = ("bottom", "top"), degree: int = 2) -> Solved:
    """A quarter of the tube, whose inner face is moved out to STRETCH, and whose ``ends`` stay in their planes."""
    mesh = shapes.tube_quarter(INNER, OUTER, LENGTH, (2 * n, 2 * n, 1), ELEMENTS[element][0], degree)
    fixed = [Prescribed(end, end, (2,), Rest()) for end in ends]
    grown = Prescribed("inner", "inner", (0, 1), Radial(1.0, (1.0, 1.0, 0.0), ((1.0, 0.0), (2.0, 1.0))))
    body = Body(mesh, neo_hooke(MU, BULK), (*SYMMETRY[:2], *fixed, grown), stretches(STRETCH, 8))
    return lab.solve(body, element, first_step=0.2, residual=RESIDUAL)


def _tube_pressure(lab: Lab, n: int, element: str, ends: tuple[str, ...] = ("bottom", "top")) -> float:
    """At STRETCH [MPa]: the quarter encloses ``pi a^2 L / 4``."""
    curve = slope(_tube(lab, n, element, ends))
    return float(curve(STRETCH) / (np.pi / 2 * INNER**2 * STRETCH * LENGTH))


def _tube_force(lab: Lab, n: int, element: str, degree: int = 2) -> float:
    """On an end of the whole tube at STRETCH [N]."""
    return float(4 * _tube(lab, n, element, degree=degree).last.forces["top"][2])


def _true_pressure(law: Callable[[Any], Any]) -> float:
    """In the sphere at STRETCH [MPa], of a law of ``validation/laws.py``."""
    material = law(truths.find("laws"))
    return float(truths.find("radial").sphere_pressure(material, BULK, (INNER, OUTER), STRETCH))


def _true_pressed() -> float:
    radial, law = truths.find("radial"), truths.find("laws").neo_hooke(MU)

    def excess(stretch: float) -> float:
        return float(radial.sphere_pressure(law, BULK, (INNER, OUTER), stretch) - PRESSED)

    return float(brentq(excess, 1.1, 1.7, xtol=1e-10))


def _true_sphere() -> Any:
    return truths.find("rivlin").Sphere(MU, INNER, OUTER)


def _true_limit_stretch() -> float:
    return float(_true_sphere().limit_point()[0])


def _true_limit_pressure() -> float:
    return float(_true_sphere().limit_point()[1])


def _true_fall() -> float:
    return float(_true_limit_pressure() - _true_sphere().pressure(BEYOND))


def _true_tube(which: int) -> float:
    """At STRETCH, the pressure [MPa] (0) or the force along the axis [N] (1)."""
    law = truths.find("laws").neo_hooke(MU)
    return float(truths.find("radial").tube(law, BULK, (INNER, OUTER), STRETCH)[which])


_NEO_HOOKE = partial(neo_hooke, MU, BULK)
_MOONEY_RIVLIN = partial(mooney_rivlin, C1, C2, BULK)
_NEARLY_INCOMPRESSIBLE = partial(neo_hooke, MU, NEARLY)
_TRUE_PRESSURE = partial(_true_pressure, lambda laws: laws.neo_hooke(MU))
_TRUE_TUBE_PRESSURE, _TRUE_TUBE_FORCE = partial(_true_tube, 0), partial(_true_tube, 1)
_UP = partial(ladder, size=INNER / 2)
_FINITE = partial(
    Entry,
    group="inflation",
    relative=True,
    kind="closed form",
    source="Ogden 1984, ch. 5.3, with the finite bulk modulus; validation/radial.py",
)
_LIMIT = partial(
    Entry,
    group="inflation",
    relative=True,
    kind="closed form",
    source="Green and Zerna 1954, ch. 3; Ogden 1984, ch. 5.3.2; validation/rivlin.py Sphere",
)

ENTRIES: tuple[Entry, ...] = (
    _FINITE(
        name="inflation_sphere_pressure_tetrahedra",
        title="A thick sphere blown up to 1.5 times its inner radius: its pressure, by curved tetrahedra (P2/P1)",
        unit="MPa",
        truth=_TRUE_PRESSURE,
        within=2e-4,
        because="discretisation of order 4, 5e-5 with 6 cells through the wall; the polynomial of the energy adds 1e-6",
        measure=partial(
            _UP, value=partial(_pressure, element="P2/P1", material=_NEO_HOOKE), counts=(1, 2, 3), truth=_TRUE_PRESSURE
        ),
        negative_control="straight cells, whose surfaces have flat facets",
        with_negative_control=partial(
            once, value=partial(_pressure, element="P2/P1", material=_NEO_HOOKE, degree=1), count=3
        ),
        slow=True,
        slow_negative_control=True,
    ),
    _FINITE(
        name="inflation_sphere_pressure_hexahedra",
        title="A thick sphere blown up to 1.5 times its inner radius: its pressure, by curved hexahedra (Q2/Q1)",
        unit="MPa",
        truth=_TRUE_PRESSURE,
        within=4e-4,
        because="discretisation of order 4, 1.1e-4 with 4 cells through the wall; the polynomial of the energy adds 1e-6",
        measure=partial(
            _UP, value=partial(_pressure, element="Q2/Q1", material=_NEO_HOOKE), counts=(1, 2), truth=_TRUE_PRESSURE
        ),
        negative_control="straight cells, whose surfaces have flat facets",
        with_negative_control=partial(
            once, value=partial(_pressure, element="Q2/Q1", material=_NEO_HOOKE, degree=1), count=2
        ),
        slow=True,
    ),
    _FINITE(
        name="inflation_sphere_pressure_mooney_rivlin",
        title="A thick Mooney-Rivlin sphere blown up to 1.5 times its inner radius: its pressure",
        unit="MPa",
        truth=partial(_true_pressure, lambda laws: laws.MooneyRivlin(C1, C2)),
        within=4e-4,
        because="discretisation of order 4, 1e-4 with 4 cells through the wall (Q2/Q1)",
        measure=partial(once, value=partial(_pressure, element="Q2/Q1", material=_MOONEY_RIVLIN), count=2),
        negative_control="neo-Hookean material of the same shear modulus",
        with_negative_control=partial(once, value=partial(_pressure, element="Q2/Q1", material=_NEO_HOOKE), count=2),
        slow=True,
        slow_negative_control=True,
    ),
    _FINITE(
        name="inflation_sphere_stretch",
        title="A thick sphere under the pressure of a fluid that follows its face: the stretch of its inner radius",
        unit="1",
        truth=_true_pressed,
        within=4e-4,
        because="discretisation of order 4, 8e-5 with 4 cells through the wall (P2/P1)",
        measure=partial(_UP, value=partial(_pressed, mu=MU), counts=(1, 2), truth=_true_pressed),
        negative_control="the shear modulus is 1 % too large",
        with_negative_control=partial(once, value=partial(_pressed, mu=1.01 * MU), count=2),
    ),
    _LIMIT(
        name="inflation_limit_pressure",
        title="A thick sphere blown up without end: the largest pressure that it bears",
        unit="MPa",
        truth=_true_limit_pressure,
        within=4e-4,
        because="discretisation of order 4, 1e-4 with 4 cells through the wall (Q2/Q1); the polynomial adds 1e-6",
        measure=partial(once, value=partial(_limit_pressure, material=_NEARLY_INCOMPRESSIBLE), count=2),
        negative_control="straight cells, whose surfaces have flat facets",
        with_negative_control=partial(
            once, value=partial(_limit_pressure, material=_NEARLY_INCOMPRESSIBLE, degree=1), count=2
        ),
        slow_negative_control=True,
    ),
    _LIMIT(
        name="inflation_limit_stretch",
        title="A thick sphere blown up without end: the stretch of its inner radius where it bears the most pressure",
        unit="1",
        truth=_true_limit_stretch,
        within=1e-4,
        because="discretisation of order 4, 2e-5 with 4 cells through the wall (Q2/Q1)",
        measure=partial(once, value=partial(_limit_stretch, material=_NEARLY_INCOMPRESSIBLE), count=2),
        negative_control="Mooney-Rivlin material of the same shear modulus, whose pressure goes on rising",
        with_negative_control=partial(once, value=partial(_limit_stretch, material=_MOONEY_RIVLIN), count=2),
        slow=True,
        slow_negative_control=True,
    ),
    _LIMIT(
        name="inflation_fall_beyond_limit",
        title="A thick sphere blown up to 2.2 times its inner radius: how far its pressure has fallen from the largest",
        unit="MPa",
        truth=_true_fall,
        within=2e-3,
        because="4 % of a pressure that is found to 1e-4: of its error 2e-4 is left (Q2/Q1, 4 cells through the wall)",
        measure=partial(once, value=partial(_fall, material=_NEARLY_INCOMPRESSIBLE), count=2),
        negative_control="Mooney-Rivlin material of the same shear modulus, whose pressure goes on rising",
        with_negative_control=partial(once, value=partial(_fall, material=_MOONEY_RIVLIN), count=2),
        slow=True,
    ),
    _FINITE(
        name="inflation_tube_pressure",
        title="A thick tube of constant length blown up to 1.5 times its inner radius: its pressure",
        unit="MPa",
        truth=_TRUE_TUBE_PRESSURE,
        within=5e-5,
        because="discretisation of order 4, 1.1e-5 with 6 cells through the wall (Q2/Q1)",
        measure=partial(
            _UP, value=partial(_tube_pressure, element="Q2/Q1"), counts=(1, 2, 3), truth=_TRUE_TUBE_PRESSURE
        ),
        negative_control="one end of the tube is free to move along it",
        with_negative_control=partial(once, value=partial(_tube_pressure, element="Q2/Q1", ends=("bottom",)), count=3),
        slow=True,
    ),
    _FINITE(
        name="inflation_tube_axial_force",
        title="A thick tube of constant length blown up to 1.5 times its inner radius: the force along its axis",
        unit="N",
        truth=_TRUE_TUBE_FORCE,
        within=5e-5,
        because="discretisation of order 4, 1e-5 with 6 cells through the wall (P2/P1)",
        measure=partial(_UP, value=partial(_tube_force, element="P2/P1"), counts=(1, 2, 3), truth=_TRUE_TUBE_FORCE),
        negative_control="straight cells, whose surfaces have flat facets",
        with_negative_control=partial(once, value=partial(_tube_force, element="P2/P1", degree=1), count=3),
    ),
)
