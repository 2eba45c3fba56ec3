"""What bones carry of external loads: forces and moments of true runs balance, and those of wrong ones do not."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference import effects
from fem_reference.assessment.run_checks import RunCheck, of_muscle
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import attached_skin
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Run, collected
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import Settings

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("session")]

RAMP = [{"frame": 0, "amount": 0.0}, {"frame": 10, "amount": 1.0}]
FLESH = (effects.make("neo_hooke", mu="10 kPa"), effects.make("incompressible", bulk="10 MPa"))
LOADS = {
    "gravity": effects.make("gravity", density="1060 kg/m3", acceleration="3, 0, -9.81 m/s^2", ramp=RAMP),
    "traction": effects.make("traction", on="free", force="0.1, 0.2, 0.3 kPa", ramp=RAMP),
    "pressure": effects.make("pressure", on="free", pressure="2 kPa", ramp=RAMP),
    "pressure on springs": effects.make("pressure", on="bottom", pressure="1 kPa", ramp=RAMP),
    "damping": effects.make("damping", coefficient="200 Pa s/mm^2"),
}
BALANCES = {f"{kind}s that bones do not carry" for kind in ("force", "moment")}


def bar(*acting: str, springs: bool = False) -> MuscleProblem:
    """A bar whose top turns about an axis beside it, under the loads ``acting``; attached by springs at its bottom, or exactly."""
    turn = RigidMotion((1, 0.5, 0), (5, -10, 20), (0.0, 10.0), (0.0, 0.5))
    problem = shapes.bar((2, 2, 3), (10, 10, 40), {"bottom": None, "top": turn}, FLESH, (0, 5, 10))
    low, high = problem.attached
    if springs:
        low = replace(low, stiffness=0.05)
        shares = attached_shares(problem.surface, low.vertices)
        skin = attached_skin(problem.surface, shares, problem.mesh, 2.0)
        problem = replace(problem, attached=(low, high), attached_skins={"bottom": skin})
    return replace(problem, interval=0.5, effects=(*FLESH, *(LOADS[name] for name in acting)))


def solved(problem: MuscleProblem, **settings: object) -> Run:
    frames, chosen = [], Settings(ranks=1, **settings)
    outcome = fenicsx.solve(problem, chosen, frames.append)
    assert outcome.status == "converged", outcome.message
    assert all((frame.state is None) is (chosen.store_state is False) for frame in frames)
    return replace(collected(frames, outcome, problem.rest), origin={"settings": chosen.model_dump(mode="json")})


def balances(problem: MuscleProblem, run: Run) -> dict[str, RunCheck]:
    return {one.name: one for one in of_muscle(problem, run) if one.name in BALANCES}


@pytest.mark.parametrize(
    ("name", "springs"),
    [(name, springs) for name in LOADS for springs in (False, True) if springs or "springs" not in name],
)
def test_bones_carry_a_load_and_its_moment(name, springs) -> None:
    # The loads are of the order of 0.01 to 5 N and 1 to 100 N mm.
    problem = bar(name, springs=springs)
    run = solved(problem, store_state=False)
    found = balances(problem, run)
    assert set(found) == BALANCES
    assert all(one.met for one in found.values()), found
    assert max(one.allowed for one in found.values()) < 2e-3
    loads = [np.stack([run.scalars[f"load_{kind}_{axis}"] for axis in "xyz"], axis=1) for kind in ("force", "moment")]
    assert all(np.abs(load[1:]).max() > 5e-3 for load in loads)
    for kind in ("force", "moment"):  # less by a hundredth of it than it was
        for key in (f"load_{kind}_{axis}" for axis in "xyz"):
            scalars = run.scalars | {key: run.scalars[key] + [0, 0, 0.01 * np.abs(loads[0]).max()]}
            (lost,) = (one for one in balances(problem, replace(run, scalars=scalars)).values() if not one.met)
            assert (lost.name, lost.frame) == (f"{kind}s that bones do not carry", 10)


@pytest.mark.parametrize("element", ["P2/P0", "P1/P1"])
def test_loads_of_other_elements_are_carried(element) -> None:
    problem = bar("gravity", "traction", "pressure", "damping")
    found = balances(problem, solved(problem, element=element))
    assert set(found) == BALANCES
    assert all(one.met for one in found.values()), found


def test_what_the_records_do_not_say_is_not_judged() -> None:
    # Inertia needs the predicted place within a load step, which no frame has; a rule of degree 3 gives other moments of a
    # pressure.
    heavy = replace(bar(), effects=(*FLESH, effects.make("inertia", density="1060 kg/m3")))
    for problem, settings in ((heavy, {}), (bar("pressure"), {"quadrature_degree": 3})):
        run = solved(problem, **settings)
        assert not balances(problem, run)
        assert not any(name.startswith("load_") and name != "load_steps" for name in run.scalars)


def test_viscosity_is_within_the_body() -> None:
    problem = replace(bar(), effects=(*FLESH, effects.make("viscosity", eta="300 kPa s")))
    checks = {one.name: one for one in of_muscle(problem, solved(problem))}
    for kind in ("force", "moment"):
        assert checks[f"residual {kind}"].met
