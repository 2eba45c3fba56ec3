"""A block squeezed between plates: smooth ones, to a tenth of its height and back, and glued ones, until its corners fold over.

Smooth plates leave every state homogeneous, also below half the height, where it is unstable: Newton's method follows it, as
nothing on a structured mesh disturbs it. On the return path a load step that is too large finds another state at rest: the block
turned by half a turn, through its planes of symmetry. It is not taken, as det F falls to 0 on the straight way there.
"""

from functools import partial
from typing import Any

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.runs.store import Frame, Run
from fem_reference.verification.parts import NO_GRADIENT, SYMMETRY, YES, clamped, farthest, frames, neo_hooke
from fem_reference.verification.truths import find

MU = 0.01  # [MPa]
HEIGHT = 0.1  # of the squeezed block over that at rest
STEPS = 5  # in each direction
RESIDUAL = 1e-11  # [N, mm3]
GLUED_TO, GLUED_STEPS = 0.4, 12


def smooth(lab: Lab, element: str, bulk: float, *, growing: bool = False, back: float = 1.0) -> tuple[Frame, ...]:
    """All states of an eighth of a cube there and as much of the way ``back``: at even steps, or where they are ``growing`` at the
    ends of both paths.
    """
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    path = Affine(NO_GRADIENT, (0.0, 0.0, HEIGHT - 1), ((0.0, 0.0), (1.0, 1.0), (2.0, 1 - back)))
    plate = Prescribed("plate", "z1", (2,), path)
    body = Body(mesh, neo_hooke(MU, bulk), (*SYMMETRY, plate), frames(2, 2 if growing else 2 * STEPS))
    # Every state by Newton's method, those of the return path too.
    solved = lab.solve(body, element, first_step=0.05, smallest_step=1e-3, residual=RESIDUAL, reuse=False)
    return (*solved.states[:-1], solved.last)


def _finding(value: float, states: tuple[Frame, ...]) -> Finding:
    """The finding with the cost of the squeeze, and the smallest det F of all its states."""
    scalars = [state.scalars for state in states]
    smallest = min(min(one["min_det_F_quadrature"], one["min_det_F_vertices"]) for one in scalars)
    iterations = sum(one["newton_iterations"] for one in scalars)
    return Finding(value, note=f"{iterations:.0f} Newton iterations, det F at least {smallest:.8f}")


def force(lab: Lab, element: str, bulk: float) -> Finding:
    """The force of the plate at a tenth of the height [N]."""
    states = smooth(lab, element, bulk)
    return _finding(float(states[STEPS].forces["plate"][2]), states)


def volume(lab: Lab, element: str, bulk: float) -> Finding:
    """V / V0 at a tenth of the height."""
    states = smooth(lab, element, bulk)
    return _finding(states[STEPS].scalars["volume_ratio"], states)


def distance_from_rest(lab: Lab, element: str, bulk: float, *, growing: bool, back: float = 1.0) -> Finding:
    """The largest distance of a node from rest [mm] when the plate is as much of the way ``back``."""
    states = smooth(lab, element, bulk, growing=growing, back=back)
    return _finding(farthest(states[-1].points, states[0].points), states)


def glued(lab: Lab, element: str, count: int, height: float, **settings: Any) -> Run:
    """The states of a cube of ``count`` cells a side between plates that it sticks to, down to a ``height``."""
    mesh = shapes.box((count,) * 3, (1.0, 1.0, 1.0), ELEMENTS[element][0])
    top = Prescribed("top", "z1", (0, 1, 2), Affine(NO_GRADIENT, (0.0, 0.0, height - 1)))
    body = Body(mesh, neo_hooke(MU, 10.0), (*clamped("z0"), top), frames(1, GLUED_STEPS))
    return lab.solve(body, element, first_step=1.0, smallest_step=0.005, residual=RESIDUAL, **settings)


def _end_note(solved: Run, height: float) -> str:
    last = solved.states[-1]
    return (
        f"{solved.outcome.status}: {solved.outcome.message}. "
        f"Last state kept at {1 - (1 - height) * last.number:.3f} of the height: "
        f"det F at least {last.scalars['min_det_F_quadrature']:.3f} at quadrature points, "
        f"{last.scalars['min_det_F_vertices']:.3f} at vertices, V/V0 {last.scalars['volume_ratio']:.5f}"
    )


def inverts(lab: Lab, element: str, count: int, height: float) -> Finding:
    """1 where the squeeze ends as inverted in a state that Newton's method accepts, else 0."""
    solved = glued(lab, element, count, height)
    outcome = solved.outcome
    found = outcome.status == "inverted" and "Newton's method converged" in outcome.message
    return Finding(float(found), note=_end_note(solved, height))


def stays_upright(lab: Lab, element: str, count: int, height: float, **settings: Any) -> Finding:
    """1 where the squeeze ends with det F above zero at every point looked at, else 0."""
    solved = glued(lab, element, count, height, **settings)
    scalars = solved.states[-1].scalars
    smallest = min(scalars["min_det_F_quadrature"], scalars["min_det_F_vertices"])
    return Finding(float(solved.outcome.status == "converged" and smallest > 0), note=_end_note(solved, height))


loads = find("loads")
EXACT = "the state is homogeneous, so that every element has it: Newton's residual of 1e-11 N and rounding remain"
SMOOTH = partial(
    Entry,
    group="squeeze",
    negative_control="bulk modulus 1 % too small",
    within=1e-10,
    because=EXACT,
    kind="closed form",
    source="validation/loads.py: one scalar equation for the volume, from the energy by hand (Holzapfel 2000, ch. 6.4)",
)
GLUED = partial(
    YES,
    group="squeeze",
    source="det F above zero everywhere, or material would go through itself",
)
ENTRIES: tuple[Entry, ...] = (
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
        title="Volume of that block over its volume at rest, K/mu = 1e+03, Q2/Q1",
        unit="1",
        measure=volume,
        given={"element": "Q2/Q1", "bulk": 10.0},
        wrong={"bulk": 0.99 * 10.0},
        truth=lambda: loads.squeezed_volume(MU, 10.0, HEIGHT),
    ),
    *(
        SMOOTH(
            name=f"squeeze_return_{name}",
            title=f"How far that block is from its rest state when the plates are back, K/mu = {bulk / MU:.0e}, {element}"
            + (", in load steps that may grow" if growing else ""),
            unit="mm",
            measure=distance_from_rest,
            given={"element": element, "bulk": bulk, "growing": growing},
            negative_control="the plates stop a thousandth of their way before they are back",
            wrong={"back": 0.999},
            truth=0.0,
            because=f"{EXACT}; of an elastic body nothing remembers the squeeze",
            kind="property",
            source="a hyperelastic body that nothing loads or moves is at rest",
        )
        for name, element, bulk, growing in (
            ("k1e3", "Q2/Q1", 10.0, False),
            ("k1e6", "P2/P1", 1e4, False),
            ("large_steps", "Q2/Q1", 10.0, True),
        )
    ),
    GLUED(
        name="bonded_squeeze_is_inverted",
        title="Squeezed to 0.4 of its height between plates that it sticks to, Q1/P0 folds over at its corners, as reported",
        measure=inverts,
        given={"element": "Q1/P0", "count": 4, "height": GLUED_TO},
        negative_control="squeezed to 0.7 of its height only",
        wrong={"height": 0.7},
        source="det F above zero everywhere, or material would go through itself; Newton's method does not see it at a vertex",
    ),
    GLUED(
        name="bonded_squeeze_stays_upright",
        title="Squeezed to 0.7 of its height between plates that it sticks to, Q2/Q1 keeps det F above zero everywhere",
        measure=stays_upright,
        given={"element": "Q2/Q1", "count": 2, "height": 0.7},
        negative_control="squeezed to 0.4 of its height",
        wrong={"height": GLUED_TO},
    ),
    GLUED(
        name="bonded_squeeze_with_vertices",
        title="Squeezed to 0.4 of its height between plates that it sticks to, P2/P1 keeps det F above zero everywhere",
        measure=stays_upright,
        given={"element": "P2/P1", "count": 2, "height": GLUED_TO},
        negative_control="a rule of quadrature of degree 4, which has no points at the vertices",
        wrong={"quadrature_degree": 4},
    ),
)
