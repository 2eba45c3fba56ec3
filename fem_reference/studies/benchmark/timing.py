"""A program of its own: solves one body by the finite element reference and writes what that cost, and where it ended.

It runs by its path with another commit's package before any other on ``PYTHONPATH``: from the package it imports only what every
commit has that can be compared with.
"""

import json
import resource
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.effects import make
from fem_reference.foundations import subprocesses
from fem_reference.foundations.mesh import Floats, fingerprint
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, ByCell, Cells, Prescribed
from fem_reference.problems.paths import Rest, Turn
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.studies.execution import Bench

# The fusiform body: its length and its radius in the middle [mm], and by what share it is thinner at its ends.
LENGTH, RADIUS, THINNER = 60.0, 10.0, 0.6
# Its top turns about a hinge beside its middle [mm], by this angle [rad] in so many frames: it is bent, and stretched by a sixth.
HINGE, ANGLE, FRAMES = (-25.0, 0.0, 30.0), -0.5, 6
EFFECTS: dict[str, dict[str, Any]] = {
    "neo_hooke": {"mu": "10 kPa"},
    "incompressible": {"bulk": "10 MPa"},
    "fibre_passive_febio": {"c3": "10 kPa", "c4": 12.0, "c5": "3 MPa", "linear_from": 1.3},
}

# Solves all frames or, to compile and load what that needs, the first alone, which is rest: how it ended, and the last positions
# (n, 3) [mm] of the nodes of the mesh.
Solve = Callable[[bool], tuple[Outcome, Floats]]


def fusiform(element: str, rings: int, slices: int) -> Body:
    """A muscle like a spindle along z, of ``slices`` layers of straight cells, ``rings`` of them around its core; its fibres run
    from end to end, its bottom is fixed and its top is turned.
    """
    straight = shapes.cylinder(RADIUS, LENGTH, rings, slices, ELEMENTS[element][0], 1)
    along = 2 * straight.points[:, 2:] / LENGTH - 1
    points = straight.points * np.hstack([np.repeat(1 - THINNER * along**2, 2, axis=1), np.ones_like(along)])
    mesh = replace(straight, points=points)
    knots = ((0.0, 0.0), (float(FRAMES), 1.0))
    fixed = (
        Prescribed("bottom", "bottom", (0, 1, 2), Rest()),
        Prescribed("top", "top", (0, 1, 2), Turn((0.0, 1.0, 0.0), ANGLE, HINGE, knots=knots)),
    )
    acting = tuple(make(name, **parameters) for name, parameters in EFFECTS.items())
    return Body(mesh, acting, fixed, tuple(map(float, range(FRAMES + 1))), ByCell(_fibres(mesh)))


def _fibres(mesh: Cells) -> Floats:
    """The unit vectors (m, 3) along the fibres in the cells of the spindle: lines that keep their share of its radius."""
    x, y, z = mesh.points[mesh.cells].mean(axis=1).T
    along = 2 * z / LENGTH - 1
    # How fast the logarithm of the radius grows along the axis [1/mm].
    opening = -4 * THINNER * along / LENGTH / (1 - THINNER * along**2)
    tangents = np.stack([x * opening, y * opening, np.ones_like(z)], axis=1)
    return np.asarray(tangents / np.linalg.norm(tangents, axis=1)[:, None])


def small(request: dict[str, Any]) -> tuple[str, Solve]:
    """The fusiform body of a ``request`` with ``element``, ``rings`` and ``slices``: the fingerprint of its mesh and frames,
    and its solution by one process.
    """
    body = fusiform(request["element"], request["rings"], request["slices"])
    settings = fenicsx.BodySettings(element=request["element"], first_step=1.0)

    def solve(rest: bool) -> tuple[Outcome, Floats]:
        solved = fenicsx.solve_body(replace(body, frames=body.frames[:1]) if rest else body, settings)
        return solved.outcome, solved.states[-1].points if solved.states else body.mesh.points

    return fingerprint(body.mesh.points, body.mesh.cells, np.array(body.frames)), solve


def muscle(request: dict[str, Any]) -> tuple[str, Solve]:
    """The muscle of the ``case`` of a ``request``, up to the frame ``last`` where it is given, by its reference on ``ranks``: the
    fingerprint of its mesh and frames, and its solution.
    """
    bench = Bench(casefile.read_muscle(request["case"]), Path(), request["ranks"])
    settings, built = bench.settings(bench.scene.reference, "reference"), bench.problem()
    solver: Any = solvers.find(bench.scene.reference.solver, bench.scene.place)
    frames = tuple(frame for frame in built.frames if request["last"] is None or frame <= request["last"])

    def solve(rest: bool) -> tuple[Outcome, Floats]:
        reached: list[Frame] = []

        def keep(frame: Frame) -> None:
            reached[:] = [frame]

        outcome = solver.solve(replace(built, frames=frames[:1] if rest else frames), settings, keep)
        return outcome, reached[0].tets if reached and reached[0].tets is not None else built.mesh.points

    return fingerprint(built.mesh.points, built.mesh.tets, np.array(frames)), solve


def _processor() -> float:
    """Processor time [s] of this process and of those that it started and that have ended."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)


def main(order: Path) -> None:
    """Carry out the JSON in the file ``order``: solve what the ``request`` asks for, before it the first frame alone where it is to
    ``warm`` up; write what that took into ``facts``, JSON, and the last ``positions``, npz.

    RuntimeError where the package is not that below ``root``.
    """
    wanted = json.loads(order.read_text(encoding="utf-8"))
    package = Path(subprocesses.__file__).resolve().parents[1]
    if package.parent != Path(wanted["root"]).resolve():
        raise RuntimeError(f"fem_reference is that of {package.parent}, not of {wanted['root']}")
    request = wanted["request"]
    mesh, solve = (muscle if "case" in request else small)(request)
    if wanted["warm"]:
        solve(True)
    begin, processor = time.perf_counter(), _processor()
    outcome, positions = solve(False)
    wall, processor = time.perf_counter() - begin, _processor() - processor
    cost = {name: value for name, value in outcome.cost.items() if name != "seconds_mesh"}  # made before the clock ran
    facts = {
        "status": outcome.status,
        "message": outcome.message,
        "mesh": mesh,
        "wall": wall,
        "processor": processor,
        "cost": cost,
    }
    np.savez(wanted["positions"], allow_pickle=False, positions=positions)
    Path(wanted["facts"]).write_text(json.dumps(facts), encoding="utf-8")


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the processes that solve end too
    main(Path(sys.argv[1]))
