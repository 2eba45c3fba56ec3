"""A block whose bulk modulus is low, squeezed between smooth plates until no state near its rest volume is left.

An isochoric neo-Hookean energy pulls at the volume, which the law ``K/2 (J - 1)^2`` cannot keep: its pressure is K at most. Free at
its sides the block is in balance where ``mu/3 (J/stretch - stretch^2) = K J^(5/3) (1 - J)``. But for ``stretch^2`` that is
``mu/(3 stretch) = K J^(2/3) (1 - J)``, whose right side is 0.326 K at most, at J = 2/5: below a stretch of some mu/K the only state
left is one near ``J = stretch^3``, a block that has shrunk alike along all axes, without shear and without force on the plate.
"""

from functools import partial

from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.runs.store import Run
from fem_reference.verification.parts import NO_GRADIENT, SYMMETRY, YES, frames, neo_hooke
from fem_reference.verification.truths import find

MU = 0.01  # [MPa]
POISSON = 0.3
DOWN_TO = 0.1  # of the height: there the only state in balance has a thousandth of the volume at rest
# On the branch of states near rest, which falls steeply here: from 0.59 of the volume to 0.42.
STRETCHES = (1.0, 0.8, 0.6, 0.5, 0.45, 0.43, 0.425, 0.42, 0.415, 0.41, 0.405, 0.4)
LOWEST = 0.5  # V/V0 of the range of the law


def bulk_modulus(poisson: float) -> float:
    """The bulk modulus [MPa] of a material of the shear modulus ``MU`` [MPa]."""
    return 2 * MU * (1 + poisson) / (3 * (1 - 2 * poisson))


def squeezed(lab: Lab, element: str, poisson: float, stretches: tuple[float, ...]) -> Run:
    """The states of an eighth of a cube, free at its sides, at ``stretches`` of its height, the first of which is 1."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    plate = Prescribed("plate", "z1", (2,), Affine(NO_GRADIENT, (0.0, 0.0, -1.0)))
    acting = neo_hooke(MU, bulk_modulus(poisson), element)
    body = Body(mesh, acting, (*SYMMETRY, plate), tuple(1 - stretch for stretch in stretches))
    return lab.solve(body, element, first_step=0.1, smallest_step=1e-3, residual=1e-11)


def collapses(lab: Lab, element: str, poisson: float) -> Finding:
    """1 where the squeeze does not come through, keeps no state below a fifth of its volume, and names the law that was
    outside its range; else 0. Newton's method finds a collapsed state or, on the steep branch towards it, which folds back, none.
    """
    solved = squeezed(lab, element, poisson, tuple(1 - frame for frame in frames(1 - DOWN_TO, 6)))
    least = min(state.scalars["min_cell_volume_ratio"] for state in solved.states)
    ended = solved.outcome.status in ("collapsed", "diverged", "limit point")
    message = solved.outcome.message
    found = ended and least >= 0.2 and "incompressible is outside the range" in message
    return Finding(float(found), note=f"{solved.outcome.status}: {message}")


def outside(lab: Lab, element: str, poisson: float) -> Finding:
    """The number of states in which a law is outside its range."""
    solved = squeezed(lab, element, poisson, STRETCHES)
    found = sum(state.scalars["outside_law"] > 0 for state in (*solved.states[:-1], solved.last))
    return Finding(float(found), note=solved.outcome.message)


def known_outside() -> int:
    """The number of states with less than the ``LOWEST`` volume."""
    volume = partial(find("loads").squeezed_volume, MU, bulk_modulus(POISSON))
    return sum(volume(stretch) < LOWEST for stretch in STRETCHES)


ENTRIES = (
    YES(
        name="collapse_is_no_result",
        group="collapse",
        title="Squeezed to a tenth of its height, a block of the Poisson ratio 0.3 is no result, and its law is named, by P2/P1",
        measure=collapses,
        given={"element": "P2/P1", "poisson": POISSON},
        negative_control="a Poisson ratio of 0.499, with which 0.993 of the volume are kept",
        wrong={"poisson": 0.499},
        source="validation/loads.py: the only state in balance has a thousandth of the volume, which no flesh has",
    ),
    Entry(
        name="law_outside_its_range",
        group="collapse",
        title="In how many states of a squeeze, from 1 to 0.4 of the height, less than half of the volume is left, by Q1/P0",
        unit="1",
        measure=outside,
        given={"element": "Q1/P0", "poisson": POISSON},
        negative_control="a Poisson ratio of 0.32",
        wrong={"poisson": 0.32},  # with which the volume stays above a half
        truth=known_outside,
        within=0.1,
        because="it is a number of states, each of them homogeneous, so that every element has it",
        kind="closed form",
        source="validation/loads.py: one scalar equation for the volume, from the energy by hand (Holzapfel 2000, ch. 6.4)",
    ),
)
