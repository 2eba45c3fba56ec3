"""The recorded forces on bodies balance; altered ones deny a run, and what is not fully known denies nothing."""

from dataclasses import replace

import numpy as np
import pytest

import fem_reference as fr
from fem_reference.assessment import second_check
from fem_reference.assessment.body_balance import balance
from fem_reference.effects import Effect, make
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Affine, Rest
from fem_reference.runs.store import Frame, Outcome, Run, collected
from fem_reference.solvers import fenicsx

RAMP = ({"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0})
DEAD = make("traction", on="z1", force="0, 1 kPa, 2 kPa", ramp=RAMP)
WEIGHT = make("gravity", density="1000 kg/m3", acceleration="0, 0, -10 m/s^2", ramp=RAMP)
FOLLOWER = make("pressure", on="z1", pressure="1 kPa", ramp=RAMP)
LAW = make("neo_hooke", mu="20 kPa")
FOOT = Prescribed("foot", "z0", (0, 1, 2), Rest())
LIFTED = Affine(((0.0, 0.0, 0.0),) * 3, (0.02, 0.0, 0.1))
HEAD = Prescribed("head", "z1", (0, 2), LIFTED)
ALLOWED = 10 * 1e-8 * 10  # ten times a residual of 1e-8 N of 100 unknowns [N]


def cube(*effects: Effect, prescribed: tuple[Prescribed, ...] = (FOOT,)) -> Body:
    return Body(shapes.box((2, 2, 2), (2.0, 3.0, 4.0), "tetrahedron"), effects, prescribed, (0.0, 1.0))


def recorded(body: Body, **forces: tuple[float, float, float]) -> Run:
    """A run with ``forces`` [N] in the last frame, all of them at the origin."""
    none = {name: np.zeros(3) for name in forces}
    last = {name: np.array(force) for name, force in forces.items()}
    frames = [
        Frame(number, points=body.mesh.points, forces=one, moments=none)
        for number, one in zip((0.0, 1.0), (none, last), strict=True)
    ]
    outcome = Outcome("converged", "", {"unknowns": 100.0})
    return replace(collected(frames, outcome), settings=fenicsx.BodySettings(element="P1", residual=1e-8))


def lost(body: Body, run: Run) -> list[tuple[str, float]]:
    return [(one.name, one.frame) for one in balance(body, run) if not one.met]


def test_dead_loads_are_what_the_constraints_carry() -> None:
    """2 x 3 mm2 under (0, 1, 2) kPa are (0, 6, 12) mN; 24 mm3 of 1e-9 t/mm3 at 1e4 mm/s2 weigh 0.24 mN."""
    body, wrong = cube(LAW, DEAD, WEIGHT), [("residual force", 1.0)]
    assert len(list(balance(body, recorded(body, foot=(0, 0, 0))))) == 1  # at rest nothing is solved
    carried = np.array([0.0, -0.006, -0.012 + 0.00024])
    assert lost(body, recorded(body, foot=carried)) == []
    for axis in np.eye(3):
        assert lost(body, recorded(body, foot=carried + 0.9 * ALLOWED * axis)) == []
        assert lost(body, recorded(body, foot=carried + 1.1 * ALLOWED * axis)) == wrong
    assert lost(body, recorded(body, foot=(np.nan, 0, 0))) == wrong
    # Twice the load, the root of 6^2 + 11.76^2 = 13.20 mN.
    denied = second_check.confirmed_body(body, replace(recorded(body, foot=-carried), body=body))
    assert denied.outcome.message.startswith("denied by the second check: residual force: 0.0264 N in frame 1")


def test_mirrored_cells_weigh_as_others() -> None:
    body = cube(LAW, WEIGHT)
    cells = body.mesh.cells.copy()
    cells[::3] = cells[::3][:, [1, 0, 2, 3]]
    body = replace(body, mesh=replace(body.mesh, cells=cells))
    assert lost(body, recorded(body, foot=(0, 0, 0.00024))) == []
    assert lost(body, recorded(body, foot=(0, 0, 0.00008))) == [("residual force", 1.0)]  # their signed sum, a third


def test_moments_balance_where_no_load_acts() -> None:
    body = cube(LAW, prescribed=(FOOT, HEAD))
    run = recorded(body, foot=(1.0, 0, 0), head=(-1.0, 0, 0))
    assert lost(body, run) == []
    turned = replace(run.states[1], moments=run.states[1].moments | {"head": np.array([0, 5 * ALLOWED, 0])})
    assert lost(body, replace(run, states=(run.states[0], turned))) == [("residual moment", 1.0)]


def test_what_is_not_fully_known_is_not_judged() -> None:
    side = Prescribed("side", "x0", (0,), Rest())
    for body in (
        cube(LAW, FOLLOWER),
        cube(LAW, make("inertia", density="1000 kg/m3")),
        cube(LAW, WEIGHT.model_copy(update={"region": "half"})),
        cube(LAW, prescribed=(FOOT, side)),
        cube(LAW, prescribed=(FOOT, HEAD)),  # whose force is missing
        replace(cube(LAW), start=np.array),
        replace(cube(LAW, DEAD), mesh=shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "hexahedron")),
    ):
        more = {"side": (0.0, 0.0, 0.0)} if side in body.prescribed else {}
        assert list(balance(body, recorded(body, foot=(1.0, 0, 0), **more))) == []
    known = cube(LAW)
    assert list(balance(known, replace(recorded(known, foot=(1.0, 0, 0)), settings=None))) == []


def kinds() -> dict[str, tuple[Body, str]]:
    """Bodies and their elements: of each kind of condition and load."""
    volume, mixed = make("incompressible_penalty", bulk="0.2 MPa"), make("incompressible", bulk="2 MPa")
    ball = ContactBone(
        "ball", Sphere((1.0, 1.5, 4.9), 1.0), lambda frame: np.eye(4) - 0.2 * frame * np.eye(4, k=1)[[3, 3, 2, 3]]
    )
    planes = tuple(Prescribed(name, name, (axis,), Rest()) for axis, name in enumerate(("x0", "y0", "z0")))
    springs = replace(HEAD, components=(0, 1, 2), stiffness=0.1)
    return {
        "dead loads": (cube(LAW, volume, DEAD, WEIGHT), "P2"),
        "planes of symmetry": (cube(LAW, mixed, prescribed=(*planes, replace(HEAD, components=(2,)))), "P2/P1"),
        "components": (cube(LAW, volume, prescribed=(FOOT, HEAD)), "P1"),
        "springs": (cube(LAW, mixed, prescribed=(FOOT, springs)), "P2/P1"),
        "contact": (replace(cube(LAW, volume), contact=ContactLaw("z1", 0.1, 0.05, friction=0.3), bones=(ball,)), "P2"),
        "pressure": (cube(LAW, volume, FOLLOWER), "P2"),
    }


@pytest.mark.parametrize("kind", kinds())
def test_ordinary_bodies_balance_ten_times_better_than_asked(kind) -> None:
    body, element = kinds()[kind]
    run = fr.solve_body(body, element=element, first_step=0.5)
    checks = list(balance(body, run))
    assert run.outcome.status == "converged", run.outcome.message
    assert len(checks) == {"dead loads": 1, "pressure": 0}.get(kind, 2)
    assert all(one.share <= 0.1 for one in checks), [str(one) for one in checks]
    if checks:
        assert float(np.abs(list(run.last.forces.values())).max()) > 1000 * checks[0].allowed
