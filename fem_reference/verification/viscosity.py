"""Viscosity of the matrix: a block that smooth plates squeeze in time, and one that creeps back."""

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab, order
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.verification import truths
from fem_reference.verification.homogeneous import MU, NEO
from fem_reference.verification.parts import SYMMETRY, resistance

GROUP = "viscosity"
_ETA, _SECONDS = 0.02, 1.5  # MPa s; s from a frame number to the next
_BULK = 1e6 * MU  # so high that the truth of incompressible material is met to 1e-6
_STEPS = (1 / 32, 1 / 64, 1 / 128)
_SOURCE = "validation/viscosity.py"


def viscosity(eta: float) -> Effect:
    """Of the matrix [MPa s]."""
    return make("viscosity", eta=f"{eta} MPa s")


def _squeezed(lab: Lab, step: float, eta: float) -> float:
    """The force [N] of a smooth plate that has come down to half the height in one frame, in load steps of ``step`` frames."""
    nowhere = ((0.0, 0.0, 0.0),) * 3
    plate = Prescribed("plate", "z1", (2,), Affine(nowhere, (0.0, 0.0, -0.5)))
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    frames = tuple(np.linspace(0, 1, round(1 / step) + 1).tolist())
    acting = (*NEO.effects, resistance("P2/P1", _BULK), viscosity(eta))
    solved = lab.solve(Body(mesh, acting, (*SYMMETRY, plate), frames, interval=_SECONDS), "P2/P1", first_step=step)
    return float(solved.last.forces["plate"][2])


def _known_force() -> float:
    return float(truths.find("viscosity").squeeze_force(MU, _ETA, 0.5, -0.5 / _SECONDS, 1.0))


def _force(lab: Lab, eta: float = _ETA) -> Finding:
    """By load steps that are halved, and without their error of first order."""
    ladder = tuple((step * _SECONDS, _squeezed(lab, step, eta)) for step in _STEPS)
    note = (
        "force by implicit Euler, whose sizes are seconds of a load step; the value is extrapolated from the last two"
    )
    return Finding(2 * ladder[2][1] - ladder[1][1], order(ladder, _known_force()), ladder, note)


_SQUEEZE = Entry(
    name="viscous_squeeze",
    group=GROUP,
    title="Viscous block that smooth plates squeeze to half its height: their force, by load steps that are halved",
    unit="N",
    truth=_known_force,
    within=7e-4,
    relative=True,
    because="The last load step shortens the block by x of its height then, 1/64 in the longer steps. By hand the potential errs "
    "by -2 x + 16/3 x^2 of the viscous part, 0.7 of the force; without the first order 0.7 * 8/3 x^2 = 4.6e-4 is left.",
    kind="closed form",
    source=f"{_SOURCE}, squeeze_force",
    measure=_force,
    negative_control="A viscosity 1 % too small.",
    with_negative_control=lambda lab: _force(lab, 0.99 * _ETA),
)

# A block under a small weight on its top until frame 1, which then creeps back.
_STRESS, _FROM, _TO = 3e-4 * MU, 2.0, 3.0
_GONE = [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": 1.0}, {"frame": 2.0, "amount": 0.0}]


def _decay(lab: Lab, step: float, eta: float) -> float:
    """The rate [1/s] at which the block creeps back from frame ``_FROM`` to ``_TO``, in load steps of ``step`` frames."""
    mesh = shapes.box((1, 1, 1), (1.0, 2.0, 3.0), "tetrahedron")
    weight = make("traction", on="z1", force=f"0, 0, {-_STRESS} MPa", ramp=_GONE)
    frames = tuple(np.linspace(0, _TO, round(_TO / step) + 1).tolist())
    acting = (*NEO.effects, resistance("P2/P1", _BULK), weight, viscosity(eta))
    body = Body(mesh, acting, SYMMETRY, frames, interval=_SECONDS)
    solved = lab.solve(body, "P2/P1", first_step=step, residual=1e-14)
    ends = [state.points[:, 2].max() - 3.0 for state in (solved.states[round(_FROM / step)], solved.last)]
    return float(np.log(ends[0] / ends[1])) / ((_TO - _FROM) * _SECONDS)


def _known_rate() -> float:
    return float(truths.find("viscosity").creep_rate(MU, _ETA))


def _creep(lab: Lab, eta: float = _ETA) -> Finding:
    """By load steps that are halved, and without their error of first order."""
    ladder = tuple((step * _SECONDS, _decay(lab, step, eta)) for step in (1 / 8, 1 / 16, 1 / 32))
    note = "rate by implicit Euler, whose sizes are seconds of a load step; the value is extrapolated from the last two"
    return Finding(2 * ladder[2][1] - ladder[1][1], order(ladder, _known_rate()), ladder, note)


_CREEP = Entry(
    name="viscous_creep",
    group=GROUP,
    title="Viscous block that creeps back when its weight is gone: rate, by load steps that are halved",
    unit="1/s",
    truth=_known_rate,
    within=7e-4,
    relative=True,
    because="Of x = rate times the longer load step = 0.047 implicit Euler without its first order leaves x^2 / 6 = 3.7e-4; 1e-4 "
    "is how far the strain is from a small one.",
    kind="closed form",
    source=f"{_SOURCE}, creep_rate",
    measure=_creep,
    negative_control="A viscosity 1 % too small.",
    with_negative_control=lambda lab: _creep(lab, 0.99 * _ETA),
)

ENTRIES = (_SQUEEZE, _CREEP)
