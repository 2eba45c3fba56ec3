"""The reference against its peers: as JSON, and as a table for people."""

import math
import os
from typing import Any

from fem_reference.studies.benchmark import peer_problem, peers
from fem_reference.studies.benchmark.against_peers import Comparison
from fem_reference.studies.benchmark.reference import Ratio


def facts(found: list[Comparison]) -> dict[str, Any]:
    """All of it as JSON has it."""
    return {
        "problem": _problem(),
        "cores": os.cpu_count(),
        "peers": {name: {"versions": peers.versions(name), "tuned": peers.find(name).TUNED} for name in peers.names()},
        "bodies": [
            {
                "element": one.element,
                "cells": one.cells,
                "left_out": one.left_out,
                "taken": {name: [vars(each) for each in repeats] for name, repeats in one.taken.items()},
                "times_as_long": {name: _ratios(one, name) for name in one.taken if name != peers.OURS},
                "difference_mm": {name: one.difference(name) for name in one.taken if name != peers.OURS},
            }
            for one in found
        ],
    }


def _problem() -> dict[str, Any]:
    return {
        "effects": peer_problem.acting(),
        "turned_degrees": round(math.degrees(peer_problem.ANGLE), 6),
        "stretched_percent": 100 * peer_problem.STRETCH,
        "load_steps": peer_problem.FRAMES,
        "residual_N": peer_problem.RESIDUAL,
    }


def _ratios(one: Comparison, name: str) -> dict[str, Any]:
    found = {key: one.ratio(name, key) for key in ("wall", "processor")}
    return {key: vars(value) for key, value in found.items() if value is not None}


def text(found: list[Comparison]) -> str:
    """The same for people: for each body a row a peer, medians over the repeats."""
    asked = _problem()
    head = (
        f"fusiform muscle ({asked['effects']}), stretched {asked['stretched_percent']:g} % and turned by "
        f"{asked['turned_degrees']:g} degrees in {asked['load_steps']} load steps, out of balance below {asked['residual_N']:g} N"
    )
    lines = [head]
    for one in found:
        lines += ["", *_body(one)]
    lines += ["", "one thread each; what is compiled or imported is not timed. How each was tuned:"]
    lines += [f"  {name} {_versions(name)}: {peers.find(name).TUNED}" for name in peers.names()]
    return "\n".join(lines)


def _body(one: Comparison) -> list[str]:
    repeats = max(map(len, one.taken.values()), default=0)
    lines = [
        f"{one.element}, {one.cells} cells, repeats: {repeats}",
        f"  {'':12}{'wall [s]':>10}{'processor [s]':>15}{'unknowns':>10}{'Newton':>8}  times as long, median (minimum to maximum)",
    ]
    for name, taken in one.taken.items():
        last = taken[-1]
        if not one.converged(name):
            lines.append(f"  {name:12}did not converge: {next(each.message for each in taken if not each.converged)}")
            continue
        numbers = f"{one.median(name, 'wall'):>10.2f}{one.median(name, 'processor'):>15.2f}{last.unknowns:>10}{last.iterations:>8}"
        lines.append(f"  {name:12}{numbers}{'' if name == peers.OURS else _beside(one, name)}")
    return lines + [f"  {name}: left out, {reason}" for name, reason in one.left_out.items()]


def _beside(one: Comparison, name: str) -> str:
    wall, processor, off = one.ratio(name, "wall"), one.ratio(name, "processor"), one.difference(name)
    if wall is None or processor is None or off is None:
        return ""
    return f"  wall {_spread(wall)}, processor {_spread(processor)}; ends {off:.1g} mm away at most"


def _spread(ratio: Ratio) -> str:
    return f"{ratio.median:.2f} ({ratio.minimum:.2f} to {ratio.maximum:.2f})"


def _versions(name: str) -> str:
    return ", ".join(f"{package} {version or 'not installed'}" for package, version in peers.versions(name).items())
