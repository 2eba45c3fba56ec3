"""Viscosity of the matrix: a block that smooth plates squeeze in time, and one that creeps back."""

from functools import partial

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.verification.homogeneous import MU
from fem_reference.verification.parts import NO_GRADIENT, SYMMETRY, UP_AND_GONE, frames, neo_hooke, relaxation_rate
from fem_reference.verification.truths import find

viscosity = find("viscosity")
ETA, SECONDS = 0.02, 1.5  # MPa s; s from a frame number to the next
BULK = 1e6 * MU  # so high that the truth of incompressible material is met to 1e-6
STRESS = 3e-4 * MU  # a small weight on the top of a block until frame 1, which then creeps back
FROM, TO = 2, 3  # frames between which the rate is measured


def force(lab: Lab, n: int, eta: float) -> float:
    """The force [N] of a smooth plate that has come down to half the height in one frame, in n load steps."""
    plate = Prescribed("plate", "z1", (2,), Affine(NO_GRADIENT, (0.0, 0.0, -0.5)))
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    acting = (*neo_hooke(MU, BULK), make("viscosity", eta=eta))
    body = Body(mesh, acting, (*SYMMETRY, plate), frames(1, n), interval=SECONDS)
    return float(lab.solve(body, "P2/P1", first_step=1 / n).last.forces["plate"][2])


def creep_rate(lab: Lab, n: int, eta: float) -> float:
    """The rate [1/s] at which the block creeps back when its weight is gone, in n load steps a frame."""
    mesh = shapes.box((1, 1, 1), (1.0, 2.0, 3.0), "tetrahedron")
    gone = make("traction", on="z1", force=f"0, 0, {-STRESS} MPa", ramp=UP_AND_GONE)
    acting = (*neo_hooke(MU, BULK), gone, make("viscosity", eta=eta))
    body = Body(mesh, acting, SYMMETRY, frames(TO, TO * n), interval=SECONDS)
    solved = lab.solve(body, "P2/P1", first_step=1 / n, residual=1e-14)
    return relaxation_rate(solved, (FROM * n, TO * n), (TO - FROM) * SECONDS)


VISCOUS = partial(
    Entry,
    group="viscosity",
    given={"eta": ETA},
    negative_control="A viscosity 1 % too small.",
    wrong={"eta": 0.99 * ETA},
    within=7e-4,
    relative=True,
    kind="closed form",
)
HALVED = partial(Refinement, size=SECONDS, order=1, extrapolated=True)
EULER = "by implicit Euler, whose sizes are seconds of a load step; the value is extrapolated from the last two"

ENTRIES: tuple[Entry, ...] = (
    VISCOUS(
        name="viscous_squeeze",
        title="Viscous block that smooth plates squeeze to half its height: their force, by load steps that are halved",
        unit="N",
        measure=force,
        truth=lambda: viscosity.squeeze_force(MU, ETA, 0.5, -0.5 / SECONDS, 1.0),
        because="The last load step shortens the block by x of its height then, 1/64 in the longer steps. By hand the potential "
        "errs by -2 x + 16/3 x^2 of the viscous part, 0.7 of the force; without the first order 0.7 * 8/3 x^2 = 4.6e-4 is left.",
        source="validation/viscosity.py, squeeze_force",
        refinement=HALVED((32, 64, 128), note=f"force {EULER}"),
    ),
    VISCOUS(
        name="viscous_creep",
        title="Viscous block that creeps back when its weight is gone: rate, by load steps that are halved",
        unit="1/s",
        measure=creep_rate,
        truth=lambda: viscosity.creep_rate(MU, ETA),
        because="Of x = rate times the longer load step = 0.047 implicit Euler without its first order leaves x^2 / 6 = 3.7e-4; "
        "1e-4 is how far the strain is from a small one.",
        source="validation/viscosity.py, creep_rate",
        refinement=HALVED((8, 16, 32), note=f"rate {EULER}"),
    ),
)
