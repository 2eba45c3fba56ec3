"""Calls from Python that anybody may make, damaged at random: what is called, with what, and a second look at results."""

import math
import tomllib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import hostile
import numpy as np
import small
from hypothesis import strategies as st

import fem_reference as fr
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.body import ByCell
from fem_reference.problems.paths import Affine, Along, Rest, Turn
from fem_reference.report import gallery
from fem_reference.runs.store import Run

NAN, INF = math.nan, math.inf
STILL = ((0.0, 0.0, 0.0),) * 3
ARRAYS = [
    np.zeros(0),
    np.zeros((0, 3)),
    np.full((2, 3), NAN),
    np.arange(6).reshape(2, 3),
    np.array("x"),
    np.array(None),
]
ARRAYS += [np.ones((8, 3), bool), np.ones((8, 3)) * 1e300, np.zeros((8, 3), complex), np.array([[0, 1, 2, -1]])]
ODD: list[Any] = [
    *hostile.NASTY,
    *ARRAYS,
    b"x",
    object(),
    Path("x"),
    lambda: 0,
    lambda *_: NAN,
    print,
    int,
    1j,
    np.float64(NAN),
]
ODD += [
    {},
    {"a": 1},
    {1: 2},
    (),
    (NAN,),
    (1, 0),
    ("x",),
    {1, 2},
    range(3),
    np.int64(2),
    np.bool_(True),
    fr.InputError,
    fr,
]
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


odd = st.sampled_from(ODD)


def rarely(draw: Any, times: int) -> bool:
    """Once in so many ``times``."""
    return bool(draw(st.integers(1, times)) == times)


@st.composite
def often(draw: Any, usual: list[Any], times: int = 32) -> Any:
    """One of what is usual, or once in so many ``times`` what nobody means."""
    return draw(odd) if rarely(draw, times) else draw(st.sampled_from(usual))


@st.composite
def altered(draw: Any, array: np.ndarray) -> Any:
    """An array with one number, or its shape or type, changed; or something else."""
    what = draw(st.integers(0, 11))
    if what > 4 or not array.size:
        return array
    found = np.array(array)
    place = np.unravel_index(draw(st.integers(0, found.size - 1)), found.shape)
    if what == 0:
        return draw(odd)
    if what == 1:
        return [found.T, found[:-1], found[:0], found.tolist(), found.astype(object), found.astype(complex)][
            draw(st.integers(0, 5))
        ]
    values = [-1, 0, 7, 8, 2**40] if found.dtype.kind == "i" else [NAN, INF, 1e300, 1e-300, 0.0, -3.0, 0.5]
    found[place] = draw(st.sampled_from(values))
    return found


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
    """AssertionError where what is said to be converged is not: it is finite, of the frames that were wanted, in their order, and
    where it is prescribed.
    """
    numbers = [state.number for state in solved.states]
    assert solved.outcome.message
    assert numbers == list(body.frames)[: len(numbers)], numbers
    if solved.outcome.status != "converged":
        return
    assert len(numbers) == len(body.frames)
    for state in solved.states:
        assert np.isfinite(state.points).all()
        assert all(np.isfinite(value) for name, value in state.scalars.items()), state.scalars
        assert all(np.isfinite(force).all() for force in (*state.forces.values(), *state.moments.values()))
        assert state.scalars["min_det_F_vertices"] > 0
        for entry in body.prescribed if state is not solved.states[0] else ():
            if entry.stiffness is None:
                at = np.unique(body.mesh.facets[entry.on])
                wanted = entry.path(body.mesh.points[at], state.number)
                off = (state.points - body.mesh.points)[at] - wanted
                assert np.abs(off[:, list(entry.components)]).max() < 1e-9 * (1 + np.abs(wanted).max()), entry.name


class World:
    """A small case with runs of it, and of another, made once."""

    def __init__(self, folder: Path) -> None:
        gallery.program = lambda _job, _folder: ["/nowhere/python"]  # pages are written as where nothing can draw
        self.folder, self.count = folder, 0
        self.place = small.write(folder / "bar")
        self.case = fr.load_case(self.place, {"frames.every": 10})
        self.other = fr.load_case(self.place, {"frames.every": 5})
        self.rod = fr.load_case("rod")
        self.pbd, self.far = (fr.solve(case, "pbd", store=folder / "runs") for case in (self.case, self.other))
        line = Polylines(np.array([[5.0, 5, 1], [5, 5, 39]]), np.array([0, 2]))
        self.reference = replace(self.pbd, name="reference", fibres=line, fibre_positions=np.stack([line.points] * 3))
        self.result = fr.compare(self.case, self.reference, [self.pbd])

    def new(self) -> Path:
        """A folder that is not there."""
        self.count += 1
        return self.folder / f"new {self.count}"

    @property
    def table(self) -> dict[str, Any]:
        """The keys of the case."""
        return tomllib.loads((self.place / "case.toml").read_text())


@st.composite
def making(draw: Any, world: World) -> Callable[[], Any]:
    """Parts of bodies and cases."""
    what = draw(st.sampled_from(["box", "effect", "case", "case", "load"]))
    if what == "box":
        counts, size = (tuple(draw(often(usual)) for _ in range(3)) for usual in ([1, 2], [1.0, 2, 0.5]))
        given = [
            draw(often([counts])),
            draw(often([size])),
            draw(often(["tetrahedron", "hexahedron"])),
            draw(often([1, 2])),
        ]
        return lambda: fr.box(*given)
    if what == "effect":
        names = {
            "mu": [0.01, "10 kPa", "1 mm"],
            "bulk": [1.0, "1 MPa"],
            "on": ["z1"],
            "ramp": [[{"frame": 0, "amount": 1}]],
            "x": [1],
        }
        given = {name: draw(often(names[name])) for name in draw(st.sets(st.sampled_from(list(names)), max_size=3))}
        name = draw(
            often(["neo_hooke", "incompressible", "pressure", "gravity", "contact", "diffusion", "mooney_rivlin"])
        )
        return lambda: fr.make_effect(name, **given)
    if what == "case":
        table, folder, name = (
            world.table,
            draw(often([world.place])),
            draw(often(["bar"])),
        )
        table = draw(hostile._tree(table)) if draw(st.booleans()) else table
        if rarely(draw, 4):
            table[draw(st.sampled_from(sorted(world.table)))] = draw(odd)
        whole = draw(often([table]))
        return lambda: fr.make_case(whole, folder, name)._repr_html_()
    keys = [
        "frames.last",
        "effect[0].mu",
        "bone[1].motion.axis",
        "muscle.tet_size",
        "title",
        "effect",
        "x",
        "",
        "frames.every",
    ]
    changes = (
        {draw(st.sampled_from(keys)): draw(odd)}
        if draw(st.booleans())
        else draw(often([None, {}, {"frames.every": 10}]))
    )
    place = draw(often([world.place, "hip_flexion", "rod"]))
    return lambda: fr.load_case(place, changes)


@st.composite
def working(draw: Any, world: World) -> Callable[[], Any]:
    """Calls with cases and runs."""
    case = draw(often([world.case] * 4 + [world.other, world.rod]))
    runs = [world.pbd, world.far, world.reference, replace(world.pbd, name="mine", origin={})]
    some = draw(often([[], runs[:1], runs[1:2], runs[3:], runs, (world.pbd,), [3]]))
    reference, what = draw(often([world.reference] * 5 + [*runs, None])), draw(st.integers(0, 6))
    if what == 0:
        named = {
            name: draw(odd)
            for name in draw(st.sets(st.sampled_from(["damping", "sub_iterations", "x", "folder"]), max_size=1))
        }
        solver, store = draw(often(["pbd", "xpbd", "recorded", "nothing"])), draw(often([world.folder / "runs"]))
        if solver is None and not named:
            solver = "pbd"  # the reference takes seconds
        return lambda: fr.solve(case, solver, store=store, **named)
    if what == 1:
        bars = draw(often([None]))
        return lambda: fr.compare(case, reference, some, error_bars=bars)
    if what == 2:
        wrong = draw(often([world.far, None, replace(world.pbd, origin={}), world.pbd]))
        return lambda: fr.error_bars(case, wrong, store=world.folder / "runs")
    if what == 3:
        place, unit = (
            draw(often([world.pbd.folder, world.place, world.place / "case.toml"])),
            draw(often([None, "mm", "cm", "x"])),
        )
        return lambda: fr.read_run(place, case, unit=unit)
    place = draw(odd) if rarely(draw, 5) else world.new()
    place = place if not isinstance(place, str) or "/" in place else str(world.folder / "odd" / place)
    if what == 4:
        form = draw(often(["febio", "x"]))
        return lambda: fr.export_case(case, place, form)
    result = draw(often([world.result]))
    if what == 5 or not rarely(draw, 5):  # pages take a second
        return lambda: fr.export_runs(result, place)
    return lambda: fr.write_report(result, place)


KINDS: dict[str, Callable[[World], st.SearchStrategy[Callable[[], Any]]]] = {
    "calls that make": making,
    "calls with cases and runs": working,
    "calls that solve": lambda _: solving(),
}
