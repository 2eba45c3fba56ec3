"""Calls from Python that anybody may make, damaged at random: what is called, and with what."""

import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import calls_bodies
import calls_forces
import calls_lines
import calls_muscles
import calls_paths
import damage
import numpy as np
import small
from hypothesis import strategies as st
from odd import odd, often, rarely
from undrawn import undraw

import fem_reference as fr
from fem_reference.foundations.mesh import Polylines


class World:
    """A small case with runs of it, and of another, made once."""

    def __init__(self, folder: Path) -> None:
        undraw()
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
        table = draw(damage.tree_of(table)) if draw(st.booleans()) else table
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
    "calls that solve": lambda _: calls_bodies.solving(),
    "muscles": lambda _: calls_muscles.pressing(),
    "settings of lines": lambda _: calls_lines.settings_of_lines(),
    "lines": lambda _: calls_lines.line_calls(),
    "paths": lambda _: calls_paths.path_calls(),
    "rods and gaussians": lambda _: calls_lines.bundle_calls(),
    "forces and arms": calls_forces.force_calls,
}
