"""Contact between deformable and rigid bodies: a plate on a block, and a sphere on a large body (Hertz)."""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

from scipy.optimize import brentq

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import HalfSpace, Sphere
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.runs.store import Frame
from fem_reference.verification.parts import SLOW, SYMMETRY, clamped, control, find, neo_hooke

MU = 0.01  # [MPa]
PLATE_BULK, PLATE_STIFFNESS, PLATE_TRAVEL = 10.0, 1.0, 0.5  # [MPa], [MPa/mm], [mm]; the cube has sides of 1 mm
# Radius and approach of the sphere [mm], and the bulk modulus of the body [MPa]; the contact radius is 1 mm.
RADIUS, APPROACH, BULK = 10.0, 0.1, 10.0
BALL_STIFFNESS, FAR, CORE = 2.0, 300.0, 1.2  # [MPa/mm]; radii of the body and of its finely meshed core [mm]


def sliding_by(path: float) -> Callable[[float], Floats]:
    """The pose, 4 x 4, of a body that slides along z by a ``path`` [mm] from frame 0 to frame 1."""
    return RigidMotion((0.0, 0.0, 1.0), None, (0.0, 1.0), (0.0, path)).pose


def plate(lab: Lab, element: str, stiffness: float) -> Finding:
    """The force [N] of a smooth plate that is moved down onto an eighth of a 2 mm cube."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    law = ContactLaw("z1", stiffness, 0.01)
    above = ContactBone("plate", HalfSpace((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), sliding_by(-PLATE_TRAVEL))
    body = Body(mesh, neo_hooke(MU, PLATE_BULK), SYMMETRY, (0.0, 1.0), contact=law, bones=(above,))
    state = lab.solve(body, element, first_step=0.2, residual=1e-12).last
    return Finding(float(state.forces["plate"][2]), note=f"{state.scalars['contact_depth']:.4f} mm deep")


def in_series(bulk: float, stiffness: float, travel: float) -> float:
    """The force [N] of a 1 mm block with a ``bulk`` modulus [MPa] in series with a spring of ``stiffness`` [MPa/mm]; the end of the
    spring is moved down by ``travel`` [mm]. Deeper than its smoothing, contact acts as this spring.
    """
    force = partial(find("loads").squeeze_force, MU, bulk, area=1.0)

    def apart(stretch: float) -> float:
        return float(force(stretch=stretch)) + stiffness * (stretch - (1 - travel))

    return float(force(stretch=brentq(apart, 1 - travel, 1.0, xtol=1e-15)))


def pressed(lab: Lab, n: int, radius: float) -> Frame:
    """A quarter of a large body, z >= 0, into which a sphere of ``radius`` [mm] is pressed by APPROACH."""
    mesh = shapes.ball_octant(CORE, FAR, n, 2 * n + 2, "hexahedron", 2)
    law = ContactLaw("z0", BALL_STIFFNESS, 5e-4)
    ball = ContactBone("ball", Sphere((0.0, 0.0, -radius), radius), sliding_by(APPROACH))
    body = Body(mesh, neo_hooke(MU, BULK), (*SYMMETRY[:2], *clamped("outer")), (0.0, 1.0), contact=law, bones=(ball,))
    return lab.solve(body, "Q2/Q1", first_step=0.5, residual=1e-10, newton_iterations=25).last


def ball_readings(name: str) -> dict[str, Callable[[Frame], float]]:
    """Readings of the force ``name`` on a quarter: the force on the whole sphere [N], and the contact radius [mm] from the moment
    arm, as the resultant of Hertz's pressure on a quarter acts at 3/8 of this radius.
    """
    return {
        "force": lambda state: 4 * float(state.forces[name][2]),
        "contact_radius": lambda state: 8 / 3 * float(-state.moments[name][1] / state.forces[name][2]),
    }


# The readings of a sphere, and the maximum pressure [MPa].
READINGS: dict[str, Callable[[Frame], float]] = {
    **ball_readings("ball"),
    "peak_pressure": lambda state: float(state.scalars["contact_pressure"]),
}


def ball(lab: Lab, reading: str, radius: float) -> Finding:
    """A reading of the pressed body."""
    state = pressed(lab, 4, radius)
    depth = 1000 * state.scalars["contact_depth"]
    return Finding(READINGS[reading](state), note=f"the sphere is {depth:.1f} micrometres deep in the body")


YOUNG, POISSON = 9 * BULK * MU / (3 * BULK + MU), (3 * BULK - 2 * MU) / (2 * (3 * BULK + MU))


def known_ball(name: str) -> float:
    """The closed form for a rigid sphere on a body with these moduli."""
    hertz = find("hertz")
    known = hertz.rigid_sphere(RADIUS, YOUNG, POISSON, hertz.force_at(RADIUS, YOUNG, POISSON, APPROACH))
    return float(getattr(known, name))


CONTACT = partial(Entry, group="contact", relative=True, kind="closed form")
# For each reading: the end of the entry's name, the end of its title, and the unit.
_SAID = {
    "force": ("force", "its force", "N"),
    "contact_radius": ("radius", "the contact radius", "mm"),
    "peak_pressure": ("pressure", "the maximum pressure", "MPa"),
}


def hertzian(
    name: str,
    title: str,
    measure: Callable[[Lab, str, float], Finding],
    known: Callable[[str], float],
    because: str,
    readings: Iterable[str],
) -> Iterator[Entry]:
    """The entries of a pressed sphere: one for each of the ``readings``, with its words inserted in ``name`` and ``title``."""
    for reading in readings:
        end, words, unit = _SAID[reading]
        yield CONTACT(
            name=name.format(end),
            title=title.format(words),
            unit=unit,
            measure=measure,
            given={"reading": reading, "radius": RADIUS},
            **control("a sphere of twice the radius", radius=2 * RADIUS),
            truth=partial(known, reading),
            within=0.02,
            because=because,
            source="Hertz 1882; validation/hertz.py",
            **SLOW,
        )


ENTRIES = (
    *(
        CONTACT(
            name=f"plate_{element.lower().replace('/', '_')}",
            title=f"A smooth plate on a block, with {element} elements: its force at half the height",
            unit="N",
            measure=plate,
            given={"element": element, "stiffness": PLATE_STIFFNESS},
            **control("a plate 1 % stiffer", stiffness=1.01 * PLATE_STIFFNESS),
            truth=partial(in_series, PLATE_BULK, PLATE_STIFFNESS, PLATE_TRAVEL),
            within=1e-9,
            because="the state is homogeneous and the plate acts as a spring: only the Newton residual of 1e-12 N remains",
            source="validation/loads.py: the squeeze of a block, in series with the spring",
        )
        for element in ("P2/P1", "Q2/Q1", "Q1/P0")
    ),
    *hertzian(
        "hertz_{}",
        "A rigid sphere pressed into a large body: {}",
        ball,
        known_ball,
        "the discretisation error is 1 to 1.5 %; strains of 0.1, the finite size of the body and the penetration each add less",
        READINGS,
    ),
)
