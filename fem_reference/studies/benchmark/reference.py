"""The finite element reference timed by phase, each body in processes of its own, and beside it that of an earlier commit.

Repeats are interleaved, before and now in turn, so that what else the machine does meanwhile meets both.
"""

import json
import logging
import os
import subprocess
import tempfile
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.subprocesses import command
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING
from fem_reference.solvers import fenicsx
from fem_reference.studies.benchmark.checkout import ROOT, Commit, checked_out
from fem_reference.studies.execution import Bench

log = logging.getLogger(__name__)

# Element, rings and slices of each fusiform body: 25 000 to 29 000 unknowns.
FUSIFORM = {
    "fusiform_Q1/P0": ("Q1/P0", 4, 30),
    "fusiform_P2/P0": ("P2/P0", 2, 18),
    "fusiform_P2/P1": ("P2/P1", 2, 20),
}
ALL_FUSIFORM = "fusiform"
# A muscle among bones, its run as far as 1 rad, and all of it.
WITH_DATA = ("gluteus_maximus:100", "gluteus_maximus")
REPEATS, REPEATS_OF_MUSCLE = 3, 1
BEFORE, NOW = "before", "now"
_PROGRAM = Path(__file__).with_name("timing.py")


@dataclass(frozen=True)
class Timed:
    """What is timed: its ``name``, the ``request`` that ``timing`` gets, and how often."""

    name: str
    request: dict[str, Any]
    repeats: int


@dataclass(frozen=True)
class Taken:
    """One solution: how it ended, the fingerprint of its ``mesh`` and frames, ``wall`` time and ``processor`` time of all its
    processes [s], and its ``cost`` as its outcome has it.
    """

    status: str
    message: str
    mesh: str
    wall: float
    processor: float
    cost: dict[str, float]

    @property
    def numbers(self) -> dict[str, float]:
        """All that was measured: total times first, then phases and counts."""
        return {"seconds_wall": self.wall, "seconds_processor": self.processor} | self.cost


@dataclass(frozen=True)
class Ratio:
    """Before over now: the median over the repeats, the smallest and the greatest."""

    median: float
    minimum: float
    maximum: float


@dataclass(frozen=True, eq=False)
class Timing:
    """A body: by side, ``BEFORE`` where there is one and ``NOW``, what each repeat took, and the final positions (n, 3) [mm] of the
    nodes of the mesh in the last.
    """

    name: str
    taken: dict[str, tuple[Taken, ...]]
    positions: dict[str, Floats]

    @property
    def converged(self) -> bool:
        """Whether every repeat of every side did."""
        return all(one.status == "converged" for repeats in self.taken.values() for one in repeats)

    @property
    def names(self) -> list[str]:
        """What was measured on either side, in order: what is there now comes first."""
        sides = [one.numbers for side in (NOW, BEFORE) for one in self.taken.get(side, ())]
        return list(dict.fromkeys(name for numbers in sides for name in numbers))

    def values(self, side: str, name: str) -> list[float] | None:
        """The number ``name`` in each repeat of a ``side``; None where it has none."""
        repeats = [one.numbers for one in self.taken.get(side, ())]
        return [numbers[name] for numbers in repeats] if repeats and all(name in one for one in repeats) else None

    def ratio(self, name: str) -> Ratio | None:
        """How many times as great ``name`` was before as it is now; None where not all of it is there."""
        before, now = self.values(BEFORE, name), self.values(NOW, name)
        return None if before is None or now is None or not self.converged else ratio(before, now)

    @property
    def difference(self) -> float | None:
        """The greatest distance between the final positions of a node before and now [mm]; None where not both are there."""
        if BEFORE not in self.taken or not self.converged:
            return None
        return difference(self.positions[BEFORE], self.positions[NOW])


def ratio(before: Sequence[float], now: Sequence[float]) -> Ratio | None:
    """Repeat by repeat, which were taken one after the other; None where one is not above 0.

    >>> ratio([6.0, 8.0, 9.0], [2.0, 2.0, 9.0])
    Ratio(median=3.0, minimum=1.0, maximum=4.0)
    """
    if not min(*before, *now) > 0:
        return None
    ratios = np.divide(before, now)
    return Ratio(float(np.median(ratios)), float(ratios.min()), float(ratios.max()))


def difference(before: Floats, now: Floats) -> float:
    """The greatest distance [mm] between positions (n, 3) of the same nodes."""
    return float(np.linalg.norm(now - before, axis=1).max())


def default() -> tuple[list[str], dict[str, str]]:
    """What is timed where nothing is named, and by name why the rest is left out."""
    if os.environ.get(DATA_SETTING):
        return [*FUSIFORM, *WITH_DATA], {}
    return list(FUSIFORM), dict.fromkeys(WITH_DATA, f"its data is not here: {DATA_SETTING} is not set")


def bodies(names: Iterable[str], repeats: int | None = None, ranks: int | None = None) -> list[Timed]:
    """What is timed by these ``names``: fusiform bodies, and muscle cases as ``CASE`` or ``CASE:FRAME``, the last frame. InputError
    where something is wrong with one, before anything is timed.
    """
    if repeats is not None and repeats < 1:
        raise InputError("--repeats", repeats, "1 or more")
    whole = [one for name in names for one in (FUSIFORM if name == ALL_FUSIFORM else [name])]
    made = []
    for name in dict.fromkeys(whole):
        if name in FUSIFORM:
            fenicsx.require(fenicsx.BodySettings())
            element, rings, slices = FUSIFORM[name]
            request = {"element": element, "rings": rings, "slices": slices}
            made.append(Timed(name, request, repeats or REPEATS))
        else:
            made.append(Timed(name, _muscle(name, ranks), repeats or REPEATS_OF_MUSCLE))
    return made


def _muscle(name: str, ranks: int | None) -> dict[str, Any]:
    """The request of a muscle case, which can be read and solved."""
    case, colon, frame = name.rpartition(":")
    case, last = (case, int(frame)) if colon and frame.isdecimal() else (name, None)
    try:
        scene = casefile.read_muscle(case)
    except InputError as error:
        raise InputError(
            "CASE", f'"{name}" ({error})', f"a case, or one of {ALL_FUSIFORM}, {', '.join(FUSIFORM)}"
        ) from error
    if last is not None and not scene.frames.first < last <= scene.frames.last:
        raise InputError("CASE", f'"{name}"', f"a frame above {scene.frames.first}, up to {scene.frames.last}")
    bench = Bench(scene, Path(), ranks)
    solvers.require(scene.reference.solver, bench.settings(scene.reference, "reference"), "reference")
    bench.setup()  # what is missing shows before anything is timed
    # Each commit has its own shipped cases; another is the same file for both.
    where = case if case in casefile.cases() else str(Path(case).resolve())
    return {"case": where, "last": last, "ranks": ranks}


def measure(timed: Iterable[Timed], against: Commit | None = None) -> list[Timing]:
    """Each body by this package as it is now and, in turn, by that of the commit ``against``."""
    with nullcontext() if against is None else checked_out(against) as earlier:
        roots = {NOW: ROOT} if earlier is None else {BEFORE: earlier, NOW: ROOT}
        return [_measure(one, roots, against) for one in timed]


def _measure(timed: Timed, roots: dict[str, Path], against: Commit | None) -> Timing:
    taken: dict[str, list[Taken]] = {side: [] for side in roots}
    positions: dict[str, Floats] = {}
    for repeat in range(timed.repeats):
        for side, root in roots.items():
            called = side if side == NOW or against is None else against.short
            log.info("%s: %s, repeat %d of %d", timed.name, called, repeat + 1, timed.repeats)
            try:
                one, positions[side] = _take(timed.request, root, warm=repeat == 0)
            except ChildProcessError as error:
                if side == NOW or against is None:
                    raise
                got = f'"{against.asked}", where {timed.name} could not be timed ({error})'
                raise InputError("--against", got, "a commit that can solve it") from error
            log.info("%s: %s, %.1f s, %.1f s of processor time", timed.name, one.status, one.wall, one.processor)
            taken[side].append(one)
            if against is not None and one.mesh != taken[next(iter(roots))][0].mesh:
                got = f'"{against.asked}", where {timed.name} has another mesh or other frames than now'
                raise InputError("--against", got, "a commit that makes the same of it, to compare the same work")
    return Timing(timed.name, {side: tuple(repeats) for side, repeats in taken.items()}, positions)


def _take(request: dict[str, Any], root: Path, *, warm: bool) -> tuple[Taken, Floats]:
    """One solution of what a ``request`` asks for by the package below ``root``, and the final positions (n, 3) [mm]; compiled code
    is made beforehand where it is to ``warm`` up. ChildProcessError where the process fails.
    """
    with tempfile.TemporaryDirectory(prefix="fem_reference-") as name:
        folder = Path(name)
        order, facts, positions = folder / "order.json", folder / "facts.json", folder / "positions.npz"
        wanted = {"root": str(root), "request": request, "warm": warm, "facts": str(facts), "positions": str(positions)}
        order.write_text(json.dumps(wanted), encoding="utf-8")
        run_alone(command(str(_PROGRAM), str(order)), root)
        with np.load(positions, allow_pickle=False) as arrays:
            return Taken(**json.loads(facts.read_text(encoding="utf-8"))), arrays["positions"]


def run_alone(command_line: list[str], root: Path) -> None:
    """Run it with the package below ``root`` before any other; it has ended after this, whatever happens."""
    theirs = [str(Path(path).absolute()) for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(root), *theirs]), "OMP_NUM_THREADS": "1"}
    with subprocess.Popen(
        command_line,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    ) as process:
        try:
            _, errors = process.communicate()
        finally:
            process.terminate()  # nothing where it has ended; else it ends those that solve for it
    if process.returncode != 0:
        lines = errors.strip().splitlines() or ["without a word"]
        raise ChildProcessError(f"exit status {process.returncode}: {lines[-1]}")
