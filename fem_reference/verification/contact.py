"""Contact of a deformable body with a rigid body: a plate pressed onto a block, and a sphere pressed into a large body (Hertz)."""

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
# Radius of the sphere [mm], distance by which the sphere is pressed into the body [mm], and bulk modulus of the body [MPa]. The
# contact radius is 1 mm.
RADIUS, APPROACH, BULK = 10.0, 0.1, 10.0
# Contact stiffness of the sphere [MPa/mm], and radii of the body and of its finely meshed core [mm].
BALL_STIFFNESS, FAR, CORE = 2.0, 300.0, 1.2


def sliding_by(path: float) -> Callable[[float], Floats]:
    """The pose of a rigid body that moves along z by the distance ``path`` [mm] from frame 0 to frame 1.

    Returns a function from the frame to the pose, a 4 x 4 matrix.
    """
    return RigidMotion((0.0, 0.0, 1.0), None, (0.0, 1.0), (0.0, path)).pose


def plate(lab: Lab, element: str, stiffness: float) -> Finding:
    """Compute the force [N] on a frictionless rigid plate that is pressed onto a cube.

    The model is one eighth of a cube with sides of 2 mm. ``stiffness``: contact stiffness of the plate [MPa/mm].
    """
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    law = ContactLaw("z1", stiffness, 0.01)
    above = ContactBone("plate", HalfSpace((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), sliding_by(-PLATE_TRAVEL))
    body = Body(mesh, neo_hooke(MU, PLATE_BULK), SYMMETRY, (0.0, 1.0), contact=law, bones=(above,))
    state = lab.solve(body, element, first_step=0.2, residual=1e-12).last
    return Finding(float(state.forces["plate"][2]), note=f"penetration {state.scalars['contact_depth']:.4f} mm")


def in_series(bulk: float, stiffness: float, travel: float) -> float:
    """The force [N] that compresses a cube with sides of 1 mm in series with a spring.

    ``bulk``: bulk modulus of the cube [MPa]. ``stiffness``: stiffness of the spring per unit area [MPa/mm]. ``travel``: distance by
    which the free end of the spring moves down [mm]. Contact acts like this spring if the penetration exceeds the smoothing
    distance.
    """
    force = partial(find("loads").squeeze_force, MU, bulk, area=1.0)

    def apart(stretch: float) -> float:
        return float(force(stretch=stretch)) + stiffness * (stretch - (1 - travel))

    return float(force(stretch=brentq(apart, 1 - travel, 1.0, xtol=1e-15)))


def pressed(lab: Lab, n: int, radius: float) -> Frame:
    """Press a rigid sphere of ``radius`` [mm] into a large body by APPROACH, and return the final state.

    The model is a quarter of the body, which lies at z >= 0. ``n``: number of cells along each side of the core of the mesh.
    """
    mesh = shapes.ball_octant(CORE, FAR, n, 2 * n + 2, "hexahedron", 2)
    law = ContactLaw("z0", BALL_STIFFNESS, 5e-4)
    ball = ContactBone("ball", Sphere((0.0, 0.0, -radius), radius), sliding_by(APPROACH))
    body = Body(mesh, neo_hooke(MU, BULK), (*SYMMETRY[:2], *clamped("outer")), (0.0, 1.0), contact=law, bones=(ball,))
    return lab.solve(body, "Q2/Q1", first_step=0.5, residual=1e-10, newton_iterations=25).last


def ball_readings(name: str) -> dict[str, Callable[[Frame], float]]:
    """Functions that read the force and the contact radius from a state of the quarter model. ``name``: key of the contact force.

    ``force`` is the force on the whole sphere [N]. ``contact_radius`` [mm] follows from the moment arm of the force on the quarter:
    the resultant of the Hertz pressure on a quarter acts at a distance of 3/8 of the contact radius from each plane of symmetry.
    """
    return {
        "force": lambda state: 4 * float(state.forces[name][2]),
        "contact_radius": lambda state: 8 / 3 * float(-state.moments[name][1] / state.forces[name][2]),
    }


# Quantities read from a state with a rigid sphere: force, contact radius and maximum contact pressure [MPa].
READINGS: dict[str, Callable[[Frame], float]] = {
    **ball_readings("ball"),
    "peak_pressure": lambda state: float(state.scalars["contact_pressure"]),
}


def ball(lab: Lab, reading: str, radius: float) -> Finding:
    """Compute one quantity of READINGS for a sphere of ``radius`` [mm] pressed into a large body."""
    state = pressed(lab, 4, radius)
    depth = 1000 * state.scalars["contact_depth"]
    return Finding(READINGS[reading](state), note=f"the penetration of the sphere is {depth:.1f} micrometres")


YOUNG, POISSON = 9 * BULK * MU / (3 * BULK + MU), (3 * BULK - 2 * MU) / (2 * (3 * BULK + MU))


def known_ball(name: str) -> float:
    """The value of the quantity ``name`` in Hertz's closed form, for a rigid sphere on a body with the moduli YOUNG and POISSON."""
    hertz = find("hertz")
    known = hertz.rigid_sphere(RADIUS, YOUNG, POISSON, hertz.force_at(RADIUS, YOUNG, POISSON, APPROACH))
    return float(getattr(known, name))


CONTACT = partial(Entry, group="contact", relative=True, kind="closed form")
# For each quantity: the word in the name of the entry, the words in its title, and the unit.
_SAID = {
    "force": ("force", "the force", "N"),
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
    """One entry of the catalogue for each quantity in ``readings``.

    ``name`` and ``title``: texts with a placeholder ``{}``, which is replaced with the words in ``_SAID``. ``measure``: function
    that computes a quantity. ``known``: function that returns its exact value. ``because``: the reason for the tolerance.
    """
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
            title=f"A frictionless plate that compresses a block of {element} elements to about half its height: the force",
            unit="N",
            measure=plate,
            given={"element": element, "stiffness": PLATE_STIFFNESS},
            **control("a contact stiffness that is 1 % higher", stiffness=1.01 * PLATE_STIFFNESS),
            truth=partial(in_series, PLATE_BULK, PLATE_STIFFNESS, PLATE_TRAVEL),
            within=1e-9,
            because="the strain is uniform and contact acts as a spring, so the only error is the Newton residual of 1e-12 N",
            source="validation/loads.py: compression of a block, here in series with a spring",
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
