"""The reference timed against what a user would take instead: the same problem, mesh, element, law, load steps and tolerance.

Every solution is in a process of its own, on one thread; repeats are interleaved, so that what else the machine does meanwhile
meets all of them. What is compiled or imported is made beforehand, for all.
"""

import json
import logging
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.subprocesses import command
from fem_reference.studies.benchmark import peer_problem, peers
from fem_reference.studies.benchmark.checkout import ROOT
from fem_reference.studies.benchmark.reference import FUSIFORM, Ratio, difference, ratio, run_alone

log = logging.getLogger(__name__)

# Element, rings and slices of the bodies. On shorter quadratic tetrahedra det F falls to 0 where the clamped rim is pressed, before
# the end: the reference ends there, and its peers do not look.
BODIES = (FUSIFORM["fusiform_Q1/P0"], ("P2/P0", 2, 14))
REPEATS = 3
_PROGRAM = Path(__file__).with_name("peer_program.py")


@dataclass(frozen=True)
class Taken:
    """One solution: how it ended, Newton ``iterations`` and ``unknowns``, ``wall`` and ``processor`` time [s]."""

    converged: bool
    message: str
    iterations: int
    unknowns: int
    wall: float
    processor: float


@dataclass(frozen=True, eq=False)
class Comparison:
    """A body in an ``element`` of so many ``cells``: by peer, what each repeat took and the final positions (n, 3) [mm] of the
    corners in the last; and by peer why it is left out.
    """

    element: str
    cells: int
    taken: dict[str, tuple[Taken, ...]]
    positions: dict[str, Floats]
    left_out: dict[str, str]

    def converged(self, peer: str) -> bool:
        """Whether it did in every repeat."""
        return all(one.converged for one in self.taken[peer])

    def median(self, peer: str, name: str) -> float:
        """The median of ``wall`` or ``processor`` over the repeats [s]."""
        return float(np.median([getattr(one, name) for one in self.taken[peer]]))

    def ratio(self, peer: str, name: str) -> Ratio | None:
        """How many times as long a peer took as the reference, repeat by repeat; None where one of the two did not converge."""
        if peers.OURS not in self.taken or not (self.converged(peer) and self.converged(peers.OURS)):
            return None
        theirs, ours = ([getattr(one, name) for one in self.taken[who]] for who in (peer, peers.OURS))
        return ratio(theirs, ours)

    def difference(self, peer: str) -> float | None:
        """The greatest distance between its final positions and those of the reference [mm]; None where one has none."""
        if peers.OURS not in self.taken or not (self.converged(peer) and self.converged(peers.OURS)):
            return None
        return difference(self.positions[peers.OURS], self.positions[peer])


def measure(bodies: Iterable[tuple[str, int, int]] | None = None, repeats: int | None = None) -> list[Comparison]:
    """Every body, by default all, by every peer that is installed and has the element."""
    bodies, repeats = BODIES if bodies is None else bodies, REPEATS if repeats is None else repeats
    if repeats < 1:
        raise InputError("--repeats", repeats, "1 or more")
    return [_compare(body, repeats) for body in bodies]


def _compare(body: tuple[str, int, int], repeats: int) -> Comparison:
    element = body[0]
    reasons = {name: peers.find(name).OMITTED.get(element) or peers.missing(name) for name in peers.names()}
    left_out = {name: reason for name, reason in reasons.items() if reason is not None}
    taken: dict[str, list[Taken]] = {name: [] for name in reasons if name not in left_out}
    positions: dict[str, Floats] = {}
    for repeat in range(repeats):
        for name in list(taken):
            log.info("%s: %s, repeat %d of %d", element, name, repeat + 1, repeats)
            try:
                one, positions[name] = _take(name, body)
            except ChildProcessError as error:
                left_out[name] = f"failed: {error}"
                del taken[name]
                continue
            log.info("%s: %s, %.1f s, %.1f s of processor time", element, name, one.wall, one.processor)
            taken[name].append(one)
    cells = len(peer_problem.muscle(*body).mesh.cells)
    return Comparison(element, cells, {name: tuple(each) for name, each in taken.items()}, positions, left_out)


def _take(peer: str, body: tuple[str, int, int]) -> tuple[Taken, Floats]:
    """One solution by a peer; ChildProcessError where its process fails."""
    with tempfile.TemporaryDirectory(prefix="fem_reference-") as name:
        folder = Path(name)
        order, facts, positions = folder / "order.json", folder / "facts.json", folder / "positions.npz"
        wanted: dict[str, Any] = {"peer": peer, "body": body, "facts": str(facts), "positions": str(positions)}
        order.write_text(json.dumps(wanted), encoding="utf-8")
        run_alone(command(str(_PROGRAM), str(order)), ROOT)
        with np.load(positions, allow_pickle=False) as arrays:
            return Taken(**json.loads(facts.read_text(encoding="utf-8"))), arrays["positions"]
