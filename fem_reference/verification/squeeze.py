"""A block squeezed between smooth plates, to a tenth of its height and back or until it collapses, and between plates to which
it sticks, until its corners fold over.

Between smooth plates every state is homogeneous. Below half the height such states are unstable, but Newton's method follows them,
as a structured mesh does not disturb them. On the return path, too large a load step finds another stress-free state, the block
rotated by half a turn, beyond its planes of symmetry. This state is rejected, as det F falls to 0 on the straight line to it.

If the bulk modulus is low, there is a height below which no state near the rest volume exists. The isochoric neo-Hookean energy
favours a smaller volume, which the law ``K/2 (J - 1)^2`` cannot prevent: its pressure is K at most. With free sides the equilibrium
is ``mu/3 (J/stretch - stretch^2) = K J^(5/3) (1 - J)``. Without ``stretch^2`` this is ``mu/(3 stretch) = K J^(2/3) (1 - J)``, whose
right-hand side is 0.326 K at most, at J = 2/5. Below a stretch of about mu/K the only state is near ``J = stretch^3``: a block that
has shrunk equally along all axes, without shear and without force on the plate.
"""

from functools import partial
from typing import Any

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.runs.store import Frame, Run
from fem_reference.verification.parts import NO_GRADIENT, SYMMETRY, clamped, control, farthest, find, frames, neo_hooke

loads = find("loads")
MU = 0.01  # [MPa]
HEIGHT = 0.1  # of the squeezed block, relative to rest; a collapsed block has a thousandth of its rest volume there
STEPS = 5  # in each direction
RESIDUAL = 1e-11  # [N, mm3]
GLUED_TO, GLUED_STEPS = 0.4, 12
POISSON = 0.3  # of a block that collapses
# Stretches on the branch of states that begins at rest; from 0.45 on, the volume falls steeply, from 0.59 to 0.42 of V0.
STRETCHES = (1.0, 0.8, 0.6, 0.5, 0.45, 0.43, 0.425, 0.42, 0.415, 0.41, 0.405, 0.4)
LOWEST = 0.5  # the smallest V/V0 in the range of the law


def bulk_modulus(poisson: float) -> float:
    """The bulk modulus [MPa] of a material with the shear modulus ``MU`` [MPa] and Poisson's ratio ``poisson``."""
    return 2 * MU * (1 + poisson) / (3 * (1 - 2 * poisson))


def plated(lab: Lab, element: str, bulk: float, path: Affine, numbers: tuple[float, ...], **settings: Any) -> Run:
    """The states, at the frames ``numbers``, of an eighth of a cube with free sides, whose smooth plate follows a ``path``."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    body = Body(mesh, neo_hooke(MU, bulk, element), (*SYMMETRY, Prescribed("plate", "z1", (2,), path)), numbers)
    return lab.solve(body, element, smallest_step=1e-3, residual=RESIDUAL, **settings)


def smooth(lab: Lab, element: str, bulk: float, *, growing: bool = False, back: float = 1.0) -> tuple[Frame, ...]:
    """All states of the block on the path down and on the fraction ``back`` of the return: after equal load steps or, if the steps
    are ``growing``, at the ends of both paths.
    """
    path = Affine(NO_GRADIENT, (0.0, 0.0, HEIGHT - 1), ((0.0, 0.0), (1.0, 1.0), (2.0, 1 - back)))
    # Without reuse, Newton's method solves for every state, even on the return path.
    solved = plated(lab, element, bulk, path, frames(2, 2 if growing else 2 * STEPS), first_step=0.05, reuse=False)
    return (*solved.states[:-1], solved.last)


def _finding(value: float, states: tuple[Frame, ...]) -> Finding:
    """The finding, with a note on the number of Newton iterations and the smallest det F in all ``states``."""
    scalars = [state.scalars for state in states]
    smallest = min(min(one["min_det_F_quadrature"], one["min_det_F_vertices"]) for one in scalars)
    iterations = sum(one["newton_iterations"] for one in scalars)
    return Finding(value, note=f"{iterations:.0f} Newton iterations, det F at least {smallest:.8f}")


def force(lab: Lab, element: str, bulk: float) -> Finding:
    """The force [N] of the plate at a tenth of the height."""
    states = smooth(lab, element, bulk)
    return _finding(float(states[STEPS].forces["plate"][2]), states)


def volume(lab: Lab, element: str, bulk: float) -> Finding:
    """V / V0 at a tenth of the height."""
    states = smooth(lab, element, bulk)
    return _finding(states[STEPS].scalars["volume_ratio"], states)


def distance_from_rest(lab: Lab, element: str, bulk: float, *, growing: bool, back: float = 1.0) -> Finding:
    """The largest distance [mm] of a node from its rest position when the plate is at the fraction ``back`` of its return."""
    states = smooth(lab, element, bulk, growing=growing, back=back)
    return _finding(farthest(states[-1].points, states[0].points), states)


def squeezed(lab: Lab, element: str, poisson: float, stretches: tuple[float, ...]) -> Run:
    """The states of the block at ``stretches`` of its height, the first of which is 1."""
    numbers = tuple(1 - stretch for stretch in stretches)
    path = Affine(NO_GRADIENT, (0.0, 0.0, -1.0))
    return plated(lab, element, bulk_modulus(poisson), path, numbers, first_step=0.1)


def collapses(lab: Lab, element: str, poisson: float) -> Finding:
    """Return 1 if the squeeze stops before its end, keeps no state below a fifth of the volume, and names the law outside its
    range; otherwise 0. Newton's method finds a collapsed state or, as the steep branch towards it folds back, no state.
    """
    solved = squeezed(lab, element, poisson, tuple(1 - frame for frame in frames(1 - HEIGHT, 6)))
    least = min(state.scalars["min_cell_volume_ratio"] for state in solved.states)
    ended = solved.outcome.status in ("collapsed", "diverged", "limit point")
    found = ended and least >= 0.2 and "incompressible is outside its range" in solved.outcome.message
    return Finding(float(found), note=f"{solved.outcome.status}: {solved.outcome.message}")


def outside(lab: Lab, element: str, poisson: float) -> Finding:
    """The number of states in which a law is outside its range."""
    solved = squeezed(lab, element, poisson, STRETCHES)
    found = sum(state.scalars["outside_law"] > 0 for state in (*solved.states[:-1], solved.last))
    return Finding(float(found), note=solved.outcome.message)


def glued(lab: Lab, element: str, count: int, height: float, **settings: Any) -> Run:
    """The states of a cube with ``count`` cells along each side, between plates to which it sticks, down to a ``height``."""
    mesh = shapes.box((count,) * 3, (1.0, 1.0, 1.0), ELEMENTS[element][0])
    top = Prescribed("top", "z1", (0, 1, 2), Affine(NO_GRADIENT, (0.0, 0.0, height - 1)))
    body = Body(mesh, neo_hooke(MU, 10.0), (*clamped("z0"), top), frames(1, GLUED_STEPS))
    return lab.solve(body, element, first_step=1.0, smallest_step=0.005, residual=RESIDUAL, **settings)


def _end_note(solved: Run, height: float) -> str:
    number, at = solved.states[-1].number, solved.states[-1].scalars
    return (
        f"{solved.outcome.status}: {solved.outcome.message}. Last state kept at {1 - (1 - height) * number:.3f} of the height: "
        f"det F at least {at['min_det_F_quadrature']:.3f} at quadrature points, {at['min_det_F_vertices']:.3f} at vertices, "
        f"V/V0 {at['volume_ratio']:.5f}"
    )


def inverts(lab: Lab, element: str, count: int, height: float) -> Finding:
    """Return 1 if the squeeze ends with the status "inverted" in a state at which Newton's method converged, otherwise 0."""
    solved = glued(lab, element, count, height)
    found = solved.outcome.status == "inverted" and "Newton's method converged" in solved.outcome.message
    return Finding(float(found), note=_end_note(solved, height))


def stays_upright(lab: Lab, element: str, count: int, height: float, **settings: Any) -> Finding:
    """Return 1 if the squeeze reaches its end with det F above zero at every checked point, otherwise 0."""
    solved = glued(lab, element, count, height, **settings)
    scalars = solved.states[-1].scalars
    smallest = min(scalars["min_det_F_quadrature"], scalars["min_det_F_vertices"])
    return Finding(float(solved.outcome.status == "converged" and smallest > 0), note=_end_note(solved, height))


EXACT = "the state is homogeneous and every element represents it: Newton's residual of 1e-11 N and rounding remain"
BALANCE = "validation/loads.py: one scalar equation for the volume, from the energy by hand (Holzapfel 2000, ch. 6.4)"
# A property that holds (1) or does not (0).
YES = partial(Entry, unit="1", truth=1.0, within=0.1, because="the answer is yes (1) or no (0)", kind="property")
EXACTLY = partial(Entry, group="squeeze", within=1e-10, because=EXACT, kind="closed form", source=BALANCE)
SMOOTH = partial(EXACTLY, negative_control="bulk modulus 1 % too small")
UPRIGHT = "det F must be above zero everywhere, or the material would pass through itself"
GLUED = partial(YES, group="squeeze", source=UPRIGHT)

ENTRIES: tuple[Entry, ...] = (
    YES(
        name="collapse_is_no_result",
        group="collapse",
        title="A block of Poisson's ratio 0.3 squeezed to a tenth of its height: the run is rejected and its law named, with P2/P1",
        measure=collapses,
        given={"element": "P2/P1", "poisson": POISSON},
        **control("a Poisson ratio of 0.499, which keeps 0.993 of the volume", poisson=0.499),
        source="validation/loads.py: the only equilibrium has a thousandth of the volume, which is impossible for tissue",
    ),
    Entry(
        name="law_outside_its_range",
        group="collapse",
        title="The number of states with less than half of the volume in a squeeze from 1 to 0.4 of the height, with Q1/P0",
        unit="1",
        measure=outside,
        given={"element": "Q1/P0", "poisson": POISSON},
        **control("a Poisson ratio of 0.32", poisson=0.32),  # with which more than half of the volume is left
        truth=lambda: sum(loads.squeezed_volume(MU, bulk_modulus(POISSON), at) < LOWEST for at in STRETCHES),
        within=0.1,
        because="the value is a number of states, each homogeneous, so that every element represents it exactly",
        kind="closed form",
        source=BALANCE,
    ),
    *(
        SMOOTH(
            name=f"squeeze_force_k{power}",
            title=f"Force of smooth plates that squeeze a block to a tenth of its height, K/mu = {bulk / MU:.0e}, {element}",
            unit="N",
            measure=force,
            given={"element": element, "bulk": bulk},
            wrong={"bulk": 0.99 * bulk},
            truth=partial(loads.squeeze_force, MU, bulk, HEIGHT, 1.0),
            relative=True,
        )
        for power, element, bulk in (("1e3", "P2/P1", 10.0), ("1e6", "Q2/Q1", 1e4))
    ),
    SMOOTH(
        name="squeeze_volume_k1e3",
        title="Volume of a block squeezed to a tenth of its height, relative to its rest volume, K/mu = 1e+03, Q2/Q1",
        unit="1",
        measure=volume,
        given={"element": "Q2/Q1", "bulk": 10.0},
        wrong={"bulk": 0.99 * 10.0},
        truth=lambda: loads.squeezed_volume(MU, 10.0, HEIGHT),
    ),
    *(
        SMOOTH(
            name=f"squeeze_return_{name}",
            title="Block squeezed by plates that return to their start: largest distance of a node from its rest position, "
            f"K/mu = {bulk / MU:.0e}, {element}" + (", in load steps that may grow" if growing else ""),
            unit="mm",
            measure=distance_from_rest,
            given={"element": element, "bulk": bulk, "growing": growing},
            **control("the plates stop a thousandth of the path before their return", back=0.999),
            truth=0.0,
            because=f"{EXACT}; an elastic body recovers completely",
            kind="property",
            source="an unloaded, unconstrained hyperelastic body returns to rest",
        )
        for name, element, bulk, growing in (
            ("k1e3", "Q2/Q1", 10.0, False),
            ("k1e6", "P2/P1", 1e4, False),
            ("large_steps", "Q2/Q1", 10.0, True),
        )
    ),
    GLUED(
        name="bonded_squeeze_is_inverted",
        title="A cube squeezed to 0.4 of its height between plates to which it sticks folds over at its corners, with Q1/P0",
        measure=inverts,
        given={"element": "Q1/P0", "count": 4, "height": GLUED_TO},
        **control("squeezed to 0.7 of its height only", height=0.7),
        source=f"{UPRIGHT}; Newton's method does not notice an inverted vertex",
    ),
    GLUED(
        name="bonded_squeeze_stays_upright",
        title="A cube squeezed to 0.7 of its height between plates to which it sticks keeps det F above zero, with Q2/Q1",
        measure=stays_upright,
        given={"element": "Q2/Q1", "count": 2, "height": 0.7},
        **control("squeezed to 0.4 of its height", height=GLUED_TO),
    ),
    GLUED(
        name="bonded_squeeze_with_vertices",
        title="A cube squeezed to 0.4 of its height between plates to which it sticks keeps det F above zero, with P2/P1",
        measure=stays_upright,
        given={"element": "P2/P1", "count": 2, "height": GLUED_TO},
        **control("a quadrature rule of degree 4, which has no points at the vertices", quadrature_degree=4),
    ),
)
