"""A block squeezed between plates: smooth ones, to a tenth of its height and back, and glued ones, until its corners fold over.

Smooth plates leave every state homogeneous, also below half the height, where it is unstable: Newton's method follows it, as
nothing on a structured mesh disturbs it. On the return path a load step that is too large finds another state at rest: the block
turned by half a turn, through its planes of symmetry. It is not taken, as det F falls to 0 on the straight way there.
"""

from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.runs.solved import Reached, Solved
from fem_reference.verification.parts import neo_hooke, zero
from fem_reference.verification.truths import find

MU = 0.01  # [MPa]
HEIGHT = 0.1  # of the squeezed block over that at rest
THERE_AND_BACK = ((0.0, 0.0), (1.0, 1.0), (2.0, 0.0))
STEPS = 5  # in each direction
RESIDUAL = 1e-11  # [N, mm3]
GLUED_TO, GLUED_STEPS = 0.4, 12
_NOT_MOVING = ((0.0, 0.0, 0.0),) * 3


def _smooth(lab: Lab, element: str, bulk: float, *, growing: bool = False, back: float = 1.0) -> tuple[Reached, ...]:
    """All states of an eighth of a cube there and as much of the way ``back``: at even steps, or where they are ``growing`` at the
    ends of both paths.
    """
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    prescribed = (
        Prescribed("x0", "x0", (0,), Rest()),
        Prescribed("y0", "y0", (1,), Rest()),
        Prescribed("middle", "z0", (2,), Rest()),
        Prescribed(
            "plate", "z1", (2,), Affine(_NOT_MOVING, (0.0, 0.0, HEIGHT - 1), (*THERE_AND_BACK[:2], (2.0, 1 - back)))
        ),
    )
    frames = (0.0, 1.0, 2.0) if growing else tuple(np.linspace(0, 2, 2 * STEPS + 1).tolist())
    body = Body(mesh, neo_hooke(MU, bulk), prescribed, frames)
    # Every state by Newton's method, those of the return path too.
    solved = lab.solve(body, element, first_step=0.05, smallest_step=1e-3, residual=RESIDUAL, reuse=False)
    return (*solved.states[:-1], solved.last)


def _note(states: tuple[Reached, ...]) -> str:
    """What the squeeze cost, and the smallest det F of all its states."""
    scalars = [state.scalars for state in states]
    smallest = min(min(one["min_det_F_quadrature"], one["min_det_F_vertices"]) for one in scalars)
    return f"{sum(one['newton_iterations'] for one in scalars):.0f} Newton iterations, det F at least {smallest:.8f}"


def force(lab: Lab, element: str, bulk: float, error: float = 0.0) -> Finding:
    """Of the plate at a tenth of the height [N]; ``error``: of the bulk modulus, relative."""
    states = _smooth(lab, element, bulk * (1 + error))
    return Finding(float(states[STEPS].forces["plate"][2]), note=_note(states))


def volume(lab: Lab, element: str, bulk: float, error: float = 0.0) -> Finding:
    """V / V0 at a tenth of the height."""
    states = _smooth(lab, element, bulk * (1 + error))
    return Finding(states[STEPS].scalars["volume_ratio"], note=_note(states))


def distance_from_rest(lab: Lab, element: str, bulk: float, *, growing: bool = False, back: float = 1.0) -> Finding:
    """How far from rest [mm] any node is when the plate is as much of the way ``back``."""
    states = _smooth(lab, element, bulk, growing=growing, back=back)
    off = np.linalg.norm(states[-1].points - states[0].points, axis=1)
    return Finding(float(off.max()), note=_note(states))


def _glued(lab: Lab, element: str, count: int, height: float, **settings: float) -> Solved:
    """The states of a cube of ``count`` cells a side between plates that it sticks to, down to a ``height``."""
    mesh = shapes.box((count,) * 3, (1.0, 1.0, 1.0), ELEMENTS[element][0])
    prescribed = (
        Prescribed("bottom", "z0", (0, 1, 2), Rest()),
        Prescribed("top", "z1", (0, 1, 2), Affine(_NOT_MOVING, (0.0, 0.0, height - 1))),
    )
    frames = tuple(np.linspace(0, 1, GLUED_STEPS + 1).tolist())
    body = Body(mesh, neo_hooke(MU, 10.0), prescribed, frames)
    return lab.solve(body, element, first_step=1.0, smallest_step=0.005, residual=RESIDUAL, **settings)


def _end_note(solved: Solved, height: float) -> str:
    last = solved.states[-1]
    return (
        f"{solved.outcome.status}: {solved.outcome.message}. Last state kept at {1 - (1 - height) * last.frame:.3f} of the height: "
        f"det F at least {last.scalars['min_det_F_quadrature']:.3f} at quadrature points, "
        f"{last.scalars['min_det_F_vertices']:.3f} at vertices, V/V0 {last.scalars['volume_ratio']:.5f}"
    )


def inverts(lab: Lab, element: str, count: int, height: float) -> Finding:
    """1 where the squeeze ends as inverted in a state that Newton's method accepts, else 0."""
    solved = _glued(lab, element, count, height)
    outcome = solved.outcome
    found = outcome.status == "inverted" and "Newton's method converged" in outcome.message
    return Finding(float(found), note=_end_note(solved, height))


def stays_upright(lab: Lab, element: str, count: int, height: float, **settings: float) -> Finding:
    """1 where the squeeze ends with det F above zero at every point looked at, else 0."""
    solved = _glued(lab, element, count, height, **settings)
    scalars = solved.states[-1].scalars
    smallest = min(scalars["min_det_F_quadrature"], scalars["min_det_F_vertices"])
    return Finding(float(solved.outcome.status == "converged" and smallest > 0), note=_end_note(solved, height))


def _force_truth(bulk: float) -> float:
    return float(find("loads").squeeze_force(MU, bulk, HEIGHT, 1.0))


def _volume_truth(bulk: float) -> float:
    return float(find("loads").squeezed_volume(MU, bulk, HEIGHT))


def _one() -> float:
    return 1.0


_SOURCE = "validation/loads.py: one scalar equation for the volume, from the energy by hand (Holzapfel 2000, ch. 6.4)"
_EXACT = "the state is homogeneous, so that every element has it: Newton's residual of 1e-11 N and rounding remain"


def _force_entry(name: str, element: str, bulk: float) -> Entry:
    return Entry(
        name=name,
        group="squeeze",
        title=f"Force of smooth plates that squeeze a block to a tenth of its height, K/mu = {bulk / MU:.0e}, {element}",
        unit="N",
        truth=partial(_force_truth, bulk),
        within=1e-10,
        relative=True,
        because=_EXACT,
        kind="closed form",
        source=_SOURCE,
        measure=partial(force, element=element, bulk=bulk),
        negative_control="bulk modulus 1 % too small",
        with_negative_control=partial(force, element=element, bulk=bulk, error=-0.01),
    )


def _volume_entry(name: str, element: str, bulk: float) -> Entry:
    return Entry(
        name=name,
        group="squeeze",
        title=f"Volume of that block over its volume at rest, K/mu = {bulk / MU:.0e}, {element}",
        unit="1",
        truth=partial(_volume_truth, bulk),
        within=1e-10,
        relative=False,
        because=_EXACT,
        kind="closed form",
        source=_SOURCE,
        measure=partial(volume, element=element, bulk=bulk),
        negative_control="bulk modulus 1 % too small",
        with_negative_control=partial(volume, element=element, bulk=bulk, error=-0.01),
    )


def _return_entry(name: str, element: str, bulk: float, *, growing: bool = False) -> Entry:
    return Entry(
        name=name,
        group="squeeze",
        title=f"How far that block is from its rest state when the plates are back, K/mu = {bulk / MU:.0e}, {element}"
        + (", in load steps that may grow" if growing else ""),
        unit="mm",
        truth=zero,
        within=1e-10,
        relative=False,
        because=f"{_EXACT}; of an elastic body nothing remembers the squeeze",
        kind="property",
        source="a hyperelastic body that nothing loads or moves is at rest",
        measure=partial(distance_from_rest, element=element, bulk=bulk, growing=growing),
        negative_control="the plates stop a thousandth of their way before they are back",
        with_negative_control=partial(distance_from_rest, element=element, bulk=bulk, growing=growing, back=0.999),
    )


ENTRIES = (
    _force_entry("squeeze_force_k1e3", "P2/P1", 10.0),
    _force_entry("squeeze_force_k1e6", "Q2/Q1", 1e4),
    _volume_entry("squeeze_volume_k1e3", "Q2/Q1", 10.0),
    _return_entry("squeeze_return_k1e3", "Q2/Q1", 10.0),
    _return_entry("squeeze_return_k1e6", "P2/P1", 1e4),
    _return_entry("squeeze_return_large_steps", "Q2/Q1", 10.0, growing=True),
    Entry(
        name="bonded_squeeze_is_inverted",
        group="squeeze",
        title="Squeezed to 0.4 of its height between plates that it sticks to, Q1/P0 folds over at its corners, as reported",
        unit="1",
        truth=_one,
        within=0.1,
        relative=False,
        because="it is yes (1) or no (0), and nothing between",
        kind="property",
        source="det F above zero everywhere, or material would go through itself; Newton's method does not see it at a vertex",
        measure=partial(inverts, element="Q1/P0", count=4, height=GLUED_TO),
        negative_control="squeezed to 0.7 of its height only",
        with_negative_control=partial(inverts, element="Q1/P0", count=4, height=0.7),
    ),
    Entry(
        name="bonded_squeeze_stays_upright",
        group="squeeze",
        title="Squeezed to 0.7 of its height between plates that it sticks to, Q2/Q1 keeps det F above zero everywhere",
        unit="1",
        truth=_one,
        within=0.1,
        relative=False,
        because="it is yes (1) or no (0), and nothing between",
        kind="property",
        source="det F above zero everywhere, or material would go through itself",
        measure=partial(stays_upright, element="Q2/Q1", count=2, height=0.7),
        negative_control="squeezed to 0.4 of its height",
        with_negative_control=partial(stays_upright, element="Q2/Q1", count=2, height=GLUED_TO),
    ),
    Entry(
        name="bonded_squeeze_with_vertices",
        group="squeeze",
        title="Squeezed to 0.4 of its height between plates that it sticks to, P2/P1 keeps det F above zero everywhere",
        unit="1",
        truth=_one,
        within=0.1,
        relative=False,
        because="it is yes (1) or no (0), and nothing between",
        kind="property",
        source="det F above zero everywhere, or material would go through itself",
        measure=partial(stays_upright, element="P2/P1", count=2, height=GLUED_TO),
        negative_control="a rule of quadrature of degree 4, which has no points at the vertices",
        with_negative_control=partial(stays_upright, element="P2/P1", count=2, height=GLUED_TO, quadrature_degree=4),
    ),
)
