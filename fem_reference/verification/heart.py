"""The benchmark of cardiac mechanics (Land et al. 2015): a beam that bends, a ventricle that is filled, one that contracts."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.effects import Effect, make
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed
from fem_reference.problems.paths import Along, Rest
from fem_reference.verification.parts import Value, once, ramp, resistance
from fem_reference.verification.truths import find

GROUP = "heart benchmark"
BULK = 100.0  # [MPa], some 1e4 times the stresses: J is 1 within 1e-4 on average
RESIDUAL = 1e-10  # [N, mm3]; the beam carries 2e-5 N
SOURCE = "Land et al. 2015, doi 10.1098/rspa.2015.0641: readings of its figures at second hand, see validation/land.py"
X = (1.0, 0.0, 0.0)
APEX = 0.6  # how long cells are at the apex of the ventricle that contracts, over what they were
AROUND = 7.85  # an eighth of a turn around the widest of the ventricle outside [mm]: a ladder's sizes are this over n
ENDO, EPI = (0.0, 0.0, -17.0), (0.0, 0.0, -20.0)
Point = tuple[float, float, float]


@dataclass(frozen=True)
class Helix:
    """The fibres of problem 3, from +90 degrees inside to -90 degrees outside."""

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """Unit vectors (n, 3) at rest points (n, 3) [mm]."""
        return np.asarray(find("land").fibre(points))


def effects_of(problem: Any, element: str, on: str, bulk: float) -> tuple[Effect, ...]:
    """What acts in a ``problem`` of ``validation.land``, its pressure ``on`` a part of the surface; ``bulk``: K [MPa]."""
    law = problem.law
    acting = (
        make("guccione", c=f"{law.c} MPa", bf=law.bf, bt=law.bt, bfs=law.bfs),
        resistance(element, bulk),
        make("pressure", on=on, pressure=f"{problem.pressure} MPa", ramp=ramp()),
    )
    if problem.tension == 0:
        return acting
    return (*acting, make("active_tension", tension=f"{problem.tension} MPa", ramp=ramp()))


@dataclass(frozen=True)
class Heart:
    """A problem as it is solved: by an ``element``, on cells of ``degree`` (1 straight, 2 curved) and of a ``bulk`` modulus [MPa];
    its stiffness and its active tension are off by the factors ``stiff`` and ``active``.
    """

    element: str
    degree: int = 2
    bulk: float = BULK
    stiff: float = 1.0
    active: float = 1.0

    def problem(self, number: int) -> Any:
        """The problem of ``validation.land`` with this one's errors."""
        right = getattr(find("land"), f"PROBLEM_{number}")
        law = replace(right.law, c=right.law.c * self.stiff)
        return replace(right, law=law, tension=right.tension * self.active)

    def beam(self, n: int) -> Body:
        """Half of the beam of problem 1, y <= 0.5, in 10n by n by 2n cells."""
        mesh = shapes.box((10 * n, n, 2 * n), (10.0, 0.5, 1.0), ELEMENTS[self.element][0], self.degree)
        fixed = (Prescribed("clamp", "x0", (0, 1, 2), Rest()), Prescribed("middle", "y1", (1,), Rest()))
        return Body(mesh, effects_of(self.problem(1), self.element, "z0", self.bulk), fixed, (0.0, 1.0), Along(X))

    def passive(self, counts: shapes.Counts) -> Body:
        """A quarter of the ventricle of problem 2, whose material is the same in all directions."""
        mesh = shapes.ventricle_quarter(counts, ELEMENTS[self.element][0], self.degree)
        fixed = (
            Prescribed("base", "base", (0, 1, 2), Rest()),
            Prescribed("x0", "x0", (0,), Rest()),
            Prescribed("y0", "y0", (1,), Rest()),
        )
        return Body(mesh, effects_of(self.problem(2), self.element, "endo", self.bulk), fixed, (0.0, 1.0), Along(X))

    def contracting(self, n: int) -> Body:
        """The ventricle of problem 3, whose pressure and tension grow together, with n cells around an eighth of a turn."""
        mesh = _crowded(shapes.ventricle((n, 7 * n // 2, n), ELEMENTS[self.element][0], self.degree))
        fixed = (Prescribed("base", "base", (0, 1, 2), Rest()),)
        return Body(mesh, effects_of(self.problem(3), self.element, "endo", self.bulk), fixed, (0.0, 1.0), Helix())

    def height(self, lab: Lab, body: Body, point: Point) -> float:
        """The z [mm] to which the node at ``point`` of one of the bodies goes."""
        state = lab.solve(body, self.element, first_step=0.2, residual=RESIDUAL).last
        return float(state.points[np.argmin(np.linalg.norm(body.mesh.points - point, axis=1)), 2])

    def beam_tip(self, lab: Lab, n: int) -> float:
        """The z of the point (10, 0.5, 1) of the beam [mm]."""
        return self.height(lab, self.beam(n), find("land").BEAM_POINT)

    def passive_apex(self, lab: Lab, n: int, point: Point) -> float:
        """The z [mm] of an apex of the ventricle that is filled, with n cells around an eighth of a turn."""
        return self.height(lab, self.passive((n, 7 * n // 2, n)), point)

    def active_apex(self, lab: Lab, n: int, point: Point) -> float:
        """The z [mm] of an apex of the ventricle that contracts."""
        return self.height(lab, self.contracting(n), point)


def _crowded(mesh: Cells) -> Cells:
    """The ventricle ``mesh``, its cells ``APEX`` times as long at the apex: their angle w from it, 1 at the base, becomes
    ``w (a + (1 - a) w^2)``. Fibres meet at the apex, and the stress has a logarithmic pole along the axis.
    """
    land, points = find("land"), mesh.points
    depth = land.depth(points)
    short, long = land.axes(depth)
    full = np.pi + land.base_angle(depth)
    share = np.arctan2(np.hypot(points[:, 0], points[:, 1]) / short, -points[:, 2] / long) / full
    angle = full * share * (APEX + (1 - APEX) * share**2)
    around = np.arctan2(-points[:, 1], -points[:, 0])
    return replace(mesh, points=land.wall(angle - np.pi, around, depth))


def _ladder(lab: Lab, value: Value, counts: tuple[int, ...], size: float) -> Finding:
    """The ``value`` on meshes of cells of ``size / count`` [mm]; no order, as the truth is published with few digits."""
    steps = tuple((size / n, value(lab, n)) for n in counts)
    return Finding(steps[-1][1], ladder=steps)


def _entry(name: str, title: str, truth: Callable[[], float], within: float, **fields: Any) -> Entry:
    """An entry whose value is a z [mm]; ``fields`` has ``because``, ``measure``, ``negative_control`` and
    ``with_negative_control``.
    """
    return Entry(
        name=name,
        group=GROUP,
        title=title,
        unit="mm",
        truth=truth,
        within=within,
        relative=True,
        kind="published",
        source=SOURCE,
        **fields,
    )


def _published(name: str, place: int | None = None) -> float:
    """A number of ``validation.land`` [mm]."""
    found = getattr(find("land"), name)
    return float(found if place is None else found[place])


_BEAM = Heart("P2/P1", degree=1)
_TETRAHEDRA, _HEXAHEDRA = Heart("P2/P1"), Heart("Q2/Q1")
_BOUND = "a bound that this project sets itself, as the numbers are readings of figures at second hand, whose error nobody states"


def _passive_entry(heart: Heart, place: int, because: str) -> Entry:
    """The inner (0) or outer (1) apex of the ventricle that is filled."""
    where, point = (("inside", ENDO), ("outside", EPI))[place]
    by = "tetrahedra" if heart == _TETRAHEDRA else "hexahedra"
    return _entry(
        f"ventricle_passive_{where}_{by}",
        f"A ventricle filled at 10 kPa: where its apex goes {where}, by quadratic {by}",
        partial(_published, "PASSIVE_APICES", place),
        0.005,
        because=f"0.5 %: {_BOUND}; {because}",
        measure=partial(_ladder, value=partial(heart.passive_apex, point=point), counts=(2, 3), size=AROUND),
        negative_control="20 % stiffer",
        with_negative_control=partial(
            once, value=partial(replace(heart, stiff=1.2).passive_apex, point=point), count=3
        ),
        slow=True,
        slow_negative_control=True,
    )


def _active_entry(place: int, because: str) -> Entry:
    """The inner (0) or outer (1) apex of the ventricle that contracts."""
    where, point = (("inside", ENDO), ("outside", EPI))[place]
    return _entry(
        f"ventricle_active_{where}",
        f"A ventricle that contracts at 60 kPa against 15 kPa: where its apex goes {where}, by quadratic hexahedra",
        partial(_published, "ACTIVE_APICES", place),
        0.005,
        because=f"0.5 %: {_BOUND}; {because}",
        measure=partial(_ladder, value=partial(_HEXAHEDRA.active_apex, point=point), counts=(2, 3), size=AROUND),
        negative_control="half the active tension",
        with_negative_control=partial(
            once, value=partial(replace(_HEXAHEDRA, active=0.5).active_apex, point=point), count=3
        ),
        slow=True,
        slow_negative_control=True,
    )


ENTRIES = (
    _entry(
        "beam_follower",
        "A beam of heart muscle under a pressure that stays normal to it: height of its end, by quadratic tetrahedra",
        partial(_published, "TIP_OF_BEAM"),
        0.003,
        because=f"0.3 %: {_BOUND}; the mesh leaves 0.2 %, as its clamped edges are singular",
        measure=partial(_ladder, value=_BEAM.beam_tip, counts=(2, 3), size=1.0),
        negative_control="5 % stiffer",
        with_negative_control=partial(once, value=replace(_BEAM, stiff=1.05).beam_tip, count=3),
        slow=True,
        slow_negative_control=True,
    ),
    *(_passive_entry(_TETRAHEDRA, place, "the mesh leaves 0.1 %") for place in (0, 1)),
    *(_passive_entry(_HEXAHEDRA, place, "the mesh leaves 0.1 %") for place in (0, 1)),
    _active_entry(0, "the mesh leaves 1 % at the coarse and some 0.2 % at the fine step"),
    _active_entry(1, "the mesh leaves 0.2 %"),
)
