"""The reference timed beside what a user would take instead: the same problem, mesh, element, law, load steps and tolerance.

``python -m benchmarks.peers [--repeats N] [--json FILE]``. Every solution is in a process of its own, on one thread; repeats are
interleaved, so that what else the machine does meanwhile meets all of them. The time of compilation and imports is not counted.
"""

import argparse
import json
import multiprocessing
import os
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import peers
from benchmarks.peers import problem
from benchmarks.reference import processor
from fem_reference.foundations.mesh import Floats

# Element, rings and slices of the bodies. On shorter quadratic tetrahedra det F falls to 0 where the clamped rim is pressed, before
# the end: the reference ends there, and its peers do not look.
BODIES = (("Q1/P0", 4, 30), ("P2/P0", 2, 14))
REPEATS = 3
# Solved first, which compiles and loads what the work needs: rings, slices and load steps.
WARM_UP = (1, 4, 1)


@dataclass(frozen=True)
class Taken:
    """One solution: its end, Newton ``iterations`` and ``unknowns``, ``wall`` and ``processor`` time [s]."""

    converged: bool
    message: str
    iterations: int
    unknowns: int
    wall: float
    processor: float


@dataclass(frozen=True, eq=False)
class Compared:
    """A body in an ``element`` of so many ``cells``: by peer, what each repeat took and the final positions (n, 3) [mm] of the
    corners in the last; and by peer why it is left out.
    """

    element: str
    cells: int
    taken: dict[str, list[Taken]]
    positions: dict[str, Floats]
    left_out: dict[str, str]

    def converged(self, *names: str) -> bool:
        """Whether all of these peers did in every repeat."""
        return all(name in self.taken and all(one.converged for one in self.taken[name]) for name in names)

    def ratio(self, name: str, time: str) -> dict[str, float] | None:
        """Time of a peer, ``wall`` or ``processor``, over that of the reference, repeat by repeat, which were taken one after the
        other: median, minimum and maximum; None where one of the two did not converge.
        """
        if not self.converged(name, peers.OURS):
            return None
        theirs, ours = ([getattr(one, time) for one in self.taken[who]] for who in (name, peers.OURS))
        ratios = np.divide(theirs, ours)
        return {"median": float(np.median(ratios)), "minimum": float(ratios.min()), "maximum": float(ratios.max())}

    def difference(self, name: str) -> float | None:
        """The greatest distance between its final positions and those of the reference [mm]; None where one has none."""
        if not self.converged(name, peers.OURS):
            return None
        return float(np.linalg.norm(self.positions[name] - self.positions[peers.OURS], axis=1).max())


def take(peer: str, body: tuple[str, int, int]) -> tuple[Taken, Floats]:
    """One solution of a ``body`` by a peer in this process, and its final positions."""
    with peers.find(peer).opened() as solve:
        solve(problem.muscle(body[0], *WARM_UP))
        muscle = problem.muscle(*body)
        begin, before = time.perf_counter(), processor()
        solved = solve(muscle)
        wall, spent = time.perf_counter() - begin, processor() - before
    return Taken(solved.converged, solved.message, solved.iterations, solved.unknowns, wall, spent), solved.positions


def compare(body: tuple[str, int, int], repeats: int) -> Compared:
    """A body by every peer that is installed and has the element, each time in a process of its own."""
    reasons = {name: peers.find(name).OMITTED.get(body[0]) or peers.missing(name) for name in peers.NAMES}
    left_out = {name: reason for name, reason in reasons.items() if reason is not None}
    taken: dict[str, list[Taken]] = {name: [] for name in reasons if name not in left_out}
    positions: dict[str, Floats] = {}
    for repeat in range(repeats):
        for name in list(taken):
            sys.stderr.write(f"{body[0]}: {name}, repeat {repeat + 1} of {repeats}\n")
            try:
                with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
                    one, positions[name] = process.submit(take, name, body).result()
            except Exception as error:  # whatever happens to one, the others are measured
                left_out[name] = f"failed: {error}"
                del taken[name]
                continue
            taken[name].append(one)
    return Compared(body[0], len(problem.muscle(*body).mesh.cells), taken, positions, left_out)


def facts(found: Sequence[Compared]) -> dict[str, Any]:
    """All of it as JSON has it."""
    return {
        "problem": problem.facts(),
        "cores": os.cpu_count(),
        "peers": {name: {"versions": peers.versions(name), "tuned": peers.find(name).TUNED} for name in peers.NAMES},
        "bodies": [
            {
                "element": one.element,
                "cells": one.cells,
                "left_out": one.left_out,
                "taken": {name: [vars(each) for each in repeats] for name, repeats in one.taken.items()},
                "times_as_long": {
                    name: {key: one.ratio(name, key) for key in ("wall", "processor")} for name in _others(one)
                },
                "difference_mm": {name: one.difference(name) for name in _others(one)},
            }
            for one in found
        ],
    }


def text(found: Sequence[Compared]) -> str:
    """The same for people: for each body a row a peer, medians over the repeats."""
    asked = problem.facts()
    head = (
        f"fusiform muscle ({asked['effects']}), stretched {asked['stretched_percent']:g} % and turned by "
        f"{asked['turned_degrees']:g} degrees in {asked['load_steps']} load steps, residual below {asked['residual_N']:g} N"
    )
    lines = [head]
    for one in found:
        lines += ["", *_body(one)]
    lines += ["", "one thread each; what is compiled or imported is not timed. How each was tuned:"]
    for name in peers.NAMES:
        named = (f"{package} {version or 'not installed'}" for package, version in peers.versions(name).items())
        lines.append(f"  {name} {', '.join(named)}: {peers.find(name).TUNED}")
    return "\n".join(lines)


def _others(one: Compared) -> list[str]:
    return [name for name in one.taken if name != peers.OURS]


def _body(one: Compared) -> list[str]:
    repeats = max(map(len, one.taken.values()), default=0)
    lines = [
        f"{one.element}, {one.cells} cells, repeats: {repeats}",
        f"  {'':12}{'wall [s]':>10}{'processor [s]':>15}{'unknowns':>10}{'Newton':>8}  times as long, median (minimum to maximum)",
    ]
    for name, taken in one.taken.items():
        if not one.converged(name):
            lines.append(f"  {name:12}did not converge: {next(each.message for each in taken if not each.converged)}")
            continue
        wall, spent = (float(np.median([getattr(each, key) for each in taken])) for key in ("wall", "processor"))
        numbers = f"{wall:>10.2f}{spent:>15.2f}{taken[-1].unknowns:>10}{taken[-1].iterations:>8}"
        lines.append(f"  {name:12}{numbers}{_beside(one, name)}")
    return lines + [f"  {name}: left out, {reason}" for name, reason in one.left_out.items()]


def _beside(one: Compared, name: str) -> str:
    """Times as long as the reference, and the distance from it; nothing beside the reference itself."""
    ratios = {key: one.ratio(name, key) for key in ("wall", "processor")}
    if name == peers.OURS or not one.converged(peers.OURS):
        return ""
    spread = (
        f"{key} {found['median']:.2f} ({found['minimum']:.2f} to {found['maximum']:.2f})"
        for key, found in ratios.items()
        if found is not None
    )
    return f"  {', '.join(spread)}; ends {one.difference(name):.1g} mm away at most"


def main(words: Sequence[str] | None = None) -> int:
    """Measure all bodies; the exit status, 1 where a solution did not converge."""
    parser = argparse.ArgumentParser(prog="benchmarks.peers", description=__doc__)
    parser.add_argument("--repeats", type=int, default=REPEATS, metavar="N", help=f"how often (default: {REPEATS})")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all that was measured into FILE too")
    options = parser.parse_args(words)
    os.environ["OMP_NUM_THREADS"] = "1"
    found = [compare(body, max(options.repeats, 1)) for body in BODIES]
    if options.json:
        options.json.write_text(json.dumps(facts(found), indent=1), encoding="utf-8")
    sys.stdout.write(text(found) + "\n")
    return 0 if all(one.converged(*one.taken) for one in found) else 1


if __name__ == "__main__":
    sys.exit(main())
