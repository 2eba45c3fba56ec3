"""Bodies that anybody may ask for, damaged at random, and a second look at what is said to be converged."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import strategies as st
from odd import INF, NAN, altered, odd, often, rarely

import fem_reference as fr
from fem_reference.assessment.run_checks import of_body
from fem_reference.problems.body import ByCell
from fem_reference.problems.paths import Affine, Along, Rest, Turn
from fem_reference.runs.store import Run

STILL = ((0.0, 0.0, 0.0),) * 3
# Functions of points and frame numbers, good and bad.
PATHS: list[Any] = [
    Rest(),
    Affine(STILL, (0.0, 0.0, 0.1)),
    Turn((0, 0, 1), 7.0, (0.5, 0.5, 0.0)),
    Turn((0, 0, 1), 1e30),
]
PATHS += [
    lambda points, frame: points * (NAN if frame > 0.3 else 0),
    lambda points, frame: 0 * points + (0, 0, frame * 0.1),
    lambda points, frame: 0 * points + (0, 0, 0.1 * np.sin(9 * frame)),
    lambda points, frame: 0 * points + (0, 0, 0.5 if frame > 0.7 else 0),
    lambda points, frame: 0 * points + (0, 0, 1e300 * frame),
    lambda points, frame: 0 * points + (0, 0, INF * frame),
    lambda points, frame: Turn((0, 0, 1), 40.0, (0.5, 0.5, 0.0))(points, frame),
    lambda points, frame: 0 * points - (0, 0, 1.5 * frame),
    lambda points, _: points[:, :2],
    lambda points, _: points[:1],
    lambda *_: 0.0,
    lambda *_: "no",
    lambda *_: None,
    lambda points: points,
    lambda points, frame: 1 // 0,  # noqa: ARG005
    Affine(((1.0, 0.0),)),
]
GOOD = [*PATHS[:3], *PATHS[5:7], PATHS[10]]
FRAMES: list[Any] = [
    (0.0, 1.0),
    (0, 1, 2),
    [0.0, 0.5],
    (3.0,),
    (0, 2, 1),
    (2, 1, 0),
    (0, NAN, 1),
    (0, INF),
    (),
    (0, 0),
    (-1, 1e-9),
]
FRAMES += [
    np.array([0.0, 1.0]),
    np.array([[0.0, 1.0]]),
    (0, 1e8),
    (0, 1e30),
    "01",
    ("0", "1"),
    (0, True),
    range(3),
    {0, 1},
    None,
]
LAWS = [
    lambda: (fr.make_effect("neo_hooke", mu=0.01),),
    lambda: (fr.make_effect("neo_hooke", mu=0.01), fr.make_effect("incompressible", bulk=1.0)),
    lambda: (*LAWS[0](), pulling(((0, 0.0), (1, 1.0)))),
    lambda: (*LAWS[0](), pulling(((0, 0.0), (0.5, 1.0), (1, 0.0)))),
    lambda: (),
    lambda: [LAWS[0]()[0], "neo_hooke"],
    lambda: LAWS[0]() * 2,
]
SETTINGS: dict[str, list[Any]] = {
    "element": ["P1", "P1", "Q1", "Q1", "Q1/P0", "P2/P1", "P9"],
    "first_step": [1.0, 0.1, 100.0],
    "residual": [1e-8, 1e-300, 1e300],
    "newton_iterations": [14, 1, 2**40],
    "smallest_step": [0.02, 10.0],
    "largest_step": [None, 0.3],
    "quadrature_degree": [None, 2, 10**6],
    "store_state": [True, False],
    "follow": ["stable", "equilibrium"],
    "reuse": [True, False],
    "nonsense": [3],
}


def pulling(ramp: tuple[tuple[float, float], ...]) -> Any:
    """Fibres that pull."""
    knots = [{"frame": frame, "amount": amount} for frame, amount in ramp]
    return fr.make_effect("fibre_active", stress=0.001, optimal_stretch=1.0, ramp=knots)


@st.composite
def bodies(draw: Any) -> Any:
    """A body of one cell or six, or something like it."""
    kind = draw(st.sampled_from(["tetrahedron", "hexahedron"]))
    mesh = fr.box((1, 1, 1), (1.0, 1.0, 1.0), kind)
    if rarely(draw, 8):
        arrays = {name: draw(altered(getattr(mesh, name))) for name in ("points", "cells")}
        regions = draw(often([mesh.facets]))
        mesh = fr.Cells(arrays["points"], arrays["cells"], draw(often([kind])), draw(often([1])), regions)
    ends = (draw(prescribed("foot", "z0")), draw(prescribed("head", "z1")), draw(prescribed("side", "x0")))
    count = draw(st.sampled_from([0, 1, 2, 2, 2, 2, 2, 2, 2, 2, 2, 3]))
    fibre = [
        None,
        Along((0.0, 0.0, 1.0)),
        Along((0.0, 0.0, 2.0)),
        ByCell(np.eye(3)),
        ByCell(np.eye(3)[[2] * 6]),
        Along((NAN, 0, 0)),
    ]
    frames = draw(often(FRAMES)) if rarely(draw, 5) else draw(st.sampled_from(FRAMES[:3]))
    given = (mesh, draw(st.sampled_from(LAWS[:4] * 5 + LAWS))(), ends[:count], frames)
    rest = {name: draw(odd) for name in ("contact", "interval", "start") if rarely(draw, 40)}
    return draw(often([fr.Body(*given, fibre=draw(often(fibre)), **rest)], 60))


@st.composite
def prescribed(draw: Any, name: str, on: str) -> Any:
    """What is prescribed on a face, or something like it."""
    along = draw(often([(2,), (0, 1), (3,), (-1,), (), [2], (2, 2)])) if rarely(draw, 5) else (0, 1, 2)
    usual = PATHS if rarely(draw, 4) else GOOD
    entry = fr.Prescribed(name, on, along, draw(often([PATHS[0]] if name == "foot" else usual)))
    change = draw(st.integers(0, 39))
    if change == 0:
        return draw(odd)
    if change < 4:
        return replace(entry, **{["name", "on", "stiffness"][change - 1]: draw(odd)})
    return replace(entry, stiffness=0.1) if change == 4 else entry


@st.composite
def solving(draw: Any) -> Callable[[], Any]:
    """Bodies that are solved."""
    body, names = draw(bodies()), draw(st.lists(st.sampled_from(list(SETTINGS)), max_size=2))
    fitting = ("P1", "P1/P1")
    with suppress(AttributeError, TypeError):
        fitting = ("Q1", "Q1/P0") if str(body.mesh.kind) == "hexahedron" else ("P1", "P1/P1")
        fitting = fitting[::-1] if any(one.unknowns for one in body.effects) else fitting
    settings = {"element": fitting[0], "time_limit": "60 s"} | {name: draw(often(SETTINGS[name])) for name in names}
    progress = draw(often([None]))
    return lambda: denied(body, fr.solve_body(body, progress=progress, **settings))


def denied(body: fr.Body, solved: Run) -> None:
    """AssertionError where what is said to be converged is not: by the second check, which bodies pass through on their way here,
    and beyond it by det F and by finite numbers.
    """
    numbers = [state.number for state in solved.states]
    assert solved.outcome.message
    assert numbers == list(body.frames)[: len(numbers)], numbers
    assert solved.outcome.status != "denied", solved.outcome.message
    if solved.outcome.status != "converged":
        return
    lost = [str(one) for one in of_body(body, solved) if not one.met]
    assert not lost, lost
    for state in solved.states:
        assert all(np.isfinite(value) for name, value in state.scalars.items()), state.scalars
        assert all(np.isfinite(force).all() for force in (*state.forces.values(), *state.moments.values()))
        assert state.scalars["min_det_F_vertices"] > 0
