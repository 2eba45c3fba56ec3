"""The cardiac mechanics benchmark (Land et al. 2015): a bending beam, an inflated ventricle and a contracting ventricle."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import Effect, make
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells
from fem_reference.problems.paths import Along
from fem_reference.verification.parts import SLOW, clamped, control, find, nearest, ramp, resistance, sliding

land = find("land")
BULK = 100.0  # [MPa], about 1e4 times the stresses: J is 1 to within 1e-4 on average
RESIDUAL = 1e-10  # [N, mm3]; the beam carries 2e-5 N
X = (1.0, 0.0, 0.0)
APEX = 0.6  # length of the cells at the apex of the contracting ventricle, relative to the uniform mesh
AROUND = 7.85  # an eighth of the outer circumference of the ventricle at its widest [mm]; cell sizes are this length divided by n
ENDO, EPI = (0.0, 0.0, -17.0), (0.0, 0.0, -20.0)
Point = tuple[float, float, float]


def helix(cells: Ints, points: Floats) -> Floats:  # noqa: ARG001
    """The fibre directions of problem 3, from +90 degrees inside to -90 degrees outside: (n, 3) at rest ``points`` (n, 3) [mm]."""
    return np.asarray(land.fibre(points))


@dataclass(frozen=True)
class Heart:
    """A problem solved with an ``element`` on cells of ``degree`` (1 straight, 2 curved). The stiffness and the active tension are
    multiplied by ``stiff`` and ``active`` (1: the true values).
    """

    element: str
    degree: int = 2
    stiff: float = 1.0
    active: float = 1.0

    def effects(self, number: int, on: str) -> tuple[Effect, ...]:
        """The effects of problem ``number`` of ``validation.land``, scaled by the factors, with its pressure ``on`` a surface."""
        problem = getattr(land, f"PROBLEM_{number}")
        law, tension = problem.law, problem.tension * self.active
        acting = (
            make("guccione", c=f"{law.c * self.stiff} MPa", bf=law.bf, bt=law.bt, bfs=law.bfs),
            resistance(self.element, BULK),
            make("pressure", on=on, pressure=f"{problem.pressure} MPa", ramp=ramp()),
        )
        return (*acting, make("active_tension", tension=f"{tension} MPa", ramp=ramp())) if tension else acting

    def beam(self, n: int) -> Body:
        """Half of the beam of problem 1, the half y <= 0.5, in 10n by n by 2n cells."""
        mesh = shapes.box((10 * n, n, 2 * n), (10.0, 0.5, 1.0), ELEMENTS[self.element][0], self.degree)
        fixed = (*clamped("x0"), *sliding("y1"))
        return Body(mesh, self.effects(1, "z0"), fixed, (0.0, 1.0), Along(X))

    def passive(self, n: int) -> Body:
        """A quarter of the isotropic ventricle of problem 2; n cells span an eighth of the circumference."""
        mesh = shapes.ventricle_quarter((n, 7 * n // 2, n), ELEMENTS[self.element][0], self.degree)
        fixed = (*clamped("base"), *sliding("x0", "y0"))
        return Body(mesh, self.effects(2, "endo"), fixed, (0.0, 1.0), Along(X))

    def contracting(self, n: int) -> Body:
        """The ventricle of problem 3, whose pressure and tension grow together; n cells span an eighth of its circumference."""
        mesh = _crowded(shapes.ventricle((n, 7 * n // 2, n), ELEMENTS[self.element][0], self.degree))
        return Body(mesh, self.effects(3, "endo"), clamped("base"), (0.0, 1.0), helix)


def height(lab: Lab, n: int, body: str, point: Point, **heart: Any) -> float:
    """The deformed z [mm] of the node that is at ``point`` at rest, in a ``body`` of a :class:`Heart`."""
    made = Heart(**heart)
    solved: Body = getattr(made, body)(n)
    state = lab.solve(solved, made.element, first_step=0.2, residual=RESIDUAL).last
    return float(state.points[nearest(solved.mesh.points, point), 2])


def _crowded(mesh: Cells) -> Cells:
    """The ventricle ``mesh`` with cells at the apex that are a = ``APEX`` times as long: the angle w from the apex, scaled to 1 at
    the base, becomes ``w (a + (1 - a) w^2)``. Fibres meet at the apex, and the stress has a logarithmic singularity along the axis.
    """
    points = mesh.points
    depth = land.depth(points)
    short, long = land.axes(depth)
    full = np.pi + land.base_angle(depth)
    share = np.arctan2(np.hypot(points[:, 0], points[:, 1]) / short, -points[:, 2] / long) / full
    angle = full * share * (APEX + (1 - APEX) * share**2)
    around = np.arctan2(-points[:, 1], -points[:, 0])
    return replace(mesh, points=land.wall(angle - np.pi, around, depth))


BOUND = "a bound set by this project: others read the values off figures, and no source states their error"
HEART = partial(
    Entry,
    group="heart benchmark",
    unit="mm",
    measure=height,
    relative=True,
    kind="published",
    source="Land et al. 2015, doi 10.1098/rspa.2015.0641: second-hand readings of its figures, see validation/land.py",
    refinement=Refinement((2, 3), AROUND, order=None),  # the published value has few digits, so no order is stated
    **SLOW,
)
APICES = {"inside": (0, ENDO), "outside": (1, EPI)}
FINE = "the discretisation error is 0.2 %"

ENTRIES: tuple[Entry, ...] = (
    HEART(
        name="beam_follower",
        title="A beam of heart muscle under a follower pressure: height of its end, with quadratic tetrahedra",
        given={"body": "beam", "point": land.BEAM_POINT, "element": "P2/P1", "degree": 1},
        **control("5 % stiffer", stiff=1.05),
        truth=land.TIP_OF_BEAM,
        within=0.003,
        because=f"0.3 %: {BOUND}; {FINE}, as its clamped edges are singular",
        refinement=Refinement((2, 3), 1.0, order=None),
    ),
    *(
        HEART(
            name=f"ventricle_passive_{where}_{by}",
            title=f"A ventricle inflated to 10 kPa: height of its apex {where}, with quadratic {by}",
            given={"body": "passive", "point": point, "element": element},
            **control("20 % stiffer", stiff=1.2),
            truth=land.PASSIVE_APICES[place],
            within=0.005,
            because=f"0.5 %: {BOUND}; the discretisation error is 0.1 %",
        )
        for element, by in (("P2/P1", "tetrahedra"), ("Q2/Q1", "hexahedra"))
        for where, (place, point) in APICES.items()
    ),
    *(
        HEART(
            name=f"ventricle_active_{where}",
            title=f"A ventricle that contracts at 60 kPa against 15 kPa: height of its apex {where}, with quadratic hexahedra",
            given={"body": "contracting", "point": point, "element": "Q2/Q1"},
            **control("half the active tension", active=0.5),
            truth=land.ACTIVE_APICES[place],
            within=0.005,
            because=f"0.5 %: {BOUND}; {FINE if place else 'the discretisation error is 1 % (coarse) and about 0.2 % (fine)'}",
        )
        for where, (place, point) in APICES.items()
    ),
)
